/* Motions in stretches that begin at the data, and how they change with the unknowns: the
   derivatives by a stretch's own beginning are chained to those by the trial's start, so that the
   unknowns stay few (condensing). */
#include "internal.h"
#include "physics/lagrangian/conserved.h"
#include "physics/motion/motion.h"
#include "physics/stability/internal.h"
#include "physics/system/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t trial_of(const struct phys_fit_data *data, size_t row)
{
    return data->trial ? data->trial[row] : 0;
}

static bool begins_trial(const struct phys_fitting *s, size_t k)
{
    return k == 0 || s->stretch[k].trial != s->stretch[k - 1].trial;
}

/* ---- beginnings ---- */

/* The first row from `row` on, by steps of 1 or -1, where component i is measured; SIZE_MAX: none
   of the trial that `of` belongs to. */
static size_t next_measured(const struct phys_fitting *s, size_t of, size_t row, size_t step,
                            size_t i)
{
    const struct phys_fit_data *data = s->data;
    for (; row < data->n && trial_of(data, row) == trial_of(data, of); row += step)
        if (isfinite(data->x[row * s->d + i]) && !s->fit->held[row])
            return row;
    return SIZE_MAX;
}

/* Component i at `row`, or its rate, on the line through the nearest rows on either side where it
   is measured, or through two on one side. NaN: it is not measured. */
static double measured_near(const struct phys_fitting *s, size_t row, size_t i, bool rate)
{
    const double *t = s->data->t, *x = s->data->x + i;
    const size_t back = SIZE_MAX;
    size_t low = next_measured(s, row, rate ? row - 1 : row, back, i);
    size_t high = next_measured(s, row, rate || low == row ? row + 1 : row, 1, i);
    if (rate && (low == SIZE_MAX || high == SIZE_MAX) && isfinite(x[row * s->d]))
        *(low == SIZE_MAX ? &low : &high) = row;
    if (low == SIZE_MAX && high != SIZE_MAX) {
        low = high;
        high = next_measured(s, row, high + 1, 1, i);
    } else if (high == SIZE_MAX && low != SIZE_MAX) {
        high = low;
        low = next_measured(s, row, low - 1, back, i);
    }
    if (low == SIZE_MAX || high == SIZE_MAX)
        return rate || (low == SIZE_MAX && high == SIZE_MAX)
                   ? (double)NAN
                   : x[(low == SIZE_MAX ? high : low) * s->d];
    const double slope = (x[high * s->d] - x[low * s->d]) / (t[high] - t[low]);
    return rate ? slope : x[low * s->d] + slope * (t[row] - t[low]);
}

/* What is not measured of a trial's start is that of the scene; elsewhere, not a number. */
static double guess(const struct phys_fitting *s, size_t row, size_t i, const double *start)
{
    double x = measured_near(s, row, i, false);
    if (!isfinite(x) && 2 * i >= s->d)
        x = measured_near(s, row, i - s->d / 2, true);
    return isfinite(x) || !start ? x : start[i];
}

static enum ad_status guess_beginnings(struct phys_fitting *s, struct ad_error *error)
{
    const struct phys_scene *scene = s->system.scene;
    double *start = calloc(s->d, sizeof *start);
    if (!start)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (!scene->start)
        ad_fail(error, AD_E_ARGUMENT, "%s has no start", scene->name);
    else
        scene->start(s->system.params, s->settings->seed, start, start + s->d / 2, error);
    for (size_t k = 0; k < s->n_stretches && error->status == AD_OK; k++) {
        const bool first = begins_trial(s, k);
        for (size_t i = 0; i < s->d; i++)
            s->begin[k * s->d + i] = first && s->settings->fixed_start
                                         ? start[i]
                                         : guess(s, s->stretch[k].first, i, first ? start : NULL);
    }
    free(start);
    return error->status;
}

/* ---- construction ---- */

/* Whether all components of all beginnings can be had from the data. */
static bool is_measured(const struct phys_fitting *s, size_t row)
{
    for (size_t i = 0; i < s->d; i++)
        if (!isfinite(guess(s, row, i, NULL)))
            return false;
    return true;
}

