/* Collocation at the Gauss points: s implicit stages, order 2 s, symplectic and symmetric (Hairer,
   Lubich, Wanner, Geometric Numerical Integration, section II.1.3).

   The stage slopes solve F_i = f(t + c_i h, y + h sum_j a_ij F_j). They are iterated as they stand,
   from the last step's polynomial carried on; where that contracts slowly or not at all, by
   Newton's method with one Jacobian a step. Both go on until rounding stops them, because what is
   left over would be the drift of the energy. */
#include "stepper.h"
#include "../internal.h"
#include "../../autodiff/blas.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STAGES = 5, MOST_ITERATIONS = 60 };

static const double slow = 0.3; /* contraction per iteration at which Newton's method takes over */
static const double settled = 1e-10; /* a change that no longer shrinks below this is rounding */

struct stages {
    size_t s;
    double c[MOST_STAGES], b[MOST_STAGES], a[MOST_STAGES][MOST_STAGES];
    double carry[MOST_STAGES][MOST_STAGES]; /* slopes of the last step, carried on */
    double last_h;                          /* 0: no last step */
    double *F, *G, *point, *size; /* slopes [s][n] and the next ones; a point [n]; sizes [n] */
    double *J, *matrix;           /* of Newton's method: [n x n], [s n x s n]; NULL until needed */
};

static size_t stages_of(const struct phys_integrator *integrator)
{
    return *(const size_t *)integrator->coefficients;
}

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    return (2 * stages_of(integrator) + 2) * n;
}

/* Values at x of the polynomials that are 1 at one of the points c and 0 at the others. */
static void lagrange(size_t s, const double *c, double x, double *value)
{
    for (size_t i = 0; i < s; i++) {
        value[i] = 1;
        for (size_t j = 0; j < s; j++)
            if (j != i)
                value[i] *= (x - c[j]) / (c[i] - c[j]);
    }
}

/* Gauss's points are those of the action rules. a_ij is the integral of polynomial j from 0 to c_i,
   for which s Gauss points are exact. */
static void coefficients(struct stages *g)
{
    size_t s = g->s;
    const struct phys_rule *rule = s == 1 ? &phys_rule_midpoint : &phys_rules_gauss[s - 2];
    struct phys_rule_table table;
    double l[MOST_STAGES];
    rule->fill(rule, &table);
    memcpy(g->c, table.time, s * sizeof *g->c);
    memcpy(g->b, table.weight, s * sizeof *g->b);
    for (size_t i = 0; i < s; i++) {
        lagrange(s, g->c, 1 + g->c[i], g->carry[i]);
        for (size_t m = 0; m < s; m++) {
            lagrange(s, g->c, g->c[i] * g->c[m], l);
            for (size_t j = 0; j < s; j++)
                g->a[i][j] += g->c[i] * g->b[m] * l[j];
        }
    }
}

static enum ad_status begin(struct phys_stepper *s, struct ad_error *error)
{
    struct stages *g = s->state = calloc(1, sizeof *g);
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
    struct stages *g = s->state;
    if (g)
        free(g->J);
    free(g);
}

/* to [n] = base + h sum_j w_j F_j. */
static void combine(size_t n, size_t stages, const double *base, double h, const double *w,
                    const double *F, double *to)
{
    for (size_t k = 0; k < n; k++) {
        double sum = 0;
        for (size_t j = 0; j < stages; j++)
            sum += w[j] * F[j * n + k];
        to[k] = base[k] + h * sum;
    }
}

/* Slopes to begin with: the polynomial of the last step, or the rate at the start. */
static enum ad_status guess(struct phys_stepper *s, struct stages *g, double h,
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
        combine(n, g->s, g->point, 1, g->carry[i], g->F, g->G + i * n);
    memcpy(g->F, g->G, g->s * n * sizeof *g->F);
    return AD_OK;
}

/* G_i = f at the stages that F gives. */
static enum ad_status evaluate(struct phys_stepper *s, struct stages *g, double h,
                               struct ad_error *error)
{
    for (size_t i = 0; i < g->s; i++) {
        combine(s->n, g->s, s->y, h, g->a[i], g->F, g->point);
        if (phys_stepper_rate(s, s->t + g->c[i] * h, g->point, g->G + i * s->n, error) != AD_OK)
            return error->status;
    }
    return AD_OK;
}

/* The components' sizes so far, from where the motion was and how far it went in a step. */
static void note_sizes(const struct phys_stepper *s, struct stages *g, double h)
{
    for (size_t k = 0; k < s->n; k++) {
        g->size[k] = fmax(g->size[k], fabs(s->y[k]));
        for (size_t i = 0; i < g->s; i++)
            g->size[k] = fmax(g->size[k], fabs(h * g->F[i * s->n + k]));
    }
}

