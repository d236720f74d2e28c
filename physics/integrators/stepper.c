/* The state of a method on one problem: memory, rates, and the interpolating polynomial of a step.
 */
#include "stepper.h"
#include "physics/ode/internal.h"

#include <stdlib.h>
#include <string.h>

enum { HERMITE = 3 }; /* rows of the polynomial that every method has */

static enum ad_status check(const struct phys_integrator *integrator, const struct phys_ode *ode,
                            struct ad_error *error)
{
    const char *name = ode->name ? ode->name : "the motion";
    phys_motion *constrained = phys_ode_constrained_motion(ode);
    const bool keeps = constrained && integrator->scheme->constrains;
    if (integrator->separable &&
        !(keeps ? phys_motion_separates(constrained, error) : ode->kick != NULL))
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s needs accelerations that depend on positions and time only; those of %s "
                       "%s; try %s",
                       integrator->name, name,
                       constrained && !keeps ? "have constraint forces" : "do not",
                       constrained ? keeps ? "dop853" : "rattle or dop853"
                                   : "gauss2, implicit-midpoint or dop853");
    if (integrator->scheme == &phys_splitting && !ode->kick && !ode->canonical && !ode->system)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s moves positions and velocities in turn; %s has no such halves: take "
                       "gauss2, implicit-midpoint or dop853",
                       integrator->name, name);
    if (integrator->lagrangian && !ode->system)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s needs a Lagrangian; %s has none: take gauss2, implicit-midpoint or "
                       "dop853",
                       integrator->name, name);
    if (integrator->scheme == &phys_power_series && !ode->series)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s needs the power series of a Lagrangian; %s has none: take dop853",
                       integrator->name, name);
    return AD_OK;
}

enum ad_status phys_stepper_begin(struct phys_stepper *s, const struct phys_integrator *integrator,
                                  const struct phys_ode *ode, const double *y,
                                  struct ad_error *error)
{
    const struct phys_scheme *scheme = integrator->scheme;
    size_t n = ode->n, n_dense = HERMITE + (scheme->extra ? scheme->extra(integrator) : 0);
    *s = (struct phys_stepper){.integrator = integrator, .ode = ode, .n = n};
    if (check(integrator, ode, error) != AD_OK)
        return error->status;
    s->n_dense = n_dense;
    s->memory = calloc((6 + n_dense) * n + scheme->work(integrator, n), sizeof *s->memory);
    if (!s->memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->y = s->memory;
    s->next = s->y + n;
    s->rate = s->next + n;
    s->next_rate = s->rate + n;
    s->cut = s->next_rate + n;
    s->next_cut = s->cut + n;
    s->dense = s->next_cut + n;
    s->work = s->dense + s->n_dense * n;
    memcpy(s->y, y, n * sizeof *y);
    return scheme->begin ? scheme->begin(s, error) : AD_OK;
}

void phys_stepper_end(struct phys_stepper *s)
{
    if (s->memory && s->integrator->scheme->end)
        s->integrator->scheme->end(s);
    free(s->memory);
    *s = (struct phys_stepper){0};
}

enum ad_status phys_stepper_rate(struct phys_stepper *s, double t, const double *y, double *rate,
                                 struct ad_error *error)
{
    s->evaluations++;
    return s->ode->field(s->ode->context, t, y, rate, error);
}

enum ad_status phys_stepper_need_rate(struct phys_stepper *s, struct ad_error *error)
{
    if (s->has_rate)
        return AD_OK;
    s->has_rate = true;
    return phys_stepper_rate(s, s->t, s->y, s->rate, error);
}

enum ad_status phys_stepper_need_next_rate(struct phys_stepper *s, struct ad_error *error)
{
    if (s->has_next_rate)
        return AD_OK;
    s->has_next_rate = true;
    return phys_stepper_rate(s, s->t + s->h, s->next, s->next_rate, error);
}

static void swap(double **a, double **b)
{
    double *c = *a;
    *a = *b;
    *b = c;
}

void phys_stepper_accept(struct phys_stepper *s, double t)
{
    swap(&s->y, &s->next);
    swap(&s->cut, &s->next_cut);
    swap(&s->rate, &s->next_rate);
    s->has_rate = s->has_next_rate;
    s->has_next_rate = false;
    s->t = t;
}

/* Rows of the polynomial: with D = next - y and rates f0, f1,
       y + theta (D + (1-theta) (h f0 - D + theta (2 D - h (f0 + f1) + (1-theta) (...)))),
   the cubic of Hermite, to which methods add rows that vanish with their slopes at both ends
   (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.6). */
static enum ad_status prepare(struct phys_stepper *s, size_t *wanted, struct ad_error *error)
{
    const struct phys_scheme *scheme = s->integrator->scheme;
    if (scheme->at)
        return AD_OK;
    if (phys_stepper_need_rate(s, error) != AD_OK || phys_stepper_need_next_rate(s, error) != AD_OK)
        return error->status;
    if (scheme->uses_rate)
        *wanted = s->evaluations;
    for (size_t k = 0; k < s->n; k++) {
        double D = s->next[k] - s->y[k], f0 = s->h * s->rate[k], f1 = s->h * s->next_rate[k];
        s->dense[k] = D;
        s->dense[s->n + k] = f0 - D;
        s->dense[2 * s->n + k] = 2 * D - (f0 + f1);
    }
    return scheme->dense ? scheme->dense(s, s->dense + HERMITE * s->n, error) : AD_OK;
}

enum ad_status phys_stepper_dense(struct phys_stepper *s, struct ad_error *error)
{
    size_t wanted = s->evaluations;
    enum ad_status status = prepare(s, &wanted, error);
    s->interpolations += s->evaluations - wanted;
    s->evaluations = wanted;
    return status;
}

void phys_stepper_at(const struct phys_stepper *s, double theta, double *y)
{
    if (s->integrator->scheme->at) {
        s->integrator->scheme->at(s, theta, y);
        return;
    }
    memset(y, 0, s->n * sizeof *y);
    for (size_t row = s->n_dense; row-- > 0;) {
        const double *dense = s->dense + row * s->n;
        double factor = row % 2 == 0 ? theta : 1 - theta;
        for (size_t k = 0; k < s->n; k++)
            y[k] = (y[k] + dense[k]) * factor;
    }
    for (size_t k = 0; k < s->n; k++)
        y[k] += s->y[k];
}

double phys_stepper_mean_square(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                const double *e)
{
    double sum = 0, worst = -1;
    for (size_t k = 0; k < s->n; k++) {
        double x = e[k] == 0
                       ? 0
                       : e[k] / phys_allowed(tolerance, k, fmax(fabs(s->y[k]), fabs(s->next[k])));
        sum += x * x;
        if (!(fabs(x) <= worst)) {
            worst = fabs(x);
            s->worst = k;
        }
    }
    return sum / (double)s->n;
}
