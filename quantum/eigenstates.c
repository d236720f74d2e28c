/* The lowest eigenstates of Schroedinger's equation by second-order differences: the Hamiltonian is
   tridiagonal on the grid. */
#include "internal.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>

enum ad_status qm_eigenstates(const struct phys_system *system, const struct qm_grid *grid,
                              double hbar, size_t states, double *energy, double *psi,
                              struct ad_error *error)
{
    if (AD_LACKS(error, system, grid, energy, psi))
        return error->status;
    if (!(hbar > 0) || !(grid->high > grid->low))
        return ad_fail(error, AD_E_ARGUMENT, "eigenstates: expected hbar above 0 and a box");
    size_t n = grid->n;
    double mass, dx = qm_dx(grid);
    if (n < 4 || states < 1 || states > n)
        return ad_fail(error, AD_E_ARGUMENT, "%zu states of %zu points: expected 1 to %zu", states,
                       n, n);
    double *diagonal = malloc(2 * n * sizeof *diagonal);
    if (!diagonal)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    if (qm_potential(system, grid, diagonal, &mass, error) == AD_OK) {
        double hop = hbar * hbar / (2 * mass * dx * dx), *off = diagonal + n;
        for (size_t a = 0; a < n; a++) {
            /* beyond the wall psi has the other sign, half a cell away */
            diagonal[a] += (a == 0 || a == n - 1 ? 3 : 2) * hop;
            off[a] = -hop;
        }
        if (phys_lapack_tridiagonal_eigenvectors(n, diagonal, off, states, energy, psi) != 0)
            ad_fail(error, AD_E_MEMORY, "%zu states of %zu points: LAPACK failed", states, n);
        for (size_t k = 0; error->status == AD_OK && k < states * n; k++)
            psi[k] /= sqrt(dx);
    }
    free(diagonal);
    return error->status;
}
