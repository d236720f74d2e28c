/* The spread of a number over the runs of an ensemble. */
#ifndef APPS_OUTPUT_SPREAD_H
#define APPS_OUTPUT_SPREAD_H

#include "report.h"

/* Standard deviation with n - 1; NaN of fewer than two. */
struct spread {
    size_t n;
    double mean, deviation, least, most;
};

/* Of n values at a distance of `stride`; those that are not finite are left out. */
struct spread spread_of(size_t n, const double values[], size_t stride);
/* Rows of an item of the array "spread": a table in the text. */
void spread_report(struct report *report, const char *counted, const char *unit,
                   const struct spread *spread);

#endif
