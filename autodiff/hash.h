/* FNV-1a of 64 bits (G. Fowler, L. Noll, P. Vo): tells data apart; against accidents, not malice.
 */
#ifndef AUTODIFF_HASH_H
#define AUTODIFF_HASH_H

#include <stddef.h>
#include <stdint.h>

#define AD_HASH_BEGIN UINT64_C(0xcbf29ce484222325)

/* The hash of what was hashed so far, AD_HASH_BEGIN if nothing, and of n bytes behind it. */
static inline uint64_t ad_hash(uint64_t hash, const void *bytes, size_t n)
{
    for (const unsigned char *b = bytes, *end = b + n; b < end; b++)
        hash = (hash ^ *b) * UINT64_C(0x100000001b3);
    return hash;
}

#endif
