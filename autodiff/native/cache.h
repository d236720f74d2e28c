/* Files of the cache folder: what reading (cache.c) and writing them (build.c) share. */
#ifndef AUTODIFF_CACHE_H
#define AUTODIFF_CACHE_H

#include "autodiff/hash.h"
#include "native.h"

/* Behind object and source. */
struct trailer {
    uint64_t object_bytes, source_bytes, checksum;
};

/* All of a file of the user's own; NULL if it is not that. The caller frees. */
char *ad_native_read(const char *path, size_t *bytes);

/* Compiles a source to the file `path`, which appears whole or not at all. */
bool ad_native_build(const char *path, const char *source, const char *isa,
                     const struct compiler *compiler, struct ad_error *note);

#endif
