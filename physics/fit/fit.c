/* The method of Levenberg and Marquardt on the motions of stretches (fit.h). */
#include "internal.h"
#include "physics/io/random.h"
#include "physics/system/internal.h"
#include "physics/system/params.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ITERATIONS = 100, ROUNDS = 12, TRIES = 3 };

/* Below it, of the largest, a singular value is rounding of the motion. */
static const double indistinct = 1e-8;
/* Residuals that are more of the data's spread. */
static const double unlike = 0.5;

/* ---- sizes ---- */

static size_t trial_of(const struct phys_fit_data *data, size_t row)
{
    return data->trial ? data->trial[row] : 0;
}

static enum ad_status check(const struct phys_system *system, const struct phys_fit_data *data,
                            const struct phys_fit_settings *how, struct ad_error *error)
{
    if (data->n < 2)
        return ad_fail(error, AD_E_ARGUMENT, "%zu rows; expected at least 2", data->n);
    if (!(how->held_out >= 0 && how->held_out < 1))
        return ad_fail(error, AD_E_ARGUMENT, "held-out share: expected 0 to less than 1, got %g",
                       how->held_out);
    for (size_t k = 0; k < how->n_free; k++) {
        if (phys_param_refuse(system, how->free[k], error) != AD_OK)
            return error->status;
        for (size_t j = 0; j < k; j++)
            if (strcmp(how->free[j], how->free[k]) == 0)
                return ad_fail(error, AD_E_ARGUMENT, "parameter %s is given twice", how->free[k]);
    }
    for (size_t k = 0; k < data->n; k++) {
        const bool same = k > 0 && trial_of(data, k) == trial_of(data, k - 1);
        if (!isfinite(data->t[k]) || (same && !(data->t[k] > data->t[k - 1])))
            return ad_fail(error, AD_E_ARGUMENT,
                           "row %zu: time %g; expected more than in the row before", k + 1,
                           data->t[k]);
        if (!same && trial_of(data, k) != (k ? trial_of(data, k - 1) + 1 : 0))
            return ad_fail(error, AD_E_ARGUMENT, "row %zu: trial %zu; expected 0, 1, ... in order",
                           k + 1, trial_of(data, k));
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
        for (end = first; end < data->n && trial_of(data, end) == trial_of(data, first);)
            end++;
        const size_t rows = end - first, out = (size_t)(share * (double)rows);
        for (size_t k = 0; k < rows; k++)
            held[first + k] = k >= 2 && k >= rows - out;
    }
}

static double spread_of(const struct phys_fit_data *data, size_t d, size_t i)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t k = 0; k < data->n; k++) {
        low = fmin(low, data->x[k * d + i]);
        high = fmax(high, data->x[k * d + i]);
    }
    return high > low ? high - low : fabs(high) > 0 ? fabs(high) : 1;
}

static enum ad_status prepare(const struct phys_system *system, const struct phys_fit_data *data,
                              const struct phys_fit_settings *how, struct phys_fit *fit,
                              struct ad_error *error)
{
    const size_t d = 2 * system->dof;
    fit->n_free = how->n_free;
    fit->n_trials = 0;
    for (size_t k = 0; k < data->n; k++)
        fit->n_trials += k == 0 || trial_of(data, k) != trial_of(data, k - 1);
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
        fit->noise[i] = n == 0 ? (double)NAN : given ? how->noise[i] : 0.1 * spread_of(data, d, i);
    }
    fit->freedom = (double)fit->measured - (double)N;
    return fit->measured > N
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT,
                         "%zu measured numbers for %zu unknowns; expected more", fit->measured, N);
}

/* ---- one minimum ---- */

/* What a step changes. */
struct point {
    double *params, *begin;
};

static void keep(const struct phys_fitting *s, struct point *to)
{
    memcpy(to->params, s->system.params, s->system.scene->params_bytes);
    memcpy(to->begin, s->begin, s->n_stretches * s->d * sizeof *s->begin);
}

static void go_back(struct phys_fitting *s, const struct point *to)
{
    memcpy(s->system.params, to->params, s->system.scene->params_bytes);
    memcpy(s->begin, to->begin, s->n_stretches * s->d * sizeof *s->begin);
}

