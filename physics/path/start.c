/* Initial and reference paths (path.h). */
#include "internal.h"
#include "physics/lagrangian/internal.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double LOST = 10; /* allowed distance of the grid's motion, in extents of the motion */

void phys_path_line(size_t dof, size_t slices, const double *between, double *path)
{
    if (!between || !path)
        return;
    for (size_t k = 0; k < dof; k++) {
        double first = between[k * slices], last = between[k * slices + slices - 1];
        for (size_t i = 0; i < slices; i++) {
            double share = (double)i / (double)(slices - 1);
            path[k * slices + i] = (1 - share) * first + share * last;
        }
    }
}

void phys_path_bend(size_t dof, size_t slices, const double *between, double *path)
{
    if (!between || !path)
        return;
    for (size_t k = 0; k < dof; k++) {
        double *x = path + k * slices;
        double first = between[k * slices] - x[0];
        double last = between[k * slices + slices - 1] - x[slices - 1];
        for (size_t i = 0; i < slices; i++) {
            double share = (double)i / (double)(slices - 1);
            x[i] += (1 - share) * first + share * last;
        }
        x[0] = between[k * slices];
        x[slices - 1] = between[k * slices + slices - 1];
    }
}

/* Whether the motion of a grid is further from the true one than that is wide. */
static bool is_lost(size_t dof, size_t slices, const double *grid, const double *motion)
{
    double width = 0, distance = 0;
    for (size_t k = 0; k < dof * slices; k++) {
        width = fmax(width, fabs(motion[k] - motion[k / slices * slices]));
        if (!(fabs(grid[k] - motion[k]) <= distance)) /* NaN, too */
            distance = fabs(grid[k] - motion[k]);
    }
    return !(distance <= LOST * width);
}

/* The motion of rule left from q, q + v dt. Where momenta are plain the published equations are its
   equations. A scene of the paper has the published motion in any case. */
static enum ad_status left_motion(const struct phys_system *system,
                                  const struct phys_path_settings *settings, uint64_t seed,
                                  double *path, enum phys_motion_of *which, struct ad_error *error)
{
    struct phys_path_settings left = *settings;
    phys_motion *motion = NULL;
    double *q = malloc(2 * system->dof * sizeof *q), *v = q ? q + system->dof : NULL;
    left.rule = &phys_rule_left;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_motion_new(system, &motion, error) == AD_OK &&
        system->scene->start(system->params, seed, q, v, error) == AD_OK &&
        phys_first_slices(motion, q, v, left.slices, left.dt, true, path, error) == AD_OK) {
        bool plain = phys_motion_has_plain_momenta(motion, error), paper = system->scene->paper;
        *which = plain || !paper ? PHYS_PATH_GRID : PHYS_PATH_PUBLISHED;
        if (error->status == AD_OK && (plain || paper))
            phys_ode_path(motion, left.slices, left.dt, 1, path, error);
        else if (error->status == AD_OK)
            phys_path_march(system, &left, path, error);
    }
    phys_motion_free(motion);
    free(q);
    return error->status;
}

enum ad_status phys_path_motion(const struct phys_system *system,
                                const struct phys_path_settings *settings,
                                const struct phys_preset *preset, uint64_t seed, double *path,
                                enum phys_motion_of *which, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, settings, settings->rule, path, which))
        return error->status;
    PHYS_OWN_PATH(settings, error);
    const struct phys_simulation tightly = {.size = sizeof tightly,
                                            .rtol = 1e-13,
                                            .max_steps = PHYS_MOTION_STEPS,
                                            .proceed = settings->proceed,
                                            .ode = settings->ode,
                                            .context = settings->context};
    struct ad_error lost = {0}, none = {0};
    size_t n = settings->slices;
    bool closed = system->scene->between != NULL;
    *which = closed ? PHYS_PATH_CLOSED : PHYS_PATH_TRUE;
    if (closed || system->scene->constraint || strncmp(settings->rule->name, "left", 4) != 0)
        return phys_scene_path(system, seed, &tightly, n, settings->dt, path, error);
    if (preset) { /* as published, whatever it is */
        *which = PHYS_PATH_PUBLISHED;
        return phys_published_path(system, seed, n, settings->dt, preset->euler_start,
                                   preset->damping, NULL, path, error);
    }
    double *grid = malloc(system->dof * n * sizeof *grid);
    if (!grid)
        return ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
    phys_scene_path(system, seed, &tightly, n, settings->dt, path, &lost);
    if (left_motion(system, settings, seed, grid, which, &none) == AD_OK &&
        (lost.status != AD_OK || !is_lost(system->dof, n, grid, path))) {
        memcpy(path, grid, system->dof * n * sizeof *path);
    } else if (lost.status != AD_OK) {
        ad_fail(error, lost.status, "%s", lost.message);
    } else {
        *which = PHYS_PATH_LOST;
    }
    free(grid);
    return error->status;
}
