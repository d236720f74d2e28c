/* Legendre's condition: the Morse index is meaningful only where L_vv is positive definite along
   the path (Gelfand, Fomin, Calculus of Variations, sections 25 to 29). Where it is indefinite, the
   second variation has infinitely many directions of either sign, and the Hessian of a grid as many
   as the grid has nodes. */
#include "spectrum.h"

#include <math.h>

/* Pivots of D^-1 (sign M) D^-1, D^2 the diagonal, below this are zero. */
static const double singular = 1e-12;

/* Whether sign * M [n x n] is positive definite; the factor of Cholesky is written over M. */
static bool is_positive(size_t n, double sign, double *M)
{
    for (size_t j = 0; j < n; j++) {
        double diagonal = sign * M[j * n + j], pivot = diagonal;
        for (size_t k = 0; k < j; k++)
            pivot -= M[j * n + k] * M[j * n + k];
        if (!(pivot > singular * diagonal)) /* NaN, too */
            return false;
        pivot = sqrt(pivot);
        for (size_t i = j + 1; i < n; i++) {
            double sum = sign * M[i * n + j];
            for (size_t k = 0; k < j; k++)
                sum -= M[i * n + k] * M[j * n + k];
            M[i * n + j] = sum / pivot;
        }
        M[j * n + j] = pivot;
    }
    return true;
}

enum phys_definite phys_hessian_definite(struct phys_hessian *h, double *time)
{
    size_t matrix = h->dof * h->dof;
    enum phys_definite all = h->mass[0] > 0 ? PHYS_POSITIVE : PHYS_NEGATIVE;
    double sign = all == PHYS_POSITIVE ? 1 : -1;
    *time = (double)INFINITY;
    for (size_t p = 0; p < h->points; p++) {
        double t = phys_hessian_time(h, p);
        if (t < *time && !is_positive(h->dof, sign, h->mass + p * matrix))
            *time = t;
    }
    return isinf(*time) ? all : PHYS_INDEFINITE;
}