/* Moves by a share of a step: parameters, and beginnings by the chain of the last measure. False
   where the parameters are no values. */
static bool move(struct phys_fitting *s, const double *step, double share, struct ad_error *error)
{
    const size_t d = s->d, N = s->fit->n_unknown;
    struct ad_error refused = {0};
    for (size_t k = 0; k < s->fit->n_free; k++) {
        const double p = phys_system_get(&s->system, s->settings->free[k]);
        if (phys_system_set(&s->system, s->settings->free[k], p + share * step[k], &refused) !=
            AD_OK)
            return false;
    }
    for (size_t k = 0; k < s->n_stretches; k++)
        for (size_t i = 0; i < d; i++) {
            const double *row = s->chain + (k * d + i) * (N + 1);
            double change = row[N];
            for (size_t j = 0; j < N; j++)
                change += row[j] * step[j];
            s->begin[k * d + i] += share * change;
        }
    for (size_t k = 0; s->settings->fixed_start && k < s->n_stretches; k++)
        if (k == 0 || s->stretch[k].trial != s->stretch[k - 1].trial)
            s->system.scene->start(s->system.params, s->settings->seed, s->begin + k * d,
                                   s->begin + k * d + d / 2, &refused);
    return phys_keep_memory(&refused, error) == AD_OK && refused.status == AD_OK;
}

static bool is_fatal(const struct ad_error *error)
{
    return error->status == AD_E_MEMORY || error->status == AD_E_ARGUMENT ||
           strstr(error->message, "interrupted");
}

static void store(const struct phys_fitting *s)
{
    struct phys_fit *fit = s->fit;
    for (size_t k = 0; k < fit->n_free; k++)
        fit->value[k] = phys_system_get(&s->system, s->settings->free[k]);
    for (size_t k = 0; k < s->n_stretches && !s->settings->fixed_start; k++)
        if (k == 0 || s->stretch[k].trial != s->stretch[k - 1].trial)
            memcpy(fit->value + fit->n_free + s->stretch[k].trial * s->d, s->begin + k * s->d,
                   s->d * sizeof *s->begin);
}

/* One step that lowers the merit: *down by how much, 0 where none does. Shares of Gauss and
   Newton's come first: of a chaotic motion any damping of the unknowns is a large change at its
   end, which does not close the gaps any more. */
static enum ad_status descend(struct phys_fitting *s, const struct phys_squares *q,
                              struct point *here, double *down, double *step,
                              struct ad_error *error)
{
    enum { SHARES = 6, ATTEMPTS = 22 };
    const double before = s->merit;
    const size_t chains = (s->n_stretches + 1) * s->d * (s->fit->n_unknown + 1);
    double *chain = malloc(chains * sizeof *chain);
    if (!chain)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(chain, s->chain, chains * sizeof *chain);
    keep(s, here);
    *down = 0;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        struct ad_error cause = {0};
        const bool shared = attempt < SHARES;
        const double lambda = shared ? 0 : 1e-8 * pow(10, attempt - SHARES);
        phys_squares_solve(q, lambda * q->s[0] * q->s[0], step);
        memcpy(s->chain, chain, chains * sizeof *chain);
        const bool valid = move(s, step, shared ? ldexp(1, -attempt) : 1, &cause);
        if (valid)
            phys_fitting_measure(s, &cause);
        if (cause.status != AD_OK && is_fatal(&cause)) {
            *error = cause;
            break;
        }
        if (valid && cause.status == AD_OK && s->merit < before) {
            *down = before - s->merit;
            break;
        }
        go_back(s, here);
    }
    free(chain);
    return error->status;
}

/* From where the shooting is to a minimum. *met: it is one. */
static enum ad_status minimise(struct phys_fitting *s, struct point *here, bool *met,
                               struct ad_error *error)
{
    const double rows = (double)s->fit->measured;
    double *step = malloc(s->fit->n_unknown * sizeof *step);
    *met = false;
    if (!step)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_fitting_measure(s, error);
    for (int k = 0; k < ITERATIONS && error->status == AD_OK && !*met; k++) {
        struct phys_squares q = {0};
        double down = 0, before = s->merit;
        if (phys_squares_new(s->fit->measured, s->fit->n_unknown, s->J, s->r, &q, error) == AD_OK)
            descend(s, &q, here, &down, step, error);
        phys_squares_free(&q);
        s->fit->iterations++;
        /* what is left is rounding of the motion, or a millionth of a standard deviation */
        *met = down <= 1e-11 * before + 1e-22 * rows && s->gap <= 1e-4;
        if (down == 0) {
            if (error->status == AD_OK)
                phys_fitting_measure(s, error);
            *met = s->gap <= 1e-3; /* no step, however short, goes down */
            break;
        }
    }
    free(step);
    return error->status;
}

