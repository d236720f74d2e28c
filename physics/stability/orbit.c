/* Motions over a period (internal.h). */
#include "internal.h"
#include "physics/lagrangian/internal.h"

#include <stdlib.h>

enum ad_status phys_orbit_follow(const struct phys_orbit *orbit, const struct phys_ode *ode,
                                 const char *method, const double *x, double from, double to,
                                 double *y, struct ad_error *error)
{
    const size_t d = orbit->d;
    struct phys_simulation_info info;
    struct phys_simulation how =
        phys_simulation_of(phys_integrator_find(method, error), orbit->tolerance, to);
    double *scale = malloc(ode->n * sizeof *scale);
    if (!scale)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < ode->n; k++) {
        scale[k] = orbit->size[k % d] / (k < d ? 1 : orbit->size[k / d - 1]);
        y[k] = k < d ? x[k] : (k / d - 1 == k % d);
    }
    how.t0 = from;
    how.scale = scale;
    how.proceed = orbit->proceed;
    how.context = orbit->context;
    if (phys_simulate(&how, ode, y, &info, error) == AD_OK && info.stop != PHYS_SIMULATION_END)
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    free(scale);
    return error->status;
}

bool phys_orbit_is_timeless(const struct phys_system *system, struct ad_error *error)
{
    phys_motion *motion = NULL;
    ad_var x[3], y[2];
    bool timeless = phys_keeps_energy(system, error);
    if (!timeless && error->status == AD_OK && phys_system_has_forces(system) &&
        phys_motion_new(system, &motion, error) == AD_OK) {
        phys_motion_recorded(motion, x, y);
        timeless = phys_is_independent(x[0].tape, y[0], 1, &x[2], error) &&
                   phys_is_independent(x[0].tape, y[1], 1, &x[2], error);
    }
    phys_motion_free(motion);
    return timeless;
}
