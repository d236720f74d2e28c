/* Crank-Nicolson: Schroedinger's equation by differences, (1 + i H dt / 2 hbar) psi' = (1 - i H dt
   / 2 hbar) psi (Crank, Nicolson, Proc. Camb. Phil. Soc. 43, 1947); unitary, of second order in dt
   and dx, and independent of sums over paths. H is tridiagonal: LAPACK's zgttrf once, zgttrs for
   every slice. */
#include "autodiff/free.h"
#include "internal.h"
#include "physics/linear/linear.h"

#include <complex.h>
#include <stdlib.h>

struct crank_nicolson {
    size_t n;
    qm_complex hop;                                /* i dt / 2 hbar times the off-diagonal of H */
    qm_complex *own;                               /* [n] i dt / 2 hbar times the diagonal */
    qm_complex *below, *diagonal, *above, *second; /* factors */
    int *pivots;
    double *mask;     /* NULL: no absorbing layers */
    qm_complex *line; /* [n] of one packet */
};

static void cost(const struct qm_slice *slice, struct qm_cost *cost)
{
    double n = (double)slice->grid.n;
    *cost = (struct qm_cost){.bytes = 108 * n, .setup = 100 * n, .step = 80 * n};
}

static bool aliases(const struct qm_slice *slice)
{
    (void)slice;
    return false;
}

static void close_cn(void *state)
{
    struct crank_nicolson *cn = state;
    if (!cn)
        return;
    AD_FREE(cn->own, cn->pivots, cn->mask, cn);
}

static enum ad_status reserve(const struct qm_slice *slice, struct crank_nicolson *cn,
                              struct ad_error *error)
{
    size_t n = cn->n = slice->grid.n;
    cn->own = calloc(6 * n, sizeof *cn->own);
    cn->pivots = calloc(n, sizeof *cn->pivots);
    cn->mask = malloc(n * sizeof *cn->mask);
    if (!cn->own || !cn->pivots || !cn->mask)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    cn->below = cn->own + n;
    cn->diagonal = cn->below + n;
    cn->above = cn->diagonal + n;
    cn->second = cn->above + n;
    cn->line = cn->second + n;
    qm_absorber(slice, cn->mask);
    return AD_OK;
}

static enum ad_status factor(const struct qm_slice *slice, struct crank_nicolson *cn,
                             struct ad_error *error)
{
    size_t n = cn->n;
    double mass, dx = qm_dx(&slice->grid), turn = slice->dt / (2 * slice->hbar);
    double *V = (double *)cn->line;
    if (qm_potential(slice->system, &slice->grid, V, &mass, error) != AD_OK)
        return error->status;
    double hop = slice->hbar * slice->hbar / (2 * mass * dx * dx);
    cn->hop = -I * turn * hop;
    for (size_t a = 0; a < n; a++) {
        /* beyond the wall psi has the other sign, half a cell away */
        cn->own[a] = I * turn * (V[a] + (a == 0 || a == n - 1 ? 3 : 2) * hop);
        cn->diagonal[a] = 1 + cn->own[a];
        cn->below[a] = cn->above[a] = cn->hop;
    }
    if (phys_lapack_tridiagonal_factor_complex(n, (double *)cn->below, (double *)cn->diagonal,
                                               (double *)cn->above, (double *)cn->second,
                                               cn->pivots) != 0)
        return ad_fail(error, AD_E_NONFINITE, "Crank-Nicolson: the potential is not finite");
    return AD_OK;
}

static enum ad_status open_cn(const struct qm_slice *slice, void **state, struct ad_error *error)
{
    struct crank_nicolson *cn = *state = calloc(1, sizeof *cn);
    if (!cn)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (slice->walls == QM_RING)
        return ad_fail(error, AD_E_ARGUMENT,
                       "crank-nicolson has no rings; expected method kernel or other walls");
    return reserve(slice, cn, error) == AD_OK ? factor(slice, cn, error) : error->status;
}

/* line = (1 - i H dt / 2 hbar) column */
static void explicit_half(const struct crank_nicolson *cn, size_t stride, const qm_complex *psi)
{
    for (size_t a = 0; a < cn->n; a++) {
        qm_complex sum = a > 0 ? psi[(a - 1) * stride] : 0;
        if (a + 1 < cn->n)
            sum += psi[(a + 1) * stride];
        cn->line[a] = (1 - cn->own[a]) * psi[a * stride] - cn->hop * sum;
    }
}

static enum ad_status step_cn(void *state, size_t packets, qm_complex *psi, struct ad_error *error)
{
    struct crank_nicolson *cn = state;
    (void)error;
    for (size_t k = 0; k < packets; k++) {
        explicit_half(cn, packets, psi + k);
        phys_lapack_tridiagonal_solve_complex(cn->n, (double *)cn->below, (double *)cn->diagonal,
                                              (double *)cn->above, (double *)cn->second, cn->pivots,
                                              1, (double *)cn->line);
        for (size_t a = 0; a < cn->n; a++)
            psi[a * packets + k] = cn->mask[a] * cn->line[a];
    }
    return AD_OK;
}

const struct qm_method qm_method_crank_nicolson = {
    "crank-nicolson", "Schroedinger's equation by differences, tridiagonal",
    aliases,          cost,
    open_cn,          step_cn,
    close_cn};
