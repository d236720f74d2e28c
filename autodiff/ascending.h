/* The order of numbers for qsort: ascending, with no place for NaN. */
#ifndef AUTODIFF_ASCENDING_H
#define AUTODIFF_ASCENDING_H

static inline int ad_ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

#endif
