/* The spread of a number over the runs of an ensemble. */
#ifndef APPS_SPREAD_H
#define APPS_SPREAD_H

#include <stddef.h>

/* Standard deviation with n - 1; NaN of fewer than two. */
struct spread {
    size_t n;
    double mean, deviation, least, most;
};

/* Of n values at a distance of `stride`; those that are not finite are left out. */
struct spread spread_of(size_t n, const double values[], size_t stride);

#endif
