/* Stationary paths with free end time: dS/dT = -E, so these have energy zero; more generally, the
   path of given energy between two ends, and its duration. Secant method on the logarithm of the
   time; each trial is a Newton solution started from the one before. */
#include "newton.h"
#include "physics/lagrangian/conserved.h"

#include <float.h>
#include <math.h>

enum { TRIALS = 60 };

static const double MOST_CHANGE = 0.5; /* of the logarithm of time at once */
static const double MET = 1e-8;        /* of the energies: excess that is left */
static const double SMALL = 1e-10;     /* change of it, that rounding may keep from falling */

bool phys_lacks_energy(const struct phys_system *system, struct ad_error *error)
{
    if (!phys_keeps_energy(system, error))
        ad_fail(error, AD_E_ARGUMENT,
                "%s: L depends on time explicitly, expected one that does not: its paths of free "
                "end time have no one energy",
                system->scene->name);
    return error->status != AD_OK;
}

/* What rounding of energies is relative to. */
static double energy_size(const struct phys_system *system, double energy,
                          const struct phys_path_info *info)
{
    double bodies = system->scene->per_body ? (double)system->bodies : 1;
    return fabs(energy) + bodies * (fabs(info->kinetic_mean) + fabs(info->potential_mean));
}

/* Energy above that wanted, of the path that takes exp(log_dt) a slice. */
static enum ad_status excess(const struct phys_system *system, struct phys_path_settings *settings,
                             struct phys_derivatives *of, double log_dt, double energy,
                             double *path, struct phys_path_info *info, double *found,
                             struct ad_error *error)
{
    settings->dt = exp(log_dt);
    if (phys_newton_over(system, settings, of, false, path, info, error) != AD_OK)
        return error->status;
    *found = info->energy_mean - energy;
    return AD_OK;
}

enum ad_status phys_newton_free_time(const struct phys_system *system,
                                     struct phys_path_settings *settings,
                                     struct phys_derivatives *of, double energy, double *path,
                                     struct phys_path_info *info, struct ad_error *error)
{
    double at = log(settings->dt), last = at + 0.01, step_before = (double)INFINITY;
    double here = (double)NAN, before = (double)NAN;
    struct phys_path_settings inner = *settings;
    inner.progress = NULL;
    inner.tolerance = 0;
    inner.compare = NULL;
    if (excess(system, &inner, of, last, energy, path, info, &before, error) != AD_OK)
        return error->status;
    inner.adam_steps = 0;
    for (int trial = 0; trial < TRIALS; trial++) {
        if (excess(system, &inner, of, at, energy, path, info, &here, error) != AD_OK)
            return error->status;
        settings->dt = inner.dt;
        double step = here == before ? 0 : -here * (at - last) / (here - before);
        bool rounding = fabs(step) < SMALL && fabs(step) >= 0.5 * fabs(step_before);
        if (info->stop == PHYS_STOP_INTERRUPTED)
            return AD_OK;
        if (info->stop == PHYS_STOP_ROUNDING &&
            fabs(here) <= MET * energy_size(system, energy, info) &&
            (rounding || fabs(step) <= 4 * DBL_EPSILON * fmax(1, fabs(at))))
            return AD_OK;
        step_before = step;
        last = at;
        before = here;
        at += fmax(-MOST_CHANGE, fmin(MOST_CHANGE, step));
    }
    return ad_fail(error, AD_E_ACCURACY,
                   "no time for which the path has energy %g: %g per slice leaves an excess of %g; "
                   "try more slices, more --adam-steps before, or another --dt",
                   energy, settings->dt, before);
}

enum ad_status phys_path_free_time(const struct phys_system *system,
                                   struct phys_path_settings *settings, double energy, double *path,
                                   struct phys_path_info *info, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, settings, path, info, settings->rule))
        return error->status;
    const struct phys_path_settings *given = settings;
    PHYS_OWN_PATH(given, error);
    struct phys_path_settings found = *given;
    struct phys_derivatives of = {0};
    if (!phys_lacks_energy(system, error) &&
        phys_derivatives_new(&of, system, PHYS_LADDER_COLUMNS, NULL, error) == AD_OK &&
        phys_newton_free_time(system, &found, &of, energy, path, info, error) == AD_OK &&
        info->stop != PHYS_STOP_INTERRUPTED) {
        found.progress = NULL;
        found.adam_steps = 0;
        phys_path_solve(&phys_solver_newton, system, &found, path, info, error);
    }
    settings->dt = found.dt;
    phys_derivatives_free(&of);
    return error->status;
}
