/* Fits by the method of Levenberg and Marquardt on the motions of stretches (fit.h): the best of
   several minima. */
#include "internal.h"
#include "autodiff/sized.h"
#include "physics/io/random.h"
#include "physics/system/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 12, TRIES = 3 };

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
static enum ad_status minimise_from(struct phys_fitting *s, size_t rows,
                                    struct phys_fitting_point *here, struct ad_error *error)
{
    const size_t usual = phys_fitting_rows(s->settings);
    struct ad_error failed = {0};
    bool met;
    if (rows < usual && phys_fitting_divide(s, rows, &failed) == AD_OK) {
        phys_fitting_keep(s, here);
        phys_fitting_minimise(s, here, &met, &failed);
        if (failed.status != AD_OK && phys_fitting_is_fatal(&failed))
            return *error = failed, error->status;
    }
    return phys_fitting_divide(s, usual, error) == AD_OK
               ? phys_fitting_minimise(s, here, &met, error)
               : error->status;
}

/* The best of several minima, and how many tries found it. */
static enum ad_status search(struct phys_fitting *s, struct phys_fitting_point p[3],
                             struct ad_error *error)
{
    struct phys_random random;
    const size_t tries = s->settings->tries ? s->settings->tries : TRIES;
    double best = INFINITY;
    struct ad_error cause = {0};
    phys_random_seed(&random, s->settings->seed + 1);
    phys_fitting_keep(s, &p[1]);
    for (size_t k = 0; k < tries && error->status == AD_OK; k++) {
        const size_t rows = phys_fitting_rows(s->settings), shorter[] = {rows, 2, rows / 4 + 2},
                     span[] = {1, 1, rows / 4 + 1}; /* noise of rates falls with it */
        struct ad_error failed = {0};
        phys_fitting_restore(s, &p[1]);
        if (k >= LENGTH(shorter) && !perturb(s, &random))
            continue;
        s->fit->tries++;
        s->span = span[k % LENGTH(span)];
        minimise_from(s, shorter[k % LENGTH(shorter)], &p[0], &failed);
        if (failed.status != AD_OK && phys_fitting_is_fatal(&failed))
            *error = failed;
        if (failed.status != AD_OK) {
            cause = cause.status == AD_OK ? failed : cause;
            continue;
        }
        const bool same = fabs(s->merit - best) <= 1e-6 * best + 1e-20 * (double)s->fit->measured;
        s->fit->agreeing = same ? s->fit->agreeing + 1 : s->merit < best ? 1 : s->fit->agreeing;
        if (s->merit < best) {
            best = s->merit;
            phys_fitting_keep(s, &p[2]);
        }
    }
    if (error->status == AD_OK && !isfinite(best))
        return ad_fail(error, cause.status ? cause.status : AD_E_ACCURACY, "%s", cause.message);
    phys_fitting_restore(s, &p[2]);
    return error->status;
}

static void store(const struct phys_fitting *s)
{
    struct phys_fit *fit = s->fit;
    for (size_t k = 0; k < fit->n_free; k++)
        fit->value[k] = phys_system_get(&s->system, s->settings->free[k]);
    for (size_t k = 0; k < s->n_stretches && !s->settings->fixed_start; k++)
        if (phys_fitting_begins_trial(s, k))
            memcpy(fit->value + fit->n_free + s->stretch[k].trial * s->d, s->begin + k * s->d,
                   s->d * sizeof *s->begin);
}

static enum ad_status solve(struct phys_fitting *s, const struct phys_system *first,
                            struct phys_fitting_point p[3], struct ad_error *error)
{
    bool met = false, still = false;
    if (search(s, p, error) != AD_OK)
        return error->status;
    for (int round = 0; round < ROUNDS && error->status == AD_OK && !(still && met); round++)
        if (phys_fitting_minimise(s, &p[0], &met, error) == AD_OK)
            phys_fitting_estimate(s, &still, error);
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
    phys_fitting_rms(s);
    if (error->status != AD_OK || phys_fitting_refuse(s, error) != AD_OK)
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
    struct phys_fitting_point p[3] = {{0}};
    if (AD_LACKS_RESULT(error, fit) ||
        AD_LACKS(error, system, system->scene, data, data->t, data->x, settings) ||
        (settings->n_free && AD_LACKS(error, settings->free)))
        return error->status;
    if (phys_refuse_constraints(system, "fits", error) != AD_OK)
        return error->status;
    AD_OWN(phys_fit_settings, settings, context, error);
    AD_OWN(phys_fit_data, data, x, error);
    if (phys_fit_prepare(system, data, settings, fit, error) == AD_OK &&
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
