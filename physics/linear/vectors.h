/* Products, lengths and distances of vectors [n]. */
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

static inline double phys_distance(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(sum);
}

static inline double phys_relative_distance(size_t n, const double *a, const double *b)
{
    return phys_distance(n, a, b) / phys_norm(n, b);
}

/* The largest |a_k|, and the largest |a_k - b_k|; NaN is left out. */
static inline double phys_largest(size_t n, const double *a)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(a[k]));
    return most;
}

static inline double phys_farthest(size_t n, const double *a, const double *b)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(a[k] - b[k]));
    return most;
}

/* The norm of every stride-th number, whose squares may be too small or too large for a double. */
static inline double phys_scaled_norm(size_t n, const double *a, size_t stride)
{
    double most = 0, sum = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(a[k * stride]));
    for (size_t k = 0; k < n && most > 0; k++)
        sum += (a[k * stride] / most) * (a[k * stride] / most);
    return most * sqrt(sum);
}

#endif
