/* The motion itself at the slices of a path, to all but the last digits (path.h). */
#include "path.h"
#include "apps/interrupt.h"
#include "physics/motion/motion.h"

#include <stdlib.h>
#include <string.h>

struct slices {
    double *path; /* [dof x n] */
    size_t dof, n, i;
};

static bool keep(void *context, double t, const double *y)
{
    struct slices *s = context;
    (void)t;
    for (size_t k = 0; k < s->dof && s->i < s->n; k++)
        s->path[k * s->n + s->i] = y[k];
    s->i++;
    return !interrupted();
}

enum { STEPS = 50000 }; /* at most: what needs more has come to a collision */

/* y = (q, v) [2 dof]; scale is room for as much. */
static enum ad_status follow(const struct phys_ode *ode, double *y, double *scale,
                             struct slices *slices, double dt, double tolerance,
                             struct ad_error *error)
{
    struct phys_simulation_info info;
    double end = (double)(slices->n - 1) * dt;
    struct phys_simulation settings = {.integrator = phys_integrator_find("dop853", error),
                                       .t1 = end,
                                       .rtol = tolerance,
                                       .atol = tolerance,
                                       .scale = scale,
                                       .max_steps = STEPS,
                                       .n_samples = slices->n - 1,
                                       .sample = keep,
                                       .context = slices};
    if (error->status == AD_OK && phys_typical_sizes(ode, 0, y, scale, error) == AD_OK &&
        phys_simulate(&settings, ode, y, &info, error) == AD_OK &&
        info.stop == PHYS_SIMULATION_INTERRUPTED)
        ad_fail(error, AD_E_ARGUMENT, "interrupted");
    return error->status;
}

enum ad_status path_follow(const struct phys_system *system, const double *q, const double *v,
                           size_t slices, double dt, double tolerance, double *path,
                           struct ad_error *error)
{
    size_t dof = system->dof;
    struct phys_ode ode = {0};
    struct slices kept = {.path = path, .dof = dof, .n = slices};
    double *y = malloc(4 * dof * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(y, q, dof * sizeof *y);
    memcpy(y + dof, v, dof * sizeof *y);
    if (phys_ode_lagrangian(system, &ode, error) == AD_OK &&
        follow(&ode, y, y + 2 * dof, &kept, dt, tolerance, error) == AD_OK)
        for (size_t k = 0; k < dof; k++)
            path[k * slices + slices - 1] = y[k]; /* a step's end, no interpolation */
    phys_ode_free(&ode);
    free(y);
    return error->status;
}

enum ad_status path_motion(const struct path_run *run, size_t slices, double dt, double tolerance,
                           double *path, struct ad_error *error)
{
    const struct phys_system *system = &run->system;
    size_t dof = system->dof;
    if (system->scene->between)
        return system->scene->between(system->params, slices, path, error);
    double *q = malloc(2 * dof * sizeof *q);
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (system->scene->start(system->params, run->options->common.seed, q, q + dof, error) == AD_OK)
        path_follow(system, q, q + dof, slices, dt, tolerance, path, error);
    free(q);
    return error->status;
}