/* ---- what it tells ---- */

/* Standard deviations of the noise of each component, from its residuals: their sum of squares over
   their number less the unknowns they determine, the sum of their leverages. True if none changed
   by a thousandth. */
static bool estimate_noise(struct phys_fitting *s, const struct phys_squares *q, const double *J)
{
    struct phys_fit *fit = s->fit;
    const size_t d = s->d, N = fit->n_unknown;
    bool still = true;
    for (size_t i = 0; i < d; i++) {
        double sum = 0, n = 0;
        size_t entry = 0;
        for (size_t k = 0; k < s->data->n; k++)
            for (size_t c = 0; c < d; c++) {
                const double x = s->data->x[k * d + c];
                if (fit->held[k] || !isfinite(x))
                    continue;
                const double *row = J + entry++ * N;
                if (c != i)
                    continue;
                double leverage = 0;
                for (size_t m = 0; m < N && q->s[m] > indistinct * q->s[0]; m++) {
                    double along = 0;
                    for (size_t j = 0; j < N; j++)
                        along += row[j] / q->scale[j] * q->V[m * N + j];
                    leverage += along / q->s[m] * (along / q->s[m]);
                }
                sum += (x - fit->model[k * d + i]) * (x - fit->model[k * d + i]);
                n += 1 - leverage;
            }
        if (!isfinite(fit->noise[i]) || (s->settings->noise && s->settings->noise[i] > 0))
            continue;
        const double least = 1e-10 * spread_of(s->data, d, i),
                     found = fmax(sqrt(sum / fmax(n, 1e-3)), least);
        still = still && fabs(found - fit->noise[i]) <= 1e-3 * found;
        fit->noise[i] = found;
    }
    return still;
}

static void find_covariance(struct phys_fit *fit, const struct phys_squares *q)
{
    const size_t N = fit->n_unknown;
    const bool distinct = q->s[N - 1] > indistinct * q->s[0];
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++) {
            double sum = 0;
            for (size_t m = 0; m < N; m++)
                sum += q->V[m * N + i] * q->V[m * N + j] / (q->s[m] * q->s[m]);
            fit->covariance[i * N + j] =
                distinct ? sum / (q->scale[i] * q->scale[j]) : (double)INFINITY;
        }
    for (size_t i = 0; i < N; i++)
        fit->deviation[i] = sqrt(fit->covariance[i * N + i]);
    memcpy(fit->singular, q->s, N * sizeof *q->s);
    memcpy(fit->weakest, q->V + (N - 1) * N, N * sizeof *q->V);
}

/* Noise and covariance at a minimum; *still: the noise does not change any more. */
static enum ad_status judge(struct phys_fitting *s, bool *still, struct ad_error *error)
{
    const size_t bytes = s->fit->measured * s->fit->n_unknown * sizeof *s->J;
    double *J = malloc(bytes);
    struct phys_squares q = {0};
    if (!J)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(J, s->J, bytes);
    if (phys_squares_new(s->fit->measured, s->fit->n_unknown, s->J, s->r, &q, error) == AD_OK) {
        find_covariance(s->fit, &q);
        *still = estimate_noise(s, &q, J);
    }
    phys_squares_free(&q);
    free(J);
    return error->status;
}

static void find_rms(const struct phys_fitting *s)
{
    const size_t d = s->d;
    for (size_t i = 0; i < d; i++) {
        double sum[2] = {0}, n[2] = {0};
        for (size_t k = 0; k < s->data->n; k++) {
            const double off = s->data->x[k * d + i] - s->fit->model[k * d + i];
            if (isfinite(off)) {
                sum[s->fit->held[k]] += off * off;
                n[s->fit->held[k]]++;
            }
        }
        s->fit->rms[i] = sqrt(sum[0] / n[0]);
        s->fit->held_rms[i] = sqrt(sum[1] / n[1]);
    }
}

