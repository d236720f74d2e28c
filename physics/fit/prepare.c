/* Checks the data and settings of a fit, and allocates its results. */
#include "internal.h"
#include "physics/system/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status check(const struct phys_system *system, const struct phys_fit_data *data,
                            const struct phys_fit_settings *how, struct ad_error *error)
{
    const size_t d = 2 * system->dof;
    if (data->n < 2)
        return ad_fail(error, AD_E_ARGUMENT, "%zu rows; expected at least 2", data->n);
    if (!(how->held_out >= 0 && how->held_out < 1))
        return ad_fail(error, AD_E_ARGUMENT, "held-out share: expected 0 to less than 1, got %g",
                       how->held_out);
    for (size_t i = 0; how->noise && i < d; i++)
        if (!(how->noise[i] >= 0 && isfinite(how->noise[i])))
            return ad_fail(error, AD_E_ARGUMENT,
                           "noise %zu: expected more than 0, or 0 where it is unknown, got %g",
                           i + 1, how->noise[i]);
    for (size_t k = 0; k < how->n_free; k++) {
        if (AD_LACKS(error, how->free[k]))
            return error->status;
        if (phys_param_refuse(system, how->free[k], error) != AD_OK)
            return error->status;
        for (size_t j = 0; j < k; j++)
            if (strcmp(how->free[j], how->free[k]) == 0)
                return ad_fail(error, AD_E_ARGUMENT, "parameter %s is given twice", how->free[k]);
    }
    for (size_t k = 0; k < data->n; k++) {
        for (size_t i = 0; i < d; i++)
            if (isinf(data->x[k * d + i]))
                return ad_fail(error, AD_E_ARGUMENT,
                               "row %zu: column %zu is infinite; expected NaN if not measured",
                               k + 1, i + 1);
        const bool same = k > 0 && phys_fit_trial(data, k) == phys_fit_trial(data, k - 1);
        if (!isfinite(data->t[k]) || (same && !(data->t[k] > data->t[k - 1])))
            return ad_fail(error, AD_E_ARGUMENT,
                           "row %zu: time %g; expected more than in the row before", k + 1,
                           data->t[k]);
        if (!same && phys_fit_trial(data, k) != (k ? phys_fit_trial(data, k - 1) + 1 : 0))
            return ad_fail(error, AD_E_ARGUMENT, "row %zu: trial %zu; expected 0, 1, ... in order",
                           k + 1, phys_fit_trial(data, k));
        if (how->fixed_start && data->t[k] < 0)
            return ad_fail(error, AD_E_ARGUMENT,
                           "row %zu: time %g is before the scene's start at 0", k + 1, data->t[k]);
    }
    return AD_OK;
}

/* The last rows of each trial, as a share of them; the first two stay. */
static void hold_out(const struct phys_fit_data *data, double share, bool *held)
{
    for (size_t first = 0, end; first < data->n; first = end) {
        for (end = first;
             end < data->n && phys_fit_trial(data, end) == phys_fit_trial(data, first);)
            end++;
        const size_t rows = end - first, out = (size_t)(share * (double)rows);
        for (size_t k = 0; k < rows; k++)
            held[first + k] = k >= 2 && k >= rows - out;
    }
}

double phys_fit_spread(const struct phys_fit_data *data, size_t d, size_t i)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t k = 0; k < data->n; k++) {
        low = fmin(low, data->x[k * d + i]);
        high = fmax(high, data->x[k * d + i]);
    }
    return high > low ? high - low : fabs(high) > 0 ? fabs(high) : 1;
}

/* Sizes and memory of the fit, the rows held out, and first values of the noise. */
static enum ad_status size_fit(const struct phys_system *system, const struct phys_fit_data *data,
                               const struct phys_fit_settings *how, struct phys_fit *fit,
                               struct ad_error *error)
{
    const size_t d = 2 * system->dof;
    fit->n_free = how->n_free;
    fit->n_trials = 0;
    for (size_t k = 0; k < data->n; k++)
        fit->n_trials += k == 0 || phys_fit_trial(data, k) != phys_fit_trial(data, k - 1);
    const size_t N = fit->n_unknown = how->n_free + (how->fixed_start ? 0 : d * fit->n_trials);
    if (N == 0)
        return ad_fail(error, AD_E_ARGUMENT, "nothing is free; expected parameters or starts");
    fit->value = calloc(4 * N + N * N, sizeof *fit->value);
    fit->model = calloc(data->n * d + 3 * d, sizeof *fit->model);
    fit->held = calloc(data->n, sizeof *fit->held);
    if (!fit->value || !fit->model || !fit->held)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    fit->deviation = fit->value + N;
    fit->singular = fit->deviation + N;
    fit->weakest = fit->singular + N;
    fit->covariance = fit->weakest + N;
    fit->noise = fit->model + data->n * d;
    fit->rms = fit->noise + d;
    fit->held_rms = fit->rms + d;
    hold_out(data, how->held_out, fit->held);
    for (size_t i = 0; i < d; i++) {
        size_t n = 0;
        for (size_t k = 0; k < data->n; k++)
            n += isfinite(data->x[k * d + i]) && !fit->held[k];
        const bool given = how->noise && how->noise[i] > 0;
        fit->measured += n;
        fit->noise[i] = n == 0  ? (double)NAN
                        : given ? how->noise[i]
                                : 0.1 * phys_fit_spread(data, d, i);
    }
    fit->freedom = (double)fit->measured - (double)N;
    return fit->measured > N
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT,
                         "%zu measured numbers for %zu unknowns; expected more", fit->measured, N);
}

enum ad_status phys_fit_prepare(const struct phys_system *system, const struct phys_fit_data *data,
                                const struct phys_fit_settings *how, struct phys_fit *fit,
                                struct ad_error *error)
{
    return check(system, data, how, error) == AD_OK ? size_fit(system, data, how, fit, error)
                                                    : error->status;
}

void phys_fit_free(struct phys_fit *fit)
{
    if (!fit)
        return;
    free(fit->value);
    free(fit->model);
    free(fit->held);
    *fit = (struct phys_fit){0};
}
