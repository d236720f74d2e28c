/* Helpers for fuzzers: bytes as a file, rewritten for every run. TMPDIR=/dev/shm makes it fast. */
#ifndef TESTS_FUZZ_FUZZ_H
#define TESTS_FUZZ_FUZZ_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A fuzzer a file: aborts where what it read is neither taken nor refused as it should be. */
#define FUZZERS(X)                                                                                 \
    X(arguments)                                                                                   \
    X(cache) X(data) X(horizons) X(image) X(library) X(model) X(scene) X(table) X(words)
#define FUZZ_DECLARE(name) int fuzz_##name(const uint8_t *data, size_t size);
FUZZERS(FUZZ_DECLARE)

static char fuzz_name[256];

static void fuzz_remove(void) { unlink(fuzz_name); }

static inline const char *fuzz_file(const uint8_t *data, size_t size)
{
    if (!*fuzz_name) {
        const char *folder = getenv("TMPDIR");
        snprintf(fuzz_name, sizeof fuzz_name, "%s/leastaction-fuzz-%ld", folder ? folder : "/tmp",
                 (long)getpid());
        atexit(fuzz_remove);
    }
    FILE *stream = fopen(fuzz_name, "wb");
    if (!stream || fwrite(data, 1, size, stream) != size || fclose(stream) != 0)
        abort();
    return fuzz_name;
}

/* Bytes as a string, up to the first zero; the caller frees. */
static inline char *fuzz_text(const uint8_t *data, size_t size)
{
    char *text = calloc(1, size + 1);
    if (!text)
        abort();
    return memcpy(text, data, size);
}

/* Aborts, which the fuzzer reports, unless it holds. */
static inline void fuzz_require(int condition)
{
    if (!condition)
        abort();
}

#endif