void phys_fit_name(const struct phys_system *system, const struct phys_fit_settings *settings,
                   const struct phys_fit *fit, size_t k, char *name, size_t size)
{
    char of[48];
    if (k < fit->n_free) {
        snprintf(name, size, "%s", settings->free[k]);
        return;
    }
    const size_t d = 2 * system->dof, trial = (k - fit->n_free) / d, i = (k - fit->n_free) % d;
    phys_coordinate_name(system, i % system->dof, of, sizeof of);
    if (fit->n_trials > 1)
        snprintf(name, size, "%s%s at the start of trial %zu", i < system->dof ? "" : "v_", of,
                 trial + 1);
    else
        snprintf(name, size, "%s%s at the start", i < system->dof ? "" : "v_", of);
}

/* Names what moves along the weakest direction. */
static enum ad_status refuse_indistinct(const struct phys_fitting *s, struct ad_error *error)
{
    const struct phys_fit *fit = s->fit;
    char list[300] = "", name[64];
    size_t used = 0;
    if (fit->singular[fit->n_unknown - 1] > indistinct * fit->singular[0])
        return AD_OK;
    for (size_t k = 0; k < fit->n_unknown && used + 80 < sizeof list; k++)
        if (fabs(fit->weakest[k]) > 0.05) {
            phys_fit_name(&s->system, s->settings, fit, k, name, sizeof name);
            used +=
                (size_t)snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", name);
        }
    return ad_fail(error, AD_E_ACCURACY,
                   "the data cannot tell %s%s: singular value %.2g of the largest; expected fewer "
                   "free",
                   list, strstr(list, ", ") ? " apart" : "",
                   fit->singular[fit->n_unknown - 1] / fit->singular[0]);
}

/* A motion that has little to do with the data: another minimum. */
static enum ad_status refuse_unlike(const struct phys_fitting *s, struct ad_error *error)
{
    double least = INFINITY;
    for (size_t i = 0; i < s->d; i++) {
        double n = 0, mean = 0, square = 0;
        for (size_t k = 0; k < s->data->n; k++)
            if (isfinite(s->data->x[k * s->d + i]) && !s->fit->held[k]) {
                const double x = s->data->x[k * s->d + i], off = x - mean;
                mean += off / ++n;
                square += off * (x - mean);
            }
        if (n > 0)
            least = fmin(least, s->fit->rms[i] / sqrt(square / n));
    }
    return least < unlike ? AD_OK
                          : ad_fail(error, AD_E_ACCURACY,
                                    "the motion found does not follow the data: residuals are %.2g "
                                    "of their spread; expected less than %g; try other values to "
                                    "begin with",
                                    least, unlike);
}

/* ---- all ---- */

/* Other values of the parameters, of the same signs. */
static bool perturb(struct phys_fitting *s, struct phys_random *random)
{
    struct ad_error refused = {0};
    for (size_t k = 0; k < s->fit->n_free; k++) {
        const double p = phys_system_get(&s->system, s->settings->free[k]),
                     u = phys_random_normal(random);
        if (phys_system_set(&s->system, s->settings->free[k], p == 0 ? 0.1 * u : p * exp(0.5 * u),
                            &refused) != AD_OK)
            return false;
    }
    return true;
}

/* From here, in stretches of so many rows first, which parameters that are far off do not spoil. */
static enum ad_status minimise_from(struct phys_fitting *s, size_t rows, struct point *here,
                                    struct ad_error *error)
{
    const size_t usual = phys_fitting_rows(s->settings);
    struct ad_error failed = {0};
    bool met;
    if (rows < usual && phys_fitting_divide(s, rows, &failed) == AD_OK) {
        keep(s, here);
        minimise(s, here, &met, &failed);
        if (failed.status != AD_OK && is_fatal(&failed))
            return *error = failed, error->status;
    }
    return phys_fitting_divide(s, usual, error) == AD_OK ? minimise(s, here, &met, error)
                                                         : error->status;
}

