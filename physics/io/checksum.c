/* Checksums of files (checksum.h), by FNV-1a. */
#include "checksum.h"
#include "autodiff/hash.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static const char format[] = "leastaction, sealed: fnv1a %016" PRIx64 " of %" PRIu64 " bytes\n";
enum { SAME = 20, BEFORE = 27 }; /* characters that every seal begins with; before the hash */

/* The checksum of an open file: the hash of the bytes after it. */
static bool seal_of(FILE *in, char seal[PHYS_CHECKSUM_BYTES])
{
    unsigned char block[1 << 14];
    uint64_t hash = AD_HASH_BEGIN, n = 0;
    if (fseek(in, PHYS_CHECKSUM_BYTES, SEEK_SET) != 0)
        return false;
    for (size_t read; (read = fread(block, 1, sizeof block, in)) > 0; n += read)
        hash = ad_hash(hash, block, read);
    memset(seal, 0, PHYS_CHECKSUM_BYTES);
    snprintf(seal, PHYS_CHECKSUM_BYTES, format, hash, n);
    return !ferror(in);
}

enum ad_status phys_checksum_write(const char *file, const char *name, struct ad_error *error)
{
    char seal[PHYS_CHECKSUM_BYTES];
    FILE *out = fopen(file, "r+b");
    bool written = out && seal_of(out, seal) && fseek(out, 0, SEEK_SET) == 0 &&
                   fwrite(seal, 1, sizeof seal, out) == sizeof seal;
    if (out)
        written = fclose(out) == 0 && written;
    return written ? AD_OK
                   : ad_fail(error, AD_E_IO, "%s: cannot be written: %s", name, strerror(errno));
}

enum ad_status phys_checksum_check(const char *file, const char *name, struct ad_error *error)
{
    char seal[PHYS_CHECKSUM_BYTES], found[PHYS_CHECKSUM_BYTES] = "";
    FILE *in = fopen(file, "rb");
    if (!in)
        return AD_OK; /* the function that opens it reports the reason */
    bool sealed = fread(found, 1, sizeof found, in) > 0 && strncmp(found, format, SAME) == 0;
    bool whole = !sealed || (seal_of(in, seal) && memcmp(seal, found, sizeof seal) == 0);
    fclose(in);
    return whole
               ? AD_OK
               : ad_fail(error, AD_E_INPUT,
                         "%s: damaged: its checksum does not match; expected an intact copy", name);
}

void phys_checksum_read(const char *file, char hash[PHYS_CHECKSUM_DIGITS + 1])
{
    char found[PHYS_CHECKSUM_BYTES] = "";
    FILE *in = fopen(file, "rb");
    const bool sealed =
        in && fread(found, 1, sizeof found, in) > 0 && strncmp(found, format, SAME) == 0;
    snprintf(hash, PHYS_CHECKSUM_DIGITS + 1, "%.*s", PHYS_CHECKSUM_DIGITS,
             sealed ? found + BEFORE : "");
    if (in)
        fclose(in);
}
