/* LU of a matrix whose entries are near the diagonal: kept as a band, or whole where that takes
   fewer numbers. */
#ifndef PHYSICS_LINEAR_LU_H
#define PHYSICS_LINEAR_LU_H

#include "linear.h"

struct phys_lu {
    size_t n, width; /* rows; entries are at most `width` from the diagonal */
    bool band;
    double *a;   /* phys_lu_at */
    int *pivots; /* [n] */
};

/* Ends with phys_lu_free, whatever it returned. False: no memory. */
bool phys_lu_new(struct phys_lu *lu, size_t n, size_t width);
void phys_lu_free(struct phys_lu *lu);
/* All entries 0, to be set, of n rows and a width that are no larger than it was made for. */
void phys_lu_clear(struct phys_lu *lu, size_t n, size_t width);
static inline double *phys_lu_at(const struct phys_lu *lu, size_t i, size_t j)
{
    return lu->a + (lu->band ? PHYS_BAND(lu->width, i, j) : i * lu->n + j);
}
/* Factors it in place. Returns 0, or 1 + the index of a zero pivot. */
int phys_lu_factor(struct phys_lu *lu);
/* b [n] becomes the solution. */
void phys_lu_solve(const struct phys_lu *lu, double *b);

#endif
