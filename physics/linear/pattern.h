/* Where a symmetric matrix may have entries: with what its columns couple, which of them one
   product gives together, and an order in which it is a narrow band. */
#ifndef PHYSICS_LINEAR_PATTERN_H
#define PHYSICS_LINEAR_PATTERN_H

#include "autodiff/derivatives.h"

#include <stdbool.h>

struct phys_pattern {
    size_t n;
    size_t *start;    /* [n + 1] */
    uint32_t *row;    /* those of column j, ascending: row[start[j]] up to row[start[j + 1] - 1] */
    uint32_t *colour; /* [n], below `colours`: no row has two columns of one colour, so that a
                         product with the sum of their unit vectors gives them all */
    size_t colours;
    uint32_t *order, *place; /* [n]: column order[p] is at place p; place[order[p]] = p */
    size_t width;            /* in this order entries are at most so far from the diagonal */
};

/* Of a symmetric matrix [n x n] given by that of m n rows which becomes it when the indices are
   taken modulo n, such as L's Hessian over (q, v); NULL: everything is coupled. The diagonal is.
   Ends with phys_pattern_free, whatever it returned. False: no memory. */
bool phys_pattern_new(struct phys_pattern *pattern, size_t n, const struct ad_sparse *entries);
bool phys_pattern_has(const struct phys_pattern *pattern, size_t i, size_t j);
void phys_pattern_free(struct phys_pattern *pattern);

#endif
