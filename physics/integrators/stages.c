/* Solves the stage equations (stages.h) by Newton's method. Its Jacobians, one per stage, are
   computed again where it converges slowly. Where it diverges, the step is reached by continuation
   in h (E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods, 1990): from h
   = 0, where the slopes equal the rate, the solution follows one branch, the one that approximates
   the motion. Where that branch turns back, the step has no stages. */
#include "stages.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

static const double slow = 0.1;            /* contraction that asks for new Jacobians */
static const double least_share = 1 / 1e6; /* of the step: the branch has turned back */

/* Values at x of the polynomials that are 1 at one of the points c and 0 at the others. */
void phys_stages_lagrange(size_t s, const double *c, double x, double *value)
{
    for (size_t i = 0; i < s; i++) {
        value[i] = 1;
        for (size_t j = 0; j < s; j++)
            if (j != i)
                value[i] *= (x - c[j]) / (c[i] - c[j]);
    }
}

/* to [n] = base + h sum_j w_j F_j. */
void phys_stages_combine(size_t n, size_t stages, const double *base, double h, const double *w,
                         const double *F, double *to)
{
    for (size_t k = 0; k < n; k++) {
        double sum = 0;
        for (size_t j = 0; j < stages; j++)
            sum += w[j] * F[j * n + k];
        to[k] = base[k] + h * sum;
    }
}

enum ad_status phys_stages_residual(struct phys_stepper *s, struct phys_stages *g, double h,
                                    struct ad_error *error)
{
    for (size_t i = 0; i < g->s; i++) {
        phys_stages_combine(s->n, g->s, s->y, h, g->a[i], g->F, g->point);
        if (phys_stepper_rate(s, s->t + g->c[i] * h, g->point, g->G + i * s->n, error) != AD_OK)
            return error->status;
    }
    for (size_t i = 0; i < g->s * s->n; i++)
        g->G[i] -= g->F[i];
    return AD_OK;
}

double phys_stages_size(const struct phys_stepper *s, const struct phys_stages *g, double h,
                        size_t k)
{
    double size = fmax(g->size[k], g->least);
    for (size_t i = 0; i < g->s; i++)
        size = fmax(size, fabs(h * g->F[i * s->n + k]));
    return size;
}

double phys_stages_add(struct phys_stepper *s, struct phys_stages *g, double h)
{
    double most = 0;
    for (size_t k = 0; k < s->n; k++) {
        double size = phys_stages_size(s, g, h, k), change = 0;
        for (size_t i = k; i < g->s * s->n; i += s->n) {
            change = fmax(change, fabs(h * g->G[i]));
            change = isnan(g->G[i]) ? (double)INFINITY : change;
            g->F[i] += g->G[i];
        }
        change = change == 0 ? 0 : change / fmax(size, phys_stages_size(s, g, h, k));
        if (!(change <= most)) {
            most = change;
            s->worst = k;
        }
    }
    return most;
}

bool phys_stages_settled(double now, double last)
{
    return now <= DBL_EPSILON / 8 || (now >= 0.5 * last && now < phys_stages_rounding);
}

/* From F on; false in *converged where it diverges. */
static enum ad_status newton(struct phys_stepper *s, struct phys_stages *g, double h,
                             bool *converged, struct ad_error *error)
{
    double last = INFINITY;
    bool take = true;
    *converged = false;
    for (int k = 0; k < PHYS_STAGES_ITERATIONS; k++) {
        if ((take && phys_stages_linearise(s, g, h, error) != AD_OK) ||
            phys_stages_residual(s, g, h, error) != AD_OK)
            return error->status;
        phys_stages_correct(s, g);
        double now = phys_stages_add(s, g, h);
        if ((*converged = phys_stages_settled(now, last)) || !isfinite(now) ||
            (take && now > 0.5 * last))
            return AD_OK;
        take = now > slow * last;
        last = now;
    }
    return AD_OK;
}

/* Slopes for a step `ratio` times as long as the one that was solved: its polynomial carried on;
   or, 0, the rate. */
static void predict(const struct phys_stepper *s, struct phys_stages *g, double ratio)
{
    size_t n = s->n;
    double l[PHYS_STAGES_MOST];
    memset(g->point, 0, n * sizeof *g->point);
    for (size_t i = 0; i < g->s; i++) {
        phys_stages_lagrange(g->s, g->c, ratio * g->c[i], l);
        if (ratio > 0)
            phys_stages_combine(n, g->s, g->point, 1, l, g->shorter, g->F + i * n);
        else
            memcpy(g->F + i * n, s->rate, n * sizeof *g->F);
    }
}

static enum ad_status refuse(struct phys_stepper *s, double h, const struct ad_error *astray,
                             struct ad_error *error)
{
    char name[64];
    if (astray->status != AD_OK)
        return ad_fail(error, astray->status, "%s", astray->message);
    phys_ode_component(s->ode, s->worst, name, sizeof name);
    return ad_fail(error, AD_E_ACCURACY,
                   "the implicit stages find no solution at t = %.9g, worst in %s: take a smaller "
                   "step than %.3g",
                   s->t, name, fabs(h));
}

enum ad_status phys_stages_newton(struct phys_stepper *s, struct phys_stages *g, double h,
                                  struct ad_error *error)
{
    double solved = 0, piece = 1; /* shares of h */
    if (phys_stages_matrix_new(s, g, error) != AD_OK || phys_stepper_need_rate(s, error) != AD_OK)
        return error->status;
    while (solved < 1) {
        struct ad_error astray = {0}; /* trials may leave where the field is defined */
        bool converged;
        double share = fmin(1, solved + piece);
        predict(s, g, solved > 0 ? share / solved : 0);
        if (newton(s, g, share * h, &converged, &astray) == AD_OK && converged) {
            memcpy(g->shorter, g->F, g->s * s->n * sizeof *g->F);
            piece = fmin(2 * piece, share);
            solved = share;
            continue;
        }
        piece *= 0.5;
        bool hopeless = astray.status != AD_OK && astray.status != AD_E_NONFINITE;
        if (hopeless || piece < least_share)
            return refuse(s, h, &astray, error);
    }
    return AD_OK;
}
