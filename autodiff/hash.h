/* FNV-1a hash of 64 bits (G. Fowler, L. Noll, P. Vo). It detects accidental changes, not malicious
   ones. */
#ifndef AUTODIFF_HASH_H
#define AUTODIFF_HASH_H

#include <stddef.h>
#include <stdint.h>

#define AD_HASH_BEGIN UINT64_C(0xcbf29ce484222325)

/* Extends a hash, AD_HASH_BEGIN for the first data, by n bytes. */
static inline uint64_t ad_hash(uint64_t hash, const void *bytes, size_t n)
{
    for (const unsigned char *b = bytes, *end = b + n; b < end; b++)
        hash = (hash ^ *b) * UINT64_C(0x100000001b3);
    return hash;
}

#endif
