/* Divides the motions of a fit into stretches that begin at the data. */
#include "internal.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- beginnings ---- */

/* The first row from `row` on, by steps of 1 or -1, where component i is measured; SIZE_MAX: none
   of the trial that `of` belongs to. */
static size_t next_measured(const struct phys_fitting *s, size_t of, size_t row, size_t step,
                            size_t i)
{
    const struct phys_fit_data *data = s->data;
    for (; row < data->n && phys_fit_trial(data, row) == phys_fit_trial(data, of); row += step)
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
    size_t span = rate ? s->span : 0;
    while (span > 1 && (row < span || row + span >= s->data->n ||
                        phys_fit_trial(s->data, row - span) != phys_fit_trial(s->data, row + span)))
        span--;
    size_t low = next_measured(s, row, row - span, back, i);
    size_t high = next_measured(s, row, rate ? row + span : low == row ? row + 1 : row, 1, i);
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
        const bool first = phys_fitting_begins_trial(s, k);
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
        const bool first = !last || last->trial != phys_fit_trial(data, row);
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
            (struct phys_stretch){phys_fit_trial(data, row), row, row + 1, t0, t0};
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
