/* How far a path is from the motion from its own start, by an adaptive method (find.h). */
#include "find.h"
#include "physics/path/path_nodes.h"
#include "physics/motion/method.h"
#include "physics/motion/time_scan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double TIGHT = 1e-13, LOOSE = 1e-12; /* of the motion, and to check it */
static const double KNOWN = 0.1; /* relative error allowed for the motion, of a distance */

/* Rules of first order read the velocity of the start off the first two slices; others have a
   momentum there that is as good as the path. */
static enum ad_status own_start(const struct phys_search *s, double *q, double *v,
                                struct ad_error *error)
{
    phys_legendre *legendre = NULL;
    const struct phys_grid grid = phys_grid_of(s->settings);
    for (size_t k = 0; k < s->dof; k++) {
        q[k] = s->path[k * s->slices];
        v[k] = (s->path[k * s->slices + 1] - q[k]) / phys_grid_time(&grid, 1);
    }
    if (s->settings->rule->order > 1 && phys_legendre_new(s->system, &legendre, error) == AD_OK)
        phys_legendre_velocity(legendre, q, s->settings->start_momentum, 0, v, error);
    phys_legendre_free(legendre);
    return error->status == AD_OK ? phys_surface_velocity(s->system, q, 0, v, error)
                                  : error->status;
}

/* From the start (q, v) to path [dof x slices], which ends in y [2 dof]. Steps end where the forces
   change abruptly with time; room `times` [(1 + dof) x (slices + scan->n)]. */
static enum ad_status follow(const struct phys_search *s, const struct phys_ode *ode,
                             const struct phys_time_scan *scan, double rtol, const double *q,
                             double *path, double *y, double *times, struct ad_error *error)
{
    const struct phys_path_settings *settings = s->settings;
    const struct phys_grid grid = phys_grid_of(settings);
    double *wide = times + s->slices + scan->n;
    size_t n = 0;
    for (size_t i = 0, k = 0; i < s->slices; i++) {
        const double t = phys_grid_time(&grid, i);
        for (; k < scan->n && scan->times[k] < t; k++)
            if (n > 0 && scan->times[k] > times[n - 1])
                times[n++] = scan->times[k];
        times[n++] = t;
    }
    if (phys_ode_enter(ode, 0, q, q + s->dof, y, error) != AD_OK)
        return error->status;
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_motion_method(ode, y, error),
                                        .t1 = (double)(s->slices - 1) * settings->dt,
                                        .n_samples = n - 1,
                                        .times = settings->mesh || scan->n ? times + 1 : NULL,
                                        .land = scan->n > 0,
                                        .rtol = rtol,
                                        .max_steps = PHYS_MOTION_STEPS,
                                        .proceed = settings->proceed,
                                        .context = settings->context};
    if (how.integrator)
        phys_trajectory(&how, ode, y, s->dof, n, wide, NULL, error);
    for (size_t i = 0, k = 0; i < s->slices; i++, k++) {
        while (times[k] != phys_grid_time(&grid, i))
            k++;
        for (size_t d = 0; d < s->dof && error->status == AD_OK; d++)
            path[d * s->slices + i] = wide[d * n + k];
    }
    return error->status;
}

/* Constraints take up momentum. */
static void project_end(const struct phys_search *s, size_t end, const double *q, double *p)
{
    if (s->newton && s->newton->path.surface)
        phys_surface_project_end(s->newton->path.surface, end, q, p);
}

/* What is left of the momenta that free ends have none of, on the motion from (q, v) that ends in
   y; `room` [4 dof] begins with q and v. */
