/* Lyapunov exponents: a small difference w follows the linearised field, w' = f_y(y) w, and is
   renormalised at equal intervals (Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15, 1980). f_y
   w is a central difference of the field along w, which works for every field. The growth depends
   on the initial direction for a while, and a chaotic motion soon loses its digits: several
   directions are followed, each at its own tolerance, and where they disagree the digits end.

   Growth alone is not chaos: on a hillside, q'' = q, differences grow as fast as the motion. The
   growth of the motion itself is that of its rate f(y), which in an autonomous system obeys the
   same linearised field. Chaos is growth beyond that of f. */
#include "stability.h"
#include "autodiff/sized.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { INTERVALS = 400, MOST_STEPS = 10000 /* in each */, RUNS = 3 };

static const double usual = 1e-13; /* tolerance of y; that of w is at least: */
static const double rough = 1e-8;  /* central differences are not better */
static const double coarser = 3;   /* from run to run */
static const double regular = 4;   /* megno: at most 2 on regular motions, and it fluctuates */

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
static void fill_scale(const struct tangent *c, double tolerance, double *scale)
{
    double looser = fmax(rough / tolerance, 1);
    for (size_t k = 0; k < c->ode->n; k++) {
        scale[k] = c->scale ? c->scale[k] : 1;
        scale[c->ode->n + k] = looser * scale[k];
    }
}

static void begin_direction(const struct tangent *c, const double *direction, int run, double *w)
{
    for (size_t k = 0; k < c->ode->n; k++)
        w[k] = direction
                   ? direction[k]
                   : (c->scale ? c->scale[k] : 1) * cos(1.3 * (double)k + 0.4 + 2.1 * (double)run);
}

/* Sets w back to length one; returns the log of its length. */
static double set_back(const struct tangent *c, double *w)
{
    double length = size_of(c, w);
    for (size_t k = 0; k < c->ode->n; k++)
        w[k] /= length;
    return log(length);
}

/* Mean exponential growth of nearby orbits, from the growth in each interval. */
struct megno {
    double weighted; /* integral of time over d(log growth) */
    double sum;      /* of its values */
};

static void megno_add(struct megno *m, double before, double now, double growth)
{
    m->weighted += 0.5 * (before + now) * growth;
    m->sum += 2 * m->weighted / now;
}

/* A quantity that only grows: the largest so far. */
struct most {
    double first, now; /* first: that is not 0 */
};

/* Returns the log of its growth by a new value. */
static double most_add(struct most *m, double value)
{
    double before = m->now;
    if (!(value > before))
        return 0;
    m->now = value;
    m->first = m->first > 0 ? m->first : value;
    return before > 0 ? log(value / before) : 0;
}

/* When a difference has grown as asked; INFINITY: not yet. */
struct passing {
    double log_growth, at;
};

static void pass(struct passing *p, double growth, double threshold, double from, double to)
{
    if (isinf(p->at) && p->log_growth + growth >= threshold)
        p->at = from + (threshold - p->log_growth) / growth * (to - from);
    p->log_growth += growth;
}

struct lyapunov_run {
    struct tangent *tangent;
    const struct phys_lyapunov_settings *settings;
    double tolerance;
    struct megno of_growth, beyond; /* the motion's own growth */
    struct passing absolute, relative /* to the size of the motion */;
    struct most rate, size;
};

static enum ad_status measure_motion(struct lyapunov_run *m, double t, const double *y,
                                     double *by_rate, double *by_size, struct ad_error *error)
{
    struct tangent *c = m->tangent;
    if (c->ode->field(c->ode->context, t, y, c->rate, error) != AD_OK)
        return error->status;
    *by_rate = most_add(&m->rate, size_of(c, c->rate));
    *by_size = most_add(&m->size, fmax(size_of(c, y), 1));
    return AD_OK;
}

static enum ad_status follow_tangents(struct lyapunov_run *m, double *y, const double *scale,
                                      struct ad_error *error)
{
    const struct phys_lyapunov_settings *s = m->settings;
    size_t n = m->tangent->ode->n;
    const struct phys_ode both = {
        .name = m->tangent->ode->name, .n = 2 * n, .field = field, .context = m->tangent};
    struct phys_simulation step = {.size = sizeof step,
                                   .integrator = phys_integrator_find("dop853", error),
                                   .rtol = m->tolerance,
                                   .atol = m->tolerance,
                                   .scale = scale,
                                   .max_steps = MOST_STEPS,
                                   .proceed = s->proceed,
                                   .context = s->context};
    struct phys_simulation_info info;
    double by_rate, by_size, threshold = log(s->lost / s->known);
    set_back(m->tangent, y + n);
    if (measure_motion(m, s->t0, y, &by_rate, &by_size, error) != AD_OK)
        return error->status;
    for (size_t i = 1; i <= INTERVALS; i++) {
        double before = (s->t1 - s->t0) * (double)(i - 1) / INTERVALS;
        double now = (s->t1 - s->t0) * (double)i / INTERVALS;
        step.t0 = s->t0 + before;
        step.t1 = s->t0 + now;
        if (phys_simulate(&step, &both, y, &info, error) != AD_OK)
            return error->status;
        if (info.stop != PHYS_SIMULATION_END)
            return ad_fail(error, AD_E_ACCURACY, "interrupted");
        double growth = set_back(m->tangent, y + n);
        if (measure_motion(m, step.t1, y, &by_rate, &by_size, error) != AD_OK)
            return error->status;
        megno_add(&m->of_growth, before, now, growth);
        megno_add(&m->beyond, before, now, growth - by_rate);
        pass(&m->absolute, growth, threshold, step.t0, step.t1);
        pass(&m->relative, growth - by_size, threshold, step.t0, step.t1);
    }
    return AD_OK;
}

