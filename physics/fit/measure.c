/* Follows the stretches of a fit, and how their motions change with the unknowns: the derivatives
   by a stretch's own beginning are chained to those by the trial's start, so that the unknowns stay
   few (condensing). */
#include "internal.h"
#include "physics/lagrangian/conserved.h"
#include "physics/motion/motion.h"
#include "physics/stability/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct reader {
    struct phys_fitting *s;
    const double *chain; /* of the stretch */
    size_t row, end, entry;
};

/* How component i moves with unknown j, or by itself (j = n_unknown), through the chain. */
static double chained(const struct phys_fitting *s, const double *chain, const double *y, size_t i,
                      size_t j)
{
    const size_t d = s->d, N = s->fit->n_unknown;
    double sum = j < s->fit->n_free ? y[d * (1 + d + j) + i] : 0;
    for (size_t k = 0; k < d; k++)
        sum += y[d * (1 + k) + i] * chain[k * (N + 1) + j];
    return sum;
}

static bool read_sample(void *context, double t, const double *y)
{
    struct reader *to = context;
    struct phys_fitting *s = to->s;
    const size_t d = s->d, N = s->fit->n_unknown;
    if (to->row == to->end || t < s->data->t[to->row])
        return true;
    const size_t row = to->row++;
    memcpy(s->fit->model + row * d, y, d * sizeof *y);
    for (size_t i = 0; i < d && to->chain; i++) {
        const double x = s->data->x[row * d + i], noise = s->fit->noise[i];
        if (!isfinite(x))
            continue;
        const double off = (x - y[i]) / noise;
        s->squares += off * off;
        s->r[to->entry] = off - chained(s, to->chain, y, i, N) / noise;
        for (size_t j = 0; j < N; j++)
            s->J[to->entry * N + j] = chained(s, to->chain, y, i, j) / noise;
        to->entry++;
    }
    return true;
}

/* proceed has the caller's context, samples have the reader. */
static bool goes_on(void *context)
{
    const struct phys_fit_settings *settings = ((const struct reader *)context)->s->settings;
    return !settings->proceed || settings->proceed(settings->context);
}

/* From s->y at t0 over rows [row, end) to t1, if that is later. */
static enum ad_status run(struct phys_fitting *s, double t0, double t1, struct reader *to,
                          struct ad_error *error)
{
    const size_t rows = to->end - to->row;
    double *times = malloc((rows + 1) * sizeof *times);
    struct phys_simulation_info info = {.stop = PHYS_SIMULATION_END};
    if (!times)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    size_t n = 0;
    for (size_t k = to->row; k < to->end; k++)
        if (s->data->t[k] > t0)
            times[n++] = s->data->t[k];
    if (t1 > (n ? times[n - 1] : t0))
        times[n++] = t1;
    struct ad_error none = {0};
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_integrator_find("taylor", error),
                                        .t0 = t0,
                                        .t1 = n ? times[n - 1] : t0,
                                        .rtol = 1e-12,
                                        .atol = 1e-12,
                                        .scale = s->size,
                                        .n_samples = n,
                                        .times = times,
                                        .sample = read_sample,
                                        .land = !phys_keeps_energy(&s->system, &none),
                                        .max_steps = 2000,
                                        .proceed = goes_on,
                                        .context = to};
    if (n)
        phys_simulate(&how, &s->ode, s->y, &info, error);
    else
        read_sample(to, t0, s->y);
    if (error->status == AD_OK && info.stop != PHYS_SIMULATION_END)
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    free(times);
    return error->status;
}

static void begin(struct phys_fitting *s, const double *x)
{
    const size_t d = s->d;
    memset(s->y, 0, s->ode.n * sizeof *s->y);
    memcpy(s->y, x, d * sizeof *x);
    for (size_t k = 0; k < d; k++)
        s->y[d * (1 + k) + k] = 1;
}

/* How a trial's start moves: freely, or with the parameters of the scene's start. */
static enum ad_status begin_chain(struct phys_fitting *s, size_t trial, double *chain,
                                  struct ad_error *error)
{
    const size_t d = s->d, P = s->fit->n_free, N = s->fit->n_unknown;
    memset(chain, 0, d * (N + 1) * sizeof *chain);
    for (size_t i = 0; i < d && !s->settings->fixed_start; i++)
        chain[i * (N + 1) + P + trial * d + i] = 1;
    if (!s->settings->fixed_start)
        return AD_OK;
    double *slope = malloc(2 * P * d * sizeof *slope);
    if (!slope)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_start_slopes(&s->system, s->settings->seed, P, s->settings->free, slope, slope + P * d,
                          error) == AD_OK)
        for (size_t k = 0; k < P * d; k++)
            chain[k % d * (N + 1) + k / d] = slope[k];
    free(slope);
    return error->status;
}

/* The chain of the stretch that follows, and the gap before it. */
static void link(struct phys_fitting *s, size_t k, const double *chain, double *next)
{
    const size_t d = s->d, N = s->fit->n_unknown;
    for (size_t i = 0; i < d; i++) {
        const double gap = s->y[i] - s->begin[(k + 1) * d + i],
                     unit = isfinite(s->fit->noise[i]) ? s->fit->noise[i] : 0.1 * s->size[i];
        for (size_t j = 0; j <= N; j++)
            next[i * (N + 1) + j] = chained(s, chain, s->y, i, j);
        next[i * (N + 1) + N] += gap;
        s->merit += gap / unit * (gap / unit);
        s->gap = fmax(s->gap, fabs(gap) / unit);
    }
}

enum ad_status phys_fitting_measure(struct phys_fitting *s, struct ad_error *error)
{
    const size_t block = s->d * (s->fit->n_unknown + 1);
    struct reader to = {.s = s};
    s->merit = s->squares = s->gap = 0;
    for (size_t k = 0; k < s->n_stretches; k++) {
        const struct phys_stretch *at = s->stretch + k;
        double *chain = s->chain + k * block;
        to.chain = chain;
        to.row = at->first;
        to.end = at->end;
        if (phys_fitting_begins_trial(s, k) && begin_chain(s, at->trial, chain, error) != AD_OK)
            return error->status;
        begin(s, s->begin + k * s->d);
        if (run(s, at->t0, at->t1, &to, error) != AD_OK)
            return error->status;
        if (k + 1 < s->n_stretches && !phys_fitting_begins_trial(s, k + 1))
            link(s, k, chain, chain + block);
    }
    s->merit += s->squares;
    return isfinite(s->merit) ? AD_OK
                              : ad_fail(error, AD_E_NONFINITE, "the residuals are not finite");
}

enum ad_status phys_fitting_predict(struct phys_fitting *s, struct ad_error *error)
{
    for (size_t k = 0; k < s->n_stretches && error->status == AD_OK; k++) {
        const struct phys_stretch *at = s->stretch + k;
        struct reader to = {.s = s, .row = at->end, .end = at->end};
        while (to.end < s->data->n && s->fit->held[to.end] &&
               phys_fit_trial(s->data, to.end) == at->trial)
            to.end++;
        begin(s, s->begin + k * s->d);
        if (to.end > to.row)
            run(s, at->t0, at->t0, &to, error);
    }
    return error->status;
}
