/* The start of a motion, and whether a motion can begin there (solve.h). */
#include "solving.h"
#include "physics/lagrangian/constraints.h"

#include <string.h>

enum ad_status phys_motion_check_on_constraints(const struct phys_system *system, const double *q,
                                                const double *v, struct ad_error *error)
{
    phys_motion *motion;
    if (!system->scene->constraint || phys_motion_new(system, &motion, error) != AD_OK)
        return error->status;
    phys_motion_check_constraints(motion, "start", q, v, 0, error);
    phys_motion_free(motion);
    return error->status;
}

enum ad_status phys_motion_start(const struct phys_system *system, uint64_t seed, const double *q,
                                 const double *v, double *start, struct ad_error *error)
{
    size_t dof = system->dof;
    if (q)
        memcpy(start, q, dof * sizeof *start);
    else if (system->scene->start(system->params, seed, start, start + dof, error) != AD_OK)
        return error->status;
    if (v)
        memcpy(start + dof, v, dof * sizeof *start);
    return phys_motion_check_on_constraints(system, start, start + dof, error);
}

enum ad_status phys_motion_check_start(const struct phys_system *system, uint64_t seed,
                                       const double *q, const double *v, struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct ad_error cause = {0};
    if (AD_LACKS(error, system, system->scene))
        return error->status;
    size_t n = 2 * system->dof;
    double *start = calloc(3 * n, sizeof *start);
    if (!start)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *y = start + n;
    if (phys_motion_start(system, seed, q, v, start, error) == AD_OK &&
        phys_ode_lagrangian(system, &ode, error) == AD_OK &&
        phys_ode_enter(&ode, 0, start, start + system->dof, y, &cause) == AD_OK)
        ode.field(ode.context, 0, y, y + n, &cause);
    if (cause.status != AD_OK)
        ad_fail(error, cause.status == AD_E_NONFINITE ? AD_E_ARGUMENT : cause.status, "%s",
                cause.message);
    phys_ode_free(&ode);
    free(start);
    return error->status;
}
