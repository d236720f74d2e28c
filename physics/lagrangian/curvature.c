/* All second derivatives of a Lagrangian at one point, in one run over dof lanes with the same
   state: the gradient of sum_j L_vj(lane j) with respect to the lanes' v has column j of L_vv in
   column j, that with respect to their q column j of L_qv, and that with respect to their t L_vt.
 */
#include "curvature.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status record(struct phys_curvature *c, struct ad_error *error)
{
    size_t n = c->system->dof;
    c->at_q = ad_input(c->tape, n, 1, "q");
    c->at_v = ad_input(c->tape, n, 1, "v");
    c->at_t = ad_input(c->tape, 1, 1, "t");
    ad_var lanes[3] = {ad_broadcast(c->at_q, n, n), ad_broadcast(c->at_v, n, n),
                       ad_broadcast(c->at_t, 1, n)};
    ad_var unit = phys_unit_matrix(c->tape, n), first[2], by[3], qq;
    ad_var L = phys_system_lagrangian(c->system, lanes[0], lanes[1], lanes[2]);
    if (ad_grad(L, 2, lanes, first) != AD_OK ||
        ad_grad(ad_dot(first[1], unit), 3, lanes, by) != AD_OK ||
        ad_grad(ad_dot(first[0], unit), 1, lanes, &qq) != AD_OK)
        return phys_tape_status(c->tape, error);
    c->by_q = ad_slice_cols(first[0], 0, 1);
    c->by_v = ad_slice_cols(first[1], 0, 1);
    c->by_qv = by[0];
    c->by_vv = by[1];
    c->by_vt = by[2];
    c->by_qq = qq;
    ad_compile(c->tape, 6, (ad_var[]){c->by_q, c->by_v, c->by_vt, c->by_qq, c->by_qv, c->by_vv},
               &c->program);
    return phys_tape_status(c->tape, error);
}

enum ad_status phys_curvature_new(struct phys_curvature *c, const struct phys_system *system,
                                  struct ad_error *error)
{
    size_t n = system->dof;
    *c = (struct phys_curvature){.system = system, .tape = ad_tape_new(AD_F64)};
    if (n <= SIZE_MAX / sizeof(double) / (4 * n + 4))
        c->q = malloc((4 * n * n + 4 * n) * sizeof *c->q);
    c->pivots = malloc(n * sizeof *c->pivots);
    c->span = malloc(2 * n * sizeof *c->span);
    if (!c->tape || !c->q || !c->pivots || !c->span)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    c->v = c->q + n;
    c->vt = c->v + n;
    c->qq = c->vt + n;
    c->qv = c->qq + n * n;
    c->vv = c->qv + n * n;
    c->factor = c->vv + n * n;
    if (record(c, error) == AD_OK)
        ad_native_lazy(c->program);
    return error->status;
}

void phys_curvature_free(struct phys_curvature *c)
{
    ad_program_free(c->program);
    ad_tape_free(c->tape);
    AD_FREE(c->q, c->pivots, c->span);
}

/* What is 0, which lattices and most sets of bodies have much of. */
static void find_zeros(struct phys_curvature *c)
{
    const size_t n = c->system->dof;
    c->mixed = false;
    c->diagonal = true;
    for (size_t k = 0; k < n * n; k++) {
        const size_t i = k / n, j = k % n;
        size_t *span = c->span + 2 * i;
        c->mixed |= c->qv[k] != 0;
        c->diagonal &= i == j || c->vv[k] == 0;
        if (j == 0)
            span[0] = span[1] = 0;
        if (c->qq[k] != 0) {
            span[0] = span[1] ? span[0] : j;
            span[1] = j + 1;
        }
    }
}

bool phys_curvature_at(struct phys_curvature *c, const double *q, const double *v, double t)
{
    size_t n = c->system->dof;
    ad_set(c->program, c->at_q, q);
    ad_set(c->program, c->at_v, v);
    ad_set(c->program, c->at_t, &t);
    ad_run(c->program);
    const ad_var found[] = {c->by_q, c->by_v, c->by_vt, c->by_qq, c->by_qv, c->by_vv};
    double *const into[] = {c->q, c->v, c->vt, c->qq, c->qv, c->vv};
    for (size_t k = 0; k < LENGTH(found); k++)
        ad_get(c->program, found[k], into[k]);
    for (size_t k = 0; k < 3 * n * n + 3 * n; k++)
        if (!isfinite(c->q[k]))
            return false;
    find_zeros(c);
    memcpy(c->factor, c->vv, n * n * sizeof *c->factor);
    return phys_lapack_lu_factor(n, c->factor, c->pivots) == 0;
}

void phys_curvature_acceleration(struct phys_curvature *c, const double *v, double *a)
{
    size_t n = c->system->dof;
    for (size_t i = 0; i < n; i++) {
        a[i] = c->q[i] - c->vt[i];
        for (size_t j = 0; j < n; j++)
            a[i] -= c->qv[j * n + i] * v[j];
    }
    phys_lapack_lu_solve(n, c->factor, c->pivots, a);
}

void phys_curvature_vary(struct phys_curvature *c, const double *dq, const double *dp, double *dv,
                         double *force)
{
    size_t n = c->system->dof;
    memmove(dv, dp, n * sizeof *dv);
    for (size_t j = 0; c->mixed && j < n; j++)
        for (size_t i = 0; i < n; i++)
            dv[i] -= c->qv[j * n + i] * dq[j];
    for (size_t i = 0; c->diagonal && i < n; i++)
        dv[i] /= c->vv[i * n + i];
    if (!c->diagonal)
        phys_lapack_lu_solve(n, c->factor, c->pivots, dv);
    for (size_t i = 0; force && i < n; i++) {
        force[i] = 0;
        for (size_t j = c->mixed ? 0 : c->span[2 * i]; j < (c->mixed ? n : c->span[2 * i + 1]); j++)
            force[i] += c->qq[i * n + j] * dq[j] + (c->mixed ? c->qv[i * n + j] * dv[j] : 0);
    }
}
