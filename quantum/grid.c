/* Points of a grid. */
#include "quantum.h"

double qm_dx(const struct qm_grid *grid) { return (grid->high - grid->low) / (double)grid->n; }

double qm_x(const struct qm_grid *grid, size_t a)
{
    return grid->low + ((double)a + 0.5) * qm_dx(grid);
}
