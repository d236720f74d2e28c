/* Chaos measured: a small difference w follows the linearised field, w' = f_y(y) w, and its length
   is set back to one at equal intervals (Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15,
   1980). f_y w is a central difference of the field along w, which serves every field. */
#include "stability.h"
#include "physics/internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { INTERVALS = 400, MOST_STEPS = 10000 /* in each */ };

static const double regular = 4; /* megno: at most 2 on regular motions, and it fluctuates */

/* y and w, one after the other, as one motion. */
struct tangent {
    const struct phys_ode *ode;
    const double *scale; /* or NULL */
    double *near, *rate; /* [n] */
};

static double size_of(const struct tangent *c, const double *x)
{
    double sum = 0;
    for (size_t k = 0; k < c->ode->n; k++) {
        double r = x[k] / (c->scale ? c->scale[k] : 1);
        sum += r * r;
    }
    return sqrt(sum);
}

static enum ad_status at(struct tangent *c, double t, const double *y, double h, const double *w,
                         double *rate, struct ad_error *error)
{
    for (size_t k = 0; k < c->ode->n; k++)
        c->near[k] = y[k] + h * w[k];
    return c->ode->field(c->ode->context, t, c->near, rate, error);
}

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    struct tangent *c = context;
    size_t n = c->ode->n;
    const double *w = y + n;
    double length = size_of(c, w);
    double h = length > 0 ? cbrt(DBL_EPSILON) * fmax(size_of(c, y), 1) / length : 1;
    if (at(c, t, y, h, w, rate + n, error) != AD_OK || at(c, t, y, -h, w, c->rate, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < n; k++)
        rate[n + k] = (rate[n + k] - c->rate[k]) / (2 * h);
    return c->ode->field(c->ode->context, t, y, rate, error);
}

/* Both halves are judged in the sizes of the components. */
static void fill_scale(const struct tangent *c, double *scale)
{
    for (size_t k = 0; k < 2 * c->ode->n; k++)
        scale[k] = c->scale ? c->scale[k % c->ode->n] : 1;
}

static void begin_direction(const struct tangent *c, const double *direction, double *w)
{
    for (size_t k = 0; k < c->ode->n; k++)
        w[k] = direction ? direction[k] : (c->scale ? c->scale[k] : 1) * cos(1.3 * (double)k + 0.4);
}

/* Sets w back to length one; returns the log of its length. */
static double set_back(const struct tangent *c, double *w)
{
    double length = size_of(c, w);
    for (size_t k = 0; k < c->ode->n; k++)
        w[k] /= length;
    return log(length);
}

/* What is summed on the way. */
struct sums {
    double span; /* since t0 */
    double log_growth;
    double weighted; /* integral of time over d(log growth) */
    double of_megno; /* sum of its values */
};

static void add(struct sums *s, double span, double growth)
{
    s->weighted += 0.5 * (s->span + span) * growth;
    s->log_growth += growth;
    s->span = span;
    s->of_megno += 2 * s->weighted / span;
}

static enum ad_status march(struct tangent *c, const struct phys_lyapunov_settings *s, double *y,
                            const double *scale, struct phys_lyapunov *result,
                            struct ad_error *error)
{
    const struct phys_ode both = {
        .name = c->ode->name, .n = 2 * c->ode->n, .field = field, .context = c};
    struct phys_simulation step = {.integrator = phys_integrator_find("dop853", error)};
    struct phys_simulation_info info;
    struct sums sums = {0};
    double *w = y + c->ode->n, threshold = log(s->lost / s->known);
    step.rtol = step.atol = s->tolerance > 0 ? s->tolerance : 1e-9;
    step.scale = scale;
    step.max_steps = MOST_STEPS;
    set_back(c, w);
    for (size_t i = 1; i <= INTERVALS; i++) {
        step.t0 = s->t0 + sums.span;
        step.t1 = s->t0 + (s->t1 - s->t0) * (double)i / INTERVALS;
        if (phys_simulate(&step, &both, y, &info, error) != AD_OK)
            return error->status;
        double before = sums.log_growth, start = sums.span;
        add(&sums, step.t1 - s->t0, set_back(c, w));
        if (isinf(result->horizon) && sums.log_growth >= threshold) {
            double share = (threshold - before) / (sums.log_growth - before);
            result->horizon = s->t0 + start + share * (sums.span - start);
        }
    }
    result->exponent = sums.log_growth / sums.span;
    result->growth = exp(sums.log_growth);
    result->time = result->exponent > 0 ? 1 / result->exponent : INFINITY;
    result->megno = sums.of_megno / INTERVALS;
    result->chaotic = result->megno > regular;
    return AD_OK;
}

enum ad_status phys_lyapunov(const struct phys_ode *ode, const double *y,
                             const struct phys_lyapunov_settings *settings,
                             struct phys_lyapunov *result, struct ad_error *error)
{
    size_t n = ode->n;
    *result = (struct phys_lyapunov){.time = INFINITY, .horizon = INFINITY};
    if (phys_lacks((const void *)(uintptr_t)ode->field, "field of the ode", error))
        return error->status;
    if (!(settings->t1 > settings->t0))
        return ad_fail(error, AD_E_ARGUMENT, "growth from t = %g to %g: expected a later end",
                       settings->t0, settings->t1);
    if (!(settings->known > 0 && settings->lost > settings->known))
        return ad_fail(error, AD_E_ARGUMENT,
                       "differences of %g at the start and %g at the horizon, expected positive "
                       "numbers, the second larger",
                       settings->known, settings->lost);
    double *memory = calloc(6 * n, sizeof *memory);
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct tangent c = {ode, settings->scale, memory + 4 * n, memory + 5 * n};
    double *both = memory, *scale = memory + 2 * n;
    memcpy(both, y, n * sizeof *y);
    begin_direction(&c, settings->direction, both + n);
    fill_scale(&c, scale);
    march(&c, settings, both, scale, result, error);
    free(memory);
    return error->status;
}
