/* What a path is held against, none of it of its own making (path.h): the motion from its start by
   an adaptive method, the path between its ends by a rule of higher order, and the stationary path
   at the reference. */
#include "path.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double tight = 1e-13, loose = 1e-12; /* of the motion, and to check it */
static const double known = 0.1;                  /* of a distance: what the motion may be off by */
static const double same = 1e-6;  /* of the extent: two stationary paths of one grid are one */
static const double apart = 10;   /* errors of discretisation: a motion further away is another */
static const double clear = 1e-3; /* of the extent: and as far at the least */
static const double near = 0.3;   /* of the extent: a finer path further away is another one */
enum { DEGREE = 4, MOST = 160 };  /* of the finer rule, at least; coordinates in one element */

static double largest(const double *a, const double *b, size_t n)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        if (!(fabs(a[k] - b[k]) <= most)) /* NaN, too */
            most = fabs(a[k] - b[k]);
    return most;
}

static double extent(const double *path, size_t dof, size_t slices)
{
    double most = 0;
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < slices; i++)
            most = fmax(most, fabs(path[k * slices + i] - path[k * slices]));
    return most;
}

/* ---- the true motion ---- */

/* Rules of first order read the velocity of the start off the first two slices; others have a
   momentum there that is as good as the path. */
static enum ad_status own_start(const struct path_run *run, double *q, double *v,
                                struct ad_error *error)
{
    size_t n = run->settings.slices, dof = run->system.dof;
    phys_legendre *legendre = NULL;
    for (size_t k = 0; k < dof; k++) {
        q[k] = run->path[k * n];
        v[k] = (run->path[k * n + 1] - q[k]) / run->settings.dt;
    }
    if (run->settings.rule->order > 1 && phys_legendre_new(&run->system, &legendre, error) == AD_OK)
        phys_legendre_velocity(legendre, q, run->momentum, 0, v, error);
    phys_legendre_free(legendre);
    return error->status;
}

static enum ad_status true_motion(const struct path_run *run, struct path_result *result,
                                  struct ad_error *error)
{
    struct ad_error lost = {0};
    const struct phys_system *system = &run->system;
    size_t n = run->settings.slices, dof = system->dof;
    double dt = run->settings.dt;
    result->true_distance = result->true_known = NAN;
    if (system->scene->between)
        return AD_OK; /* no initial-value problem: the closed form is the reference */
    double *q = malloc((2 * dof + 2 * n * dof) * sizeof *q), *v = q ? q + dof : NULL;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct phys_simulation tightly = path_tightly(tight), loosely = path_tightly(loose);
    double *motion = v + dof, *check = motion + n * dof;
    if (own_start(run, q, v, &lost) == AD_OK &&
        phys_motion_path(system, &tightly, q, v, n, dt, motion, &lost) == AD_OK &&
        phys_motion_path(system, &loosely, q, v, n, dt, check, &lost) == AD_OK) {
        result->true_distance = largest(run->path, motion, n * dof);
        result->true_known = largest(motion, check, n * dof);
        if (result->true_known >
            fmax(known * result->true_distance, same * extent(motion, dof, n))) {
            snprintf(lost.message, sizeof lost.message,
                     "small differences grow on it: it is known to %.2g alone", result->true_known);
            result->true_distance = NAN;
        }
    }
    snprintf(result->no_motion, sizeof result->no_motion, "%.150s", lost.message);
    free(q);
    if (lost.status == AD_E_MEMORY)
        ad_fail(error, lost.status, "%s", lost.message);
    return error->status;
}

/* ---- other stationary paths ---- */

/* The run's own method, Newton's, from `path`, in place; whether it arrives. */
static bool settle(const struct path_run *run, struct phys_path_settings settings, double *path)
{
    struct phys_path_info info = {0};
    struct ad_error lost = {0};
    settings.adam_steps = 0;
    settings.tolerance = 0;
    settings.progress = NULL;
    settings.compare = settings.reference = NULL;
    settings.start_momentum = NULL;
    return phys_path_solve(run->solver, &run->system, &settings, path, &info, &lost) == AD_OK &&
           info.stop == PHYS_STOP_ROUNDING;
}

/* Whether the reference is, or leads on the same grid to, another stationary path. */
static enum ad_status compare_reference(const struct path_run *run, struct path_result *result,
                                        struct ad_error *error)
{
    const struct phys_path_settings *settings = &run->settings;
    size_t n = settings->slices, dof = run->system.dof, size = settings->rule->degree * dof * n;
    double *path = malloc(size * sizeof *path);
    if (!path)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(path, run->reference, size * sizeof *path);
    for (size_t k = 0; k < dof; k++) { /* between the same ends */
        path[k * n] = run->path[k * n];
        path[k * n + n - 1] = run->path[k * n + n - 1];
    }
    double wide = extent(run->path, dof, n);
    result->another =
        settle(run, *settings, path) && largest(path, run->path, n * dof) > same * wide;
    if (run->reference_true && largest(run->reference, run->path, n * dof) >
                                   fmax(apart * result->discretisation, clear * wide))
        result->another = result->another || !isnan(result->discretisation);
    free(path);
    return AD_OK;
}

/* The path of a rule of higher order on the same slices. */
static enum ad_status refine(const struct path_run *run, struct path_result *result,
                             struct ad_error *error)
{
    struct phys_path_settings finer = run->settings;
    size_t n = finer.slices, dof = run->system.dof, degree = finer.rule->degree + 2;
    char name[24];
    degree = degree < DEGREE ? DEGREE : degree;
    if (finer.rule->repeat || degree > PHYS_RULE_MOST || degree * dof > MOST)
        return AD_OK;
    snprintf(name, sizeof name, "gauss%zu", degree);
    finer.rule = phys_rule_find(name, error);
    const struct phys_grid from = {run->settings.rule, n, finer.dt}, to = {finer.rule, n, finer.dt};
    double *path = phys_path_resample(&from, run->path, &to, dof, error);
    if (path && settle(run, finer, path)) {
        double distance = largest(path, run->path, n * dof);
        if (distance <= near * extent(path, dof, n))
            result->discretisation = distance;
    }
    free(path);
    return error->status;
}

enum ad_status path_distances(const struct path_run *run, struct path_result *result,
                              struct ad_error *error)
{
    result->discretisation = NAN;
    if (true_motion(run, result, error) != AD_OK || !result->stationary ||
        refine(run, result, error) != AD_OK)
        return error->status;
    return run->reference ? compare_reference(run, result, error) : AD_OK;
}
