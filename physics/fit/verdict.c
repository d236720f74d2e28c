/* Refuses a minimum that determines too little, or that does not follow the data. */
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Residuals larger than this share of the data's spread. */
static const double unlike = 0.5;

void phys_fit_name(const struct phys_system *system, const struct phys_fit_settings *settings,
                   const struct phys_fit *fit, size_t k, char *name, size_t size)
{
    char of[48];
    if (!name || !size)
        return;
    *name = 0;
    if (!system || !system->dof || !settings || !fit)
        return;
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
    if (fit->singular[fit->n_unknown - 1] > PHYS_FIT_INDISTINCT * fit->singular[0])
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
    bool changes = false;
    for (size_t i = 0; i < s->d; i++) {
        double n = 0, mean = 0, square = 0;
        for (size_t k = 0; k < s->data->n; k++)
            if (isfinite(s->data->x[k * s->d + i]) && !s->fit->held[k]) {
                const double x = s->data->x[k * s->d + i], off = x - mean;
                mean += off / ++n;
                square += off * (x - mean);
            }
        if (n > 0 && square > 0) {
            least = fmin(least, s->fit->rms[i] / sqrt(square / n));
            changes = true;
        }
    }
    if (!changes)
        return ad_fail(error, AD_E_ACCURACY,
                       "the data do not change: a motion at rest follows them, whatever the "
                       "parameters; expected a motion");
    return least < unlike ? AD_OK
                          : ad_fail(error, AD_E_ACCURACY,
                                    "the motion found does not follow the data: residuals are %.2g "
                                    "of their spread; expected less than %g; try other values to "
                                    "begin with",
                                    least, unlike);
}

enum ad_status phys_fitting_refuse(const struct phys_fitting *s, struct ad_error *error)
{
    return refuse_indistinct(s, error) == AD_OK ? refuse_unlike(s, error) : error->status;
}