/* Adds one run to the results: means, and ranges. */
static void gather(struct phys_lyapunov *result, const struct lyapunov_run *m, bool first)
{
    double span = m->settings->t1 - m->settings->t0, exponent = m->absolute.log_growth / span;
    /* at rest there is no motion to be chaotic */
    double beyond = m->rate.first > 0 ? m->beyond.sum / INTERVALS : 0;
    double horizon = beyond > regular || m->rate.first == 0 ? m->absolute.at : m->relative.at;
    result->least = first ? exponent : fmin(result->least, exponent);
    result->most = first ? exponent : fmax(result->most, exponent);
    result->horizon = first ? horizon : fmin(result->horizon, horizon);
    result->latest = first ? horizon : fmax(result->latest, horizon);
    result->exponent += exponent / RUNS;
    result->megno += m->of_growth.sum / INTERVALS / RUNS;
    result->chaotic = (first || result->chaotic) && beyond > regular;
}

enum ad_status phys_lyapunov(const struct phys_ode *ode, const double *y,
                             const struct phys_lyapunov_settings *settings,
                             struct phys_lyapunov *result, struct ad_error *error)
{
    if (AD_LACKS(error, result))
        return error->status;
    *result = (struct phys_lyapunov){.time = INFINITY, .horizon = INFINITY, .latest = INFINITY};
    if (AD_LACKS(error, ode, y, settings, ode->field))
        return error->status;
    if (ode->project)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has constraints, which neighbouring motions would leave",
                       ode->name ? ode->name : "the motion");
    AD_OWN(phys_lyapunov_settings, settings, context, error);
    size_t n = ode->n;
    double tolerance = settings->tolerance > 0 ? settings->tolerance : usual;
    if (!(settings->t1 > settings->t0))
        return ad_fail(error, AD_E_ARGUMENT, "growth from t0 = %g to t1 = %g: expected a later end",
                       settings->t0, settings->t1);
    if (!(settings->tolerance >= 0))
        return ad_fail(error, AD_E_ARGUMENT, "tolerance: expected more than 0, or 0 for %g, got %g",
                       usual, settings->tolerance);
    double length = settings->direction ? 0 : 1;
    for (size_t k = 0; k < n; k++) {
        if (settings->scale && !(settings->scale[k] > 0 && isfinite(settings->scale[k])))
            return ad_fail(error, AD_E_ARGUMENT, "scale[%zu]: expected more than 0, got %g", k,
                           settings->scale[k]);
        length += settings->direction ? fabs(settings->direction[k]) : 0;
    }
    if (!(length > 0 && isfinite(length)))
        return ad_fail(error, AD_E_ARGUMENT, "direction: expected numbers, not all 0");
    if (!(settings->known > 0 && settings->lost > settings->known))
        return ad_fail(error, AD_E_ARGUMENT,
                       "differences known = %g at the start and lost = %g at the horizon, expected "
                       "positive numbers, the second larger",
                       settings->known, settings->lost);
    double *memory = calloc(6 * n, sizeof *memory);
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct tangent c = {ode, settings->scale, memory + 4 * n, memory + 5 * n};
    double *both = memory, *scale = memory + 2 * n;
    for (int run = 0; run < RUNS && error->status == AD_OK; run++, tolerance *= coarser) {
        struct lyapunov_run m = {.tangent = &c,
                                 .settings = settings,
                                 .tolerance = tolerance,
                                 .absolute.at = INFINITY,
                                 .relative.at = INFINITY};
        memcpy(both, y, n * sizeof *y);
        begin_direction(&c, settings->direction, run, both + n);
        fill_scale(&c, tolerance, scale);
        if (follow_tangents(&m, both, scale, error) == AD_OK)
            gather(result, &m, run == 0);
    }
    result->growth = exp(result->exponent * (settings->t1 - settings->t0));
    result->time = result->exponent > 0 ? 1 / result->exponent : INFINITY;
    free(memory);
    return error->status;
}
