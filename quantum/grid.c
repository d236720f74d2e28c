/* Points of the grid. */
#include "internal.h"

#include <math.h>

double qm_dx(const struct qm_grid *grid)
{
    return grid && grid->n ? (grid->high - grid->low) / (double)grid->n : (double)NAN;
}

double qm_x(const struct qm_grid *grid, size_t a)
{
    return grid ? grid->low + ((double)a + 0.5) * qm_dx(grid) : (double)NAN;
}

void qm_unknown(size_t n, size_t stride, qm_complex *psi)
{
    for (size_t a = 0; psi && a < n; a++)
        psi[a * stride] = (double)NAN;
}
