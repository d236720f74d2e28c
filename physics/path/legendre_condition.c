/* Legendre's condition: the Morse index is meaningful only where L_vv is positive definite along
   the path (Gelfand, Fomin, Calculus of Variations, sections 25 to 29). Where it is indefinite, the
   second variation has infinitely many directions of either sign, and the Hessian of a grid as many
   as the grid has nodes. */
#include "spectrum.h"

#include <math.h>

/* Pivots of D^-1 (sign M) D^-1, D^2 the diagonal, below this are zero. */
static const double singular = 1e-12;

/* Whether sign * M is positive definite, a band of which element (j + k, j), k <= width, is M[j *
   (width + 1) + k]; the factor of Cholesky is written over M. */
static bool is_positive(size_t n, size_t width, double sign, double *M)
{
    for (size_t j = 0; j < n; j++) {
        const size_t first = j > width ? j - width : 0, end = n - j > width ? j + width + 1 : n;
        double *column = M + j * (width + 1);
        double diagonal = sign * column[0], pivot = diagonal;
        for (size_t k = first; k < j; k++)
            pivot -= M[k * width + j] * M[k * width + j];
        if (!(pivot > singular * diagonal)) /* NaN, too */
            return false;
        pivot = sqrt(pivot);
        for (size_t i = j + 1; i < end; i++) {
            double sum = sign * column[i - j];
            for (size_t k = i > width ? i - width : 0; k < j; k++)
                sum -= M[k * width + i] * M[k * width + j];
            column[i - j] = sum / pivot;
        }
        column[0] = pivot;
    }
    return true;
}

enum phys_definite phys_hessian_definite(struct phys_hessian *h, double *time)
{
    size_t matrix = h->dof * (h->around + 1);
    enum phys_definite all = h->mass[0] > 0 ? PHYS_POSITIVE : PHYS_NEGATIVE;
    double sign = all == PHYS_POSITIVE ? 1 : -1;
    *time = (double)INFINITY;
    for (size_t p = 0; p < h->points; p++) {
        double t = phys_hessian_time(h, p);
        if (t < *time && !is_positive(h->dof, h->around, sign, h->mass + p * matrix))
            *time = t;
    }
    return isinf(*time) ? all : PHYS_INDEFINITE;
}
