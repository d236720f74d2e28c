/* The motion itself at the slices of a path, to all but the last digits (path.h). */
#include "path.h"
#include "physics/motion/motion.h"

#include <stdlib.h>

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
    return true;
}

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
                                       .n_samples = slices->n - 1,
                                       .sample = keep,
                                       .context = slices};
    if (error->status == AD_OK && phys_typical_sizes(ode, 0, y, scale, error) == AD_OK)
        phys_simulate(&settings, ode, y, &info, error);
    return error->status;
}

/* The scene's start, or, of a path from a file, its first slice and the velocity to the second. */
static enum ad_status depart(const struct path_run *run, double *q, double *v,
                             struct ad_error *error)
{
    size_t n = run->settings.slices;
    if (!path_from_file(run->options))
        return run->system.scene->start(run->system.params, run->options->common.seed, q, v, error);
    for (size_t k = 0; k < run->system.dof; k++) {
        q[k] = run->start[k * n];
        v[k] = (run->start[k * n + 1] - q[k]) / run->settings.dt;
    }
    return AD_OK;
}

enum ad_status path_motion(const struct path_run *run, size_t slices, double dt, double tolerance,
                           double *path, struct ad_error *error)
{
    const struct phys_system *system = &run->system;
    size_t dof = system->dof;
    struct phys_ode ode = {0};
    struct slices kept = {.path = path, .dof = dof, .n = slices};
    if (system->scene->between)
        return system->scene->between(system->params, slices, path, error);
    double *y = malloc(4 * dof * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (depart(run, y, y + dof, error) == AD_OK &&
        phys_ode_lagrangian(system, &ode, error) == AD_OK &&
        follow(&ode, y, y + 2 * dof, &kept, dt, tolerance, error) == AD_OK)
        for (size_t k = 0; k < dof; k++)
            path[k * slices + slices - 1] = y[k]; /* a step's end, no interpolation */
    phys_ode_free(&ode);
    free(y);
    return error->status;
}
