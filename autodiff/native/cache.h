/* Files of the cache, shared by reading (cache.c) and writing (build.c). */
#ifndef AUTODIFF_NATIVE_CACHE_H
#define AUTODIFF_NATIVE_CACHE_H

#include "autodiff/hash.h"
#include "native.h"

/* Appended after object and source. */
struct trailer {
    uint64_t object_bytes, source_bytes, checksum;
};

/* The contents of a file that the user owns, freed by the caller; NULL otherwise. */
char *ad_native_read(const char *path, size_t *bytes);

/* Compiles a source to `path`, which is replaced atomically. */
bool ad_native_build(const char *path, const char *source, const char *isa,
                     const struct compiler *compiler, struct ad_error *note);

#endif
