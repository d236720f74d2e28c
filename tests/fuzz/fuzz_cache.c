/* Fuzzer of cached machine code: only the entry that was written is accepted. */
#include "fuzz.h"

#include "autodiff/native/native.h"

#include <sys/stat.h>

/* The last 24 bytes: lengths of object and source, checksum of the object. */
static int is_entry(const uint8_t *data, size_t size, const char *source)
{
    uint64_t trailer[3], hash = 0xcbf29ce484222325u;
    size_t length = strlen(source);
    if (size < sizeof trailer + length)
        return 0;
    memcpy(trailer, data + size - sizeof trailer, sizeof trailer);
    size_t object = size - sizeof trailer - length;
    for (size_t k = 0; k < object; k++)
        hash = (hash ^ data[k]) * 0x100000001b3u;
    return object > 0 && trailer[0] == object && trailer[1] == length && trailer[2] == hash &&
           memcmp(data + object, source, length) == 0;
}

int fuzz_cache(const uint8_t *data, size_t size)
{
    static const char source[] = "int s0;";
    const char *file = fuzz_file(data, size);
    int whole = is_entry(data, size, source);
    chmod(file, 0600);
    fuzz_require(ad_native_is_intact(file, source) == whole);
    chmod(file, 0620);
    fuzz_require(!ad_native_is_intact(file, source));
    return 0;
}
