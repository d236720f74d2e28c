/* Products of vectors [n]. */
#ifndef PHYSICS_LINEAR_VECTORS_H
#define PHYSICS_LINEAR_VECTORS_H

#include <math.h>
#include <stddef.h>

static inline double phys_dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += a[k] * b[k];
    return sum;
}

static inline double phys_norm(size_t n, const double *a) { return sqrt(phys_dot(n, a, a)); }

#endif