/* Largest change h |D| of the slopes in units of the components' sizes. */
static double change(struct phys_stepper *s, const struct stages *g, double h, const double *D)
{
    double most = 0;
    for (size_t k = 0; k < s->n; k++)
        for (size_t i = 0; i < g->s; i++) {
            size_t at = i * s->n + k;
            double x = D[at] == 0 ? 0 : fabs(h * D[at]) / g->size[k];
            if (!(x <= most)) {
                most = x;
                s->worst = k;
            }
        }
    return most;
}

/* J [n x n] by columns: df/dy in the middle of the step, by differences; its error costs Newton's
   method digits per iteration, not the result. */
static enum ad_status jacobian(struct phys_stepper *s, struct stages *g, double h,
                               struct ad_error *error)
{
    size_t n = s->n;
    double *at = g->point, *base = g->matrix, t = s->t + 0.5 * h;
    for (size_t k = 0; k < n; k++)
        at[k] = s->y[k];
    if (phys_stepper_rate(s, t, at, base, error) != AD_OK)
        return error->status;
    for (size_t j = 0; j < n; j++) {
        double step = sqrt(DBL_EPSILON) * fmax(g->size[j], DBL_MIN);
        at[j] = s->y[j] + step;
        if (phys_stepper_rate(s, t, at, g->J + j * n, error) != AD_OK)
            return error->status;
        for (size_t k = 0; k < n; k++)
            g->J[j * n + k] = (g->J[j * n + k] - base[k]) / (at[j] - s->y[j]);
        at[j] = s->y[j];
    }
    return AD_OK;
}

/* D = (1 - h a x J)^-1 (G - F), in place of G. */
static enum ad_status newton_correction(struct phys_stepper *s, struct stages *g, double h,
                                        struct ad_error *error)
{
    size_t n = s->n, N = g->s * n;
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++)
            g->matrix[i * N + j] = (i == j) - h * g->a[i / n][j / n] * g->J[(j % n) * n + i % n];
    for (size_t i = 0; i < N; i++)
        g->G[i] -= g->F[i];
    if (ad_blas_solve(N, g->matrix, g->G) != 0)
        return ad_fail(error, AD_E_NONFINITE, "the stage equations are singular");
    return AD_OK;
}

static enum ad_status begin_newton(struct phys_stepper *s, struct stages *g, double h,
                                   struct ad_error *error)
{
    size_t n = s->n, N = g->s * n;
    if (!g->J) {
        g->J = malloc((n * n + N * N) * sizeof *g->J);
        if (!g->J)
            return ad_fail(error, AD_E_MEMORY, "out of memory for Newton's method");
        g->matrix = g->J + n * n;
    }
    for (size_t i = 0; i < g->s; i++) /* where iterating went astray is no place to begin */
        memcpy(g->F + i * n, s->rate, n * sizeof *g->F);
    return jacobian(s, g, h, error);
}

/* Iterates until the changes are rounding; false in *converged if they do not get there. */
static enum ad_status iterate(struct phys_stepper *s, struct stages *g, double h, bool newton,
                              bool *converged, struct ad_error *error)
{
    size_t N = g->s * s->n;
    double last = INFINITY;
    *converged = false;
    for (int k = 0; k < MOST_ITERATIONS; k++) {
        if (evaluate(s, g, h, error) != AD_OK ||
            (newton && newton_correction(s, g, h, error) != AD_OK))
            return error->status;
        for (size_t i = 0; i < N && !newton; i++)
            g->G[i] -= g->F[i];
        double now = change(s, g, h, g->G);
        for (size_t i = 0; i < N; i++)
            g->F[i] += g->G[i];
        if (now <= DBL_EPSILON / 8 || (now >= 0.5 * last && now < settled)) {
            *converged = true;
            return AD_OK;
        }
        if (!isfinite(now) || (!newton && k > 1 && now > slow * last && now > settled))
            return AD_OK;
        last = now;
    }
    return AD_OK;
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct stages *g = s->state;
    bool converged;
    struct ad_error astray = {0}; /* iterating may leave where the field is defined */
    if (guess(s, g, h, error) != AD_OK)
        return error->status;
    if (g->last_h == 0)
        note_sizes(s, g, h);
    if (iterate(s, g, h, false, &converged, &astray) != AD_OK || !converged) {
        if (phys_stepper_need_rate(s, error) != AD_OK || begin_newton(s, g, h, error) != AD_OK ||
            iterate(s, g, h, true, &converged, error) != AD_OK)
            return error->status;
    }
    if (!converged) {
        char name[64];
        phys_stepper_name(s, s->worst, name, sizeof name);
        return ad_fail(error, AD_E_ACCURACY,
                       "the implicit stages do not converge at t = %.9g, worst in %s: take a "
                       "smaller step than %.3g",
                       s->t, name, fabs(h));
    }
    combine(s->n, g->s, s->y, h, g->b, g->F, s->next);
    g->last_h = h;
    note_sizes(s, g, h);
    return AD_OK;
}

const struct phys_scheme phys_collocation = {
    .work = work, .begin = begin, .end = end, .step = step};
