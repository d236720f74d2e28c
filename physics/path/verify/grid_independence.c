/* Checks that a stationary path belongs to the action rather than to the grid: the motion through
   its ends, integrated accurately (shooting.h), must exist near it. Coarse grids have spurious
   stationary paths, which pass a centre of attraction in one step, and finer grids may have them
   too. With many coordinates shooting is too expensive: the motion is integrated over each slice
   separately, and the defects are summed. */
#include "grid_independence.h"
#include "physics/motion/motion.h"
#include "physics/path/path_nodes.h"
#include "physics/path/shooting.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double NEAR = 0.05;       /* of the path's extent: by how much they may disagree */
static const double TOLERANCE = 1e-11; /* of the motion */
static const double ROUNDING = 1e-9;   /* relative to the path: a smaller extent counts as rest */
static const double SLICE_TOLERANCE = 1e-9; /* ... over one slice */

/* The summed defects of the motion from each slice to the next: of q relative to the path's extent,
   of v to its range of velocities; the larger one. Infinite if the motion is lost; *singular: where
   it changes too fast to be followed at all, no further away than the next slice. */
static double sum_defects(const struct phys_ode *ode, const struct phys_path_nodes *nodes,
                          double *room, bool *singular)
{
    size_t dof = nodes->dof, n = 2 * dof;
    double *y = room, *next = y + n, *low = next + n, *high = low + n, *scale = high + n;
    double range[2] = {0}, sum[2] = {0};
    struct ad_error lost = {0};
    struct phys_simulation_info info;
    struct phys_simulation run = {.size = sizeof run,
                                  .integrator = phys_integrator_find("dop853", &lost),
                                  .rtol = SLICE_TOLERANCE,
                                  .atol = SLICE_TOLERANCE,
                                  .scale = scale,
                                  .max_steps = 1000};
    for (size_t i = 0; i < nodes->slices; i++) {
        phys_path_nodes_at(nodes, nodes->time[i * nodes->degree], next, next + dof);
        for (size_t k = 0; k < n; k++) {
            low[k] = i ? fmin(low[k], next[k]) : next[k];
            high[k] = i ? fmax(high[k], next[k]) : next[k];
            range[k / dof] = fmax(range[k / dof], high[k] - low[k]);
        }
    }
    range[1] = fmax(range[1], range[0] / nodes->time[nodes->n - 1]);
    for (size_t k = 0; k < n; k++)
        scale[k] = range[k / dof] > ROUNDING * fabs(high[k]) ? range[k / dof] : 1;
    for (size_t i = 0; i < nodes->slices; i++) {
        double most[2] = {0};
        run.t0 = run.t1;
        run.t1 = nodes->time[i * nodes->degree];
        run.dt = run.t1 - run.t0;
        phys_path_nodes_at(nodes, run.t1, next, next + dof);
        if (i > 0 && phys_simulate(&run, ode, y, &info, &lost) != AD_OK) {
            double way = 0, step = 0; /* to there, and to the next slice */
            for (size_t k = 0; k < dof; k++) {
                const double q = nodes->x[k * nodes->n + (i - 1) * nodes->degree];
                way = fmax(way, fabs(y[k] - q) / scale[k]);
                step = fmax(step, fabs(next[k] - q) / scale[k]);
            }
            *singular = info.steps < run.max_steps && way <= step;
            return (double)INFINITY;
        }
        for (size_t k = 0; i > 0 && k < n; k++)
            most[k / dof] = fmax(most[k / dof], fabs(y[k] - next[k]));
        memcpy(y, next, n * sizeof *y);
        sum[0] += most[0];
        sum[1] += most[1];
    }
    return fmax(sum[0] / scale[0], sum[1] / scale[dof]);
}

static bool defects_are_small(const struct phys_system *system,
                              const struct phys_path_settings *settings, const double *path,
                              bool *singular, struct ad_error *error)
{
    struct phys_path_nodes nodes = {0};
    const struct phys_grid grid = phys_grid_of(settings);
    struct phys_ode ode = {0};
    double *room = malloc(10 * system->dof * sizeof *room);
    bool small = false;
    if (!room)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", system->dof);
    else if (phys_ode_lagrangian(system, &ode, error) == AD_OK &&
             phys_path_nodes_new(&nodes, system->dof, &grid, 3, path, error) == AD_OK)
        small = sum_defects(&ode, &nodes, room, singular) <= NEAR;
    phys_path_nodes_free(&nodes);
    phys_ode_free(&ode);
    free(room);
    return small;
}

enum ad_status phys_path_grid_independent(const struct phys_system *system,
                                          const struct phys_path_settings *settings,
                                          const double *path, bool *confirmed,
                                          struct ad_error *error)
{
    struct phys_shooting s;
    if (system->dof > PHYS_SHOOTING_DOF || system->scene->constraint) {
        *confirmed = defects_are_small(system, settings, path, &(bool){false}, error);
        return error->status;
    }
    *confirmed = phys_shooting_new(&s, system, settings, path, error) &&
                 phys_shooting_solve(&s, TOLERANCE) && phys_shooting_moved(&s) <= NEAR;
    phys_shooting_free(&s);
    return error->status;
}

enum ad_status phys_path_is_singular(const struct phys_system *system,
                                     const struct phys_path_settings *settings, const double *path,
                                     bool *singular, struct ad_error *error)
{
    *singular = false;
    defects_are_small(system, settings, path, singular, error);
    return error->status;
}