static void measure_momentum(const struct phys_search *s, const struct phys_ode *ode,
                             const double *y, double *room, struct ad_error *error)
{
    const struct phys_ends *ends = s->settings->ends;
    const size_t dof = s->dof;
    double T = (double)(s->slices - 1) * s->settings->dt, *q = room, *v = q + dof, *p = v + dof;
    struct phys_end_space space = {0};
    phys_legendre *legendre = NULL;
    struct ad_error none = {0};
    if (ends && ends->free[1] && phys_end_space_new(&space, ends, dof, &none) == AD_OK &&
        phys_legendre_new(s->system, &legendre, &none) == AD_OK) {
        phys_legendre_momentum(legendre, q, v, 0, p, NULL);
        for (size_t k = 0; k < dof; k++)
            p[k] = -p[k];
        project_end(s, 0, q, p);
        if (phys_ode_leave(ode, T, y, q, v, &none) == AD_OK) {
            phys_legendre_momentum(legendre, q, v, T, p + dof, NULL);
            project_end(s, 1, q, p + dof);
            phys_end_space_project(&space, NULL, p);
            s->found->free_momentum = 0;
            for (size_t k = 0; k < 2 * dof; k++)
                s->found->free_momentum = fmax(s->found->free_momentum, fabs(p[k]));
        }
    }
    phys_legendre_free(legendre);
    phys_end_space_free(&space);
    phys_keep_memory(&none, error);
}

/* When the forces change at the start's place, and where the path is by then: what travels meets it
   at another time. */
static enum ad_status scan_times(const struct phys_search *s, const double *q, const double *v,
                                 struct phys_time_scan *scan, struct ad_error *error)
{
    enum { TIMES = 1000 };
    const struct phys_grid grid = phys_grid_of(s->settings);
    const double T = phys_grid_time(&grid, s->slices - 1);
    struct phys_path_nodes nodes = {0};
    if (phys_time_scan(s->system, q, v, 0, T, scan, error) != AD_OK || !scan->times)
        return error->status;
    double *t = malloc((TIMES + 1) * (1 + 2 * s->dof) * sizeof *t);
    double *x = t ? t + TIMES + 1 : NULL, *at = t ? x + 2 * s->dof * TIMES : NULL;
    if (!t)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_path_nodes_new(&nodes, s->dof, &grid, 3, s->path, error) == AD_OK) {
        for (size_t i = 0; i < TIMES; i++) {
            t[i] = T * (double)i / (TIMES - 1);
            phys_path_nodes_at(&nodes, t[i], at, at + s->dof);
            for (size_t k = 0; k < 2 * s->dof; k++)
                x[k * TIMES + i] = at[k];
        }
        phys_time_scan_along(s->system, TIMES, t, x, scan, error);
    }
    phys_path_nodes_free(&nodes);
    free(t);
    return error->status;
}

enum ad_status phys_search_motion(const struct phys_search *s, struct ad_error *error)
{
    struct phys_path_found *found = s->found;
    struct phys_ode own = {0};
    const struct phys_ode *ode = s->settings->ode ? s->settings->ode : &own;
    struct ad_error lost = {0};
    size_t n = s->slices * s->dof;
    if (s->system->scene->between)
        return AD_OK; /* no initial-value problem: the closed form is the reference */
    double *q = malloc((7 * s->dof + 2 * n) * sizeof *q), *v = q ? q + s->dof : NULL, *times = NULL;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *motion = v + s->dof, *check = motion + n, *y = check + n;
    struct phys_time_scan scan = {0};
    if (own_start(s, q, v, &lost) == AD_OK && scan_times(s, q, v, &scan, &lost) == AD_OK) {
        times = malloc((1 + s->dof) * (s->slices + scan.n) * sizeof *times);
        if (!times)
            ad_fail(&lost, AD_E_MEMORY, "out of memory");
    }
    if (lost.status == AD_OK &&
        (ode != &own || phys_ode_lagrangian(s->system, &own, &lost) == AD_OK) &&
        follow(s, ode, &scan, LOOSE, q, check, y, times, &lost) == AD_OK &&
        follow(s, ode, &scan, TIGHT, q, motion, y, times, &lost) == AD_OK) {
        found->true_distance = phys_search_apart(s, s->path, motion);
        found->true_known = phys_search_apart(s, motion, check);
        if (found->true_known >
            fmax(KNOWN * found->true_distance, PHYS_SEARCH_SAME * phys_search_extent(s, motion))) {
            snprintf(lost.message, sizeof lost.message, "it is unstable and known to %.2g only",
                     found->true_known);
            found->true_distance = NAN;
        } else {
            measure_momentum(s, ode, y, q, &lost);
        }
    }
    snprintf(found->no_motion, sizeof found->no_motion, "%.150s", lost.message);
    phys_ode_free(&own);
    phys_time_scan_free(&scan);
    free(times);
    free(q);
    return phys_keep_memory(&lost, error);
}
