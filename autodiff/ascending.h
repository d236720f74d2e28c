/* Orders for qsort: ascending; of doubles, with no place for NaN, and of indices. */
#ifndef AUTODIFF_ASCENDING_H
#define AUTODIFF_ASCENDING_H

#include <stdint.h>

static inline int ad_ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static inline int ad_ascending_indices(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

#endif