enum ad_status phys_fitting_divide(struct phys_fitting *s, size_t rows, struct ad_error *error)
{
    const struct phys_fit_data *data = s->data;
    s->n_stretches = 0;
    for (size_t row = 0; row < data->n; row++) {
        struct phys_stretch *last = s->n_stretches ? s->stretch + s->n_stretches - 1 : NULL;
        const bool first = !last || last->trial != trial_of(data, row);
        if (s->fit->held[row])
            continue;
        if (!first && (last->end - last->first < rows || !is_measured(s, row))) {
            last->end = row + 1;
            continue;
        }
        if (!first)
            last->t1 = data->t[row];
        const double t0 = first && s->settings->fixed_start ? 0 : data->t[row];
        s->stretch[s->n_stretches++] =
            (struct phys_stretch){trial_of(data, row), row, row + 1, t0, t0};
    }
    return guess_beginnings(s, error);
}

/* Typical sizes of the components: the spread of what is measured, else of the motion's start. */
static enum ad_status find_sizes(struct phys_fitting *s, struct ad_error *error)
{
    struct phys_ode plain = {0};
    const size_t d = s->d;
    if (phys_ode_lagrangian(&s->system, &plain, error) == AD_OK)
        phys_typical_sizes(&plain, s->stretch[0].t0, s->begin, s->size, error);
    phys_ode_free(&plain);
    for (size_t i = 0; i < d && error->status == AD_OK; i++) {
        double largest = 0;
        for (size_t k = 0; k < s->data->n; k++)
            largest = fmax(largest, fabs(s->data->x[k * d + i])); /* NaN is ignored */
        s->size[i] = largest > 0 ? largest : s->size[i];
    }
    for (size_t j = 1; j * d < s->ode.n; j++)
        for (size_t i = 0; i < d; i++) {
            const double p = j > d ? phys_system_get(&s->system, s->settings->free[j - 1 - d]) : 0,
                         unit = j <= d   ? s->size[j - 1]
                                : p == 0 ? 1
                                         : fabs(p);
            s->size[j * d + i] = s->size[i] / unit;
        }
    return error->status;
}

enum ad_status phys_fitting_new(const struct phys_system *system, const struct phys_fit_data *data,
                                const struct phys_fit_settings *settings, struct phys_fit *fit,
                                struct phys_fitting *s, struct ad_error *error)
{
    const size_t d = 2 * system->dof, N = fit->n_unknown;
    *s = (struct phys_fitting){
        .data = data, .settings = settings, .fit = fit, .system = *system, .d = d};
    s->system.params = malloc(system->scene->params_bytes + 1);
    s->stretch = calloc(data->n + 1, sizeof *s->stretch);
    if (!s->system.params || !s->stretch)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(s->system.params, system->params, system->scene->params_bytes);
    if (phys_ode_parameters(&s->system, d, settings->n_free, settings->free, &s->ode, error) !=
        AD_OK)
        return error->status;
    s->begin = calloc(data->n * d + 1, sizeof *s->begin);
    s->size = calloc(2 * s->ode.n, sizeof *s->size);
    s->J = calloc((fit->measured + 1) * (N + 1), sizeof *s->J);
    s->chain = calloc((data->n + 1) * d * (N + 1), sizeof *s->chain);
    if (!s->begin || !s->size || !s->J || !s->chain)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->y = s->size + s->ode.n;
    s->r = s->J + fit->measured * N;
    return phys_fitting_divide(s, phys_fitting_rows(settings), error) == AD_OK
               ? find_sizes(s, error)
               : error->status;
}

void phys_fitting_free(struct phys_fitting *s)
{
    phys_ode_free(&s->ode);
    free(s->system.params);
    free(s->stretch);
    free(s->begin);
    free(s->size);
    free(s->J);
    free(s->chain);
    *s = (struct phys_fitting){0};
}

/* ---- one run ---- */

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
    const struct phys_simulation how = {.integrator = phys_integrator_find("taylor", error),
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
                                        .proceed = s->settings->proceed,
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
        if (begins_trial(s, k) && begin_chain(s, at->trial, chain, error) != AD_OK)
            return error->status;
        begin(s, s->begin + k * s->d);
        if (run(s, at->t0, at->t1, &to, error) != AD_OK)
            return error->status;
        if (k + 1 < s->n_stretches && !begins_trial(s, k + 1))
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
               trial_of(s->data, to.end) == at->trial)
            to.end++;
        begin(s, s->begin + k * s->d);
        if (to.end > to.row)
            run(s, at->t0, at->t0, &to, error);
    }
    return error->status;
}
