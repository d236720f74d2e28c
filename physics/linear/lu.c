/* LU of a band or a whole matrix (lu.h). */
#include "lu.h"
#include "autodiff/free.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Numbers of a row. */
static size_t row(const struct phys_lu *lu) { return lu->band ? PHYS_BAND_ROWS(lu->width) : lu->n; }

bool phys_lu_new(struct phys_lu *lu, size_t n, size_t width)
{
    *lu = (struct phys_lu){.n = n, .width = width, .band = 2 * PHYS_BAND_ROWS(width) < n};
    if (n > SIZE_MAX / sizeof *lu->a / (row(lu) + 1))
        return false;
    lu->a = malloc(n * row(lu) * sizeof *lu->a);
    lu->pivots = malloc(n * sizeof *lu->pivots);
    return lu->a && lu->pivots;
}

void phys_lu_free(struct phys_lu *lu) { AD_FREE(lu->a, lu->pivots); }

void phys_lu_clear(struct phys_lu *lu, size_t n, size_t width)
{
    lu->n = n;
    lu->width = width;
    memset(lu->a, 0, n * row(lu) * sizeof *lu->a);
}

int phys_lu_factor(struct phys_lu *lu)
{
    return lu->band ? phys_lapack_band_factor(lu->n, lu->width, lu->a, lu->pivots)
                    : phys_lapack_lu_factor(lu->n, lu->a, lu->pivots);
}

void phys_lu_solve(const struct phys_lu *lu, double *b)
{
    if (lu->band)
        phys_lapack_band_solve(lu->n, lu->width, lu->a, lu->pivots, b);
    else
        phys_lapack_lu_solve(lu->n, lu->a, lu->pivots, b);
}
