/* Collocation at the Gauss points: s implicit stages, order 2 s, symplectic and symmetric (Hairer,
   Lubich, Wanner, Geometric Numerical Integration, section II.1.3).

   The stage slopes F_i = f(t + c_i h, y + h sum_j a_ij F_j) are solved by fixed-point iteration
   from the extrapolated polynomial of the last step; where that converges slowly or not at all, by
   Newton's method (stages.c). Both iterate down to rounding, because the remaining error would make
   the energy drift. */
#include "stages.h"
#include "physics/action/internal.h"

#include <stdlib.h>
#include <string.h>

static const double slow = 0.3; /* contraction per iteration at which Newton's method takes over */

static size_t stages_of(const struct phys_integrator *integrator)
{
    return *(const size_t *)integrator->coefficients;
}

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    return (2 * stages_of(integrator) + 2) * n;
}

/* Gauss's points are those of the action rules. a_ij is the integral of polynomial j from 0 to c_i,
   for which s Gauss points are exact. */
static void coefficients(struct phys_stages *g)
{
    size_t s = g->s;
    const struct phys_rule *rule = s == 1 ? &phys_rule_midpoint : &phys_rules_gauss[s - 2];
    struct phys_rule_table table;
    double l[PHYS_STAGES_MOST];
    rule->fill(rule, &table);
    memcpy(g->c, table.time, s * sizeof *g->c);
    memcpy(g->b, table.weight, s * sizeof *g->b);
    for (size_t i = 0; i < s; i++) {
        phys_stages_lagrange(s, g->c, 1 + g->c[i], g->carry[i]);
        for (size_t m = 0; m < s; m++) {
            phys_stages_lagrange(s, g->c, g->c[i] * g->c[m], l);
            for (size_t j = 0; j < s; j++)
                g->a[i][j] += g->c[i] * g->b[m] * l[j];
        }
    }
}

static enum ad_status begin(struct phys_stepper *s, struct ad_error *error)
{
    struct phys_stages *g = s->state = calloc(1, sizeof *g);
    if (!g)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    g->s = stages_of(s->integrator);
    coefficients(g);
    g->F = s->work;
    g->G = g->F + g->s * s->n;
    g->point = g->G + g->s * s->n;
    g->size = g->point + s->n;
    return AD_OK;
}

static void end(struct phys_stepper *s)
{
    struct phys_stages *g = s->state;
    if (g)
        phys_stages_matrix_free(g);
    free(g);
}

/* Slopes to begin with: the polynomial of the last step, or the rate at the start. */
static enum ad_status guess(struct phys_stepper *s, struct phys_stages *g, double h,
                            struct ad_error *error)
{
    size_t n = s->n;
    if (g->last_h != h) {
        if (phys_stepper_need_rate(s, error) != AD_OK)
            return error->status;
        for (size_t i = 0; i < g->s; i++)
            memcpy(g->F + i * n, s->rate, n * sizeof *g->F);
        return AD_OK;
    }
    memset(g->point, 0, n * sizeof *g->point);
    for (size_t i = 0; i < g->s; i++)
        phys_stages_combine(n, g->s, g->point, 1, g->carry[i], g->F, g->G + i * n);
    memcpy(g->F, g->G, g->s * n * sizeof *g->F);
    return AD_OK;
}

/* The components' sizes so far, from where the motion was and how far it went in a step. */
static void note_sizes(const struct phys_stepper *s, struct phys_stages *g, double h)
{
    for (size_t k = 0; k < s->n; k++) {
        g->size[k] = fmax(g->size[k], fabs(s->y[k]));
        for (size_t i = 0; i < g->s; i++)
            g->size[k] = fmax(g->size[k], fabs(h * g->F[i * s->n + k]));
        g->least = fmax(g->least, 1e-100 * g->size[k]);
    }
}

/* Fixed-point iteration; false in *converged if it is slow or diverges. */
static enum ad_status iterate(struct phys_stepper *s, struct phys_stages *g, double h,
                              bool *converged, struct ad_error *error)
{
    double last = INFINITY;
    *converged = false;
    for (int k = 0; k < PHYS_STAGES_ITERATIONS; k++) {
        if (phys_stages_residual(s, g, h, error) != AD_OK)
            return error->status;
        double now = phys_stages_add(s, g, h);
        if ((*converged = phys_stages_settled(now, last)))
            return AD_OK;
        if (!isfinite(now) || (k > 1 && now > slow * last && now > phys_stages_rounding))
            return AD_OK;
        last = now;
    }
    return AD_OK;
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct phys_stages *g = s->state;
    bool converged;
    struct ad_error astray = {0}; /* iterating may leave where the field is defined */
    if (guess(s, g, h, error) != AD_OK)
        return error->status;
    if (g->last_h == 0)
        note_sizes(s, g, h);
    if ((iterate(s, g, h, &converged, &astray) != AD_OK || !converged) &&
        phys_stages_newton(s, g, h, error) != AD_OK)
        return error->status;
    memset(g->point, 0, s->n * sizeof *g->point);
    phys_stages_combine(s->n, g->s, g->point, h, g->b, g->F, s->next);
    for (size_t k = 0; k < s->n; k++)
        phys_stepper_sum(s, k, s->next[k]);
    g->last_h = h;
    note_sizes(s, g, h);
    return AD_OK;
}

const struct phys_scheme phys_collocation = {
    .work = work, .begin = begin, .end = end, .step = step};
