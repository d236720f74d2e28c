/* A slice of a free particle that is too short for the grid, whose sum over paths would alias. A
   long slice backwards is the inverse of one forwards, so K(dt) = K(T)^H K(T + dt), and the grid
   resolves both factors. */
#include "internal.h"
#include "autodiff/sized.h"
#include "physics/linear/linear.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

static enum ad_status check_free(const struct qm_slice *slice, double *mass, struct ad_error *error)
{
    size_t n = slice->grid.n;
    double *V = malloc(n * sizeof *V);
    if (!V)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    if (qm_potential(slice->system, &slice->grid, V, mass, error) == AD_OK)
        for (size_t a = 1; a < n; a++)
            if (V[a] != V[0])
                ad_fail(
                    error, AD_E_ARGUMENT,
                    "%s: a slice shorter than its grid allows is defined for free particles only",
                    slice->system->scene->name);
    free(V);
    return error->status;
}

enum ad_status qm_kernel_short(const struct qm_slice *slice, qm_complex *K, struct ad_error *error)
{
    double mass;
    if (AD_LACKS(error, K) || qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    size_t n = slice->grid.n;
    struct qm_slice ring = *slice;
    if (check_free(slice, &mass, error) != AD_OK)
        return error->status;
    qm_complex *back =
        n < SIZE_MAX / n / 2 / sizeof *back ? malloc(2 * n * n * sizeof *back) : NULL;
    if (!back)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    qm_complex *forth = back + n * n;
    ring.walls = QM_RING;
    ring.absorb = 0;
    /* its ghosts stand two rings away: K(T) is unitary on the grid, to the last bit but rounding */
    ring.dt = mass * (double)n * pow(qm_dx(&slice->grid), 2) / (M_PI * slice->hbar);
    if (qm_kernel(&ring, back, error) == AD_OK) {
        ring.dt += slice->dt;
        qm_kernel(&ring, forth, error);
    }
    for (size_t k = 0; k < n * n; k++)
        back[k] = conj(back[k]); /* it is symmetric */
    if (error->status == AD_OK)
        phys_lapack_gemm_complex(false, n, n, n, (const double *)back, (const double *)forth,
                                 (double *)K);
    free(back);
    return error->status;
}