/* The best of several minima, and how many tries found it. */
static enum ad_status search(struct phys_fitting *s, struct point p[3], struct ad_error *error)
{
    struct phys_random random;
    const size_t tries = s->settings->tries ? s->settings->tries : TRIES;
    double best = INFINITY;
    struct ad_error cause = {0};
    phys_random_seed(&random, s->settings->seed + 1);
    keep(s, &p[1]);
    for (size_t k = 0; k < tries && error->status == AD_OK; k++) {
        const size_t rows = phys_fitting_rows(s->settings), shorter[] = {rows, 2, rows / 4 + 2};
        struct ad_error failed = {0};
        go_back(s, &p[1]);
        if (k >= LENGTH(shorter) && !perturb(s, &random))
            continue;
        s->fit->tries++;
        minimise_from(s, shorter[k % LENGTH(shorter)], &p[0], &failed);
        if (failed.status != AD_OK && is_fatal(&failed))
            *error = failed;
        if (failed.status != AD_OK) {
            cause = cause.status == AD_OK ? failed : cause;
            continue;
        }
        const bool same = fabs(s->merit - best) <= 1e-6 * best + 1e-20 * (double)s->fit->measured;
        s->fit->agreeing = same ? s->fit->agreeing + 1 : s->merit < best ? 1 : s->fit->agreeing;
        if (s->merit < best) {
            best = s->merit;
            keep(s, &p[2]);
        }
    }
    if (error->status == AD_OK && !isfinite(best))
        return ad_fail(error, cause.status ? cause.status : AD_E_ACCURACY, "%s", cause.message);
    go_back(s, &p[2]);
    return error->status;
}

static enum ad_status solve(struct phys_fitting *s, const struct phys_system *first,
                            struct point p[3], struct ad_error *error)
{
    bool met = false, still = false;
    if (search(s, p, error) != AD_OK)
        return error->status;
    for (int round = 0; round < ROUNDS && error->status == AD_OK && !(still && met); round++)
        if (minimise(s, &p[0], &met, error) == AD_OK)
            judge(s, &still, error);
    if (error->status == AD_OK)
        phys_fitting_predict(s, error);
    if (error->status == AD_OK &&
        !phys_params_keep_form(first, &s->system, s->fit->n_free, s->settings->free, error))
        ad_fail(error, AD_E_ACCURACY,
                "L has another form where the fit went: a condition on %s%s comes out otherwise; "
                "try other values to begin with",
                s->settings->free[0], s->fit->n_free > 1 ? " or another parameter" : "");
    s->fit->chi_square = s->squares;
    store(s);
    find_rms(s);
    if (error->status != AD_OK || refuse_indistinct(s, error) != AD_OK)
        return error->status;
    if (refuse_unlike(s, error) != AD_OK)
        return error->status;
    if (!met || s->gap > 1e-3)
        return ad_fail(error, AD_E_ACCURACY,
                       "no minimum found: gaps of %.2g standard deviations are left; try other "
                       "values to begin with, or fewer rows",
                       s->gap);
    return AD_OK;
}

enum ad_status phys_fit_solve(const struct phys_system *system, const struct phys_fit_data *data,
                              const struct phys_fit_settings *settings, struct phys_fit *fit,
                              struct ad_error *error)
{
    struct phys_fitting s = {0};
    struct point p[3] = {{0}};
    if (AD_LACKS_RESULT(error, fit) ||
        AD_LACKS(error, system, system->scene, data, data->t, data->x, settings) ||
        (settings->n_free && AD_LACKS(error, settings->free)))
        return error->status;
    if (check(system, data, settings, error) == AD_OK &&
        prepare(system, data, settings, fit, error) == AD_OK &&
        phys_fitting_new(system, data, settings, fit, &s, error) == AD_OK) {
        for (size_t k = 0; k < LENGTH(p); k++) {
            p[k].params = malloc(system->scene->params_bytes + 1);
            p[k].begin = malloc((data->n * s.d + 1) * sizeof *p[k].begin);
            if (!p[k].params || !p[k].begin)
                ad_fail(error, AD_E_MEMORY, "out of memory");
        }
        if (error->status == AD_OK)
            solve(&s, system, p, error);
    }
    for (size_t k = 0; k < LENGTH(p); k++) {
        free(p[k].params);
        free(p[k].begin);
    }
    phys_fitting_free(&s);
    return error->status;
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
