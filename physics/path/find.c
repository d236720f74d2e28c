/* Finds a path and verifies it (path.h): its kind of stationary point, and its distances from
   independent results: the motion from its start by an adaptive method, the path of a rule of
   higher order, and the stationary path at the given reference. */
#include "autodiff/free.h"
#include "grid_independence.h"
#include "newton.h"
#include "path_nodes.h"
#include "path_units.h"
#include "physics/lagrangian/conserved.h"
#include "physics/motion/method.h"
#include "physics/motion/time_scan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double STATIONARY =
    1e-6; /* a tolerance of the gradient that asks for more: no verdict */
static const double TIGHT = 1e-13, LOOSE = 1e-12; /* of the motion, and to check it */
static const double KNOWN = 0.1;  /* relative error allowed for the motion, of a distance */
static const double SMALL = 1e-6; /* of a start's gradient */
static const double SAME = 1e-6;  /* of the extent: two stationary paths of one grid are one */
static const double AGREE = 1e-9; /* of the extent: and they are to that */
static const double APART = 10;   /* errors of discretisation: a motion further away is another */
static const double CLEAR = 1e-3; /* of the extent: and as far at the least */

struct search {
    const struct phys_system *system;
    const struct phys_path_settings *settings;
    const double *path;
    struct phys_newton *newton;   /* that found it; NULL: another solver did */
    struct phys_refined *refined; /* whose path it is; or NULL */
    struct phys_path_found *found;
    double *unit; /* [dof] (path_units.h) */
    size_t dof, slices;
};

static double apart(const struct search *s, const double *a, const double *b)
{
    return phys_path_apart(s->unit, a, b, s->dof, s->slices);
}

static double extent(const struct search *s, const double *path)
{
    return phys_path_extent(s->unit, path, s->dof, s->slices);
}

/* ---- its kind ---- */

/* Interrupted: the path is found, and not its kind. */
static enum ad_status give_up(struct search *s)
{
    s->found->info.stop = PHYS_STOP_INTERRUPTED;
    s->found->stationary = false;
    return AD_OK;
}

static enum ad_status find_kind(struct search *s, struct ad_error *error)
{
    struct phys_spectrum *spectrum = &s->found->spectrum;
    enum phys_stop stop = s->found->info.stop;
    s->found->stationary =
        s->newton && (stop == PHYS_STOP_ROUNDING ||
                      (stop == PHYS_STOP_TOLERANCE && s->settings->tolerance <= STATIONARY));
    struct ad_error lost = {0};
    if (!s->found->stationary)
        return AD_OK;
    if (s->refined) {
        *spectrum = s->refined->spectrum;
        s->refined->spectrum = (struct phys_spectrum){0};
    }
    if (phys_newton_spectrum(s->newton, PHYS_EIGENVALUES | (s->refined ? 0 : PHYS_KIND), s->path,
                             spectrum, &lost) == AD_E_ACCURACY)
        return give_up(s);
    if (lost.status != AD_OK)
        return ad_fail(error, lost.status, "%s", lost.message);
    if (!phys_free_ends(s->settings) && !s->system->scene->constraint &&
        (spectrum->n_conjugate > 0 || spectrum->legendre == PHYS_INDEFINITE))
        phys_path_conjugate(s->system, s->settings, s->path, spectrum, error);
    return error->status;
}

/* ---- the true motion ---- */

/* Rules of first order read the velocity of the start off the first two slices; others have a
   momentum there that is as good as the path. */
static enum ad_status own_start(const struct search *s, double *q, double *v,
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
static enum ad_status follow(const struct search *s, const struct phys_ode *ode,
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
static void project_end(const struct search *s, size_t end, const double *q, double *p)
{
    if (s->newton && s->newton->path.surface)
        phys_surface_project_end(s->newton->path.surface, end, q, p);
}

/* What is left of the momenta that free ends have none of, on the motion from (q, v) that ends in
   y; `room` [4 dof] begins with q and v. */
static void measure_momentum(const struct search *s, const struct phys_ode *ode, const double *y,
                             double *room, struct ad_error *error)
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
static enum ad_status scan_times(const struct search *s, const double *q, const double *v,
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

static enum ad_status compare_motion(const struct search *s, struct ad_error *error)
{
    struct phys_path_found *found = s->found;
    struct phys_ode ode = {0};
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
    if (lost.status == AD_OK && phys_ode_lagrangian(s->system, &ode, &lost) == AD_OK &&
        follow(s, &ode, &scan, LOOSE, q, check, y, times, &lost) == AD_OK &&
        follow(s, &ode, &scan, TIGHT, q, motion, y, times, &lost) == AD_OK) {
        found->true_distance = apart(s, s->path, motion);
        found->true_known = apart(s, motion, check);
        if (found->true_known > fmax(KNOWN * found->true_distance, SAME * extent(s, motion))) {
            snprintf(lost.message, sizeof lost.message, "it is unstable and known to %.2g only",
                     found->true_known);
            found->true_distance = NAN;
        } else {
            measure_momentum(s, &ode, y, q, &lost);
        }
    }
    snprintf(found->no_motion, sizeof found->no_motion, "%.150s", lost.message);
    phys_ode_free(&ode);
    phys_time_scan_free(&scan);
    free(times);
    free(q);
    return phys_keep_memory(&lost, error);
}

/* ---- other stationary paths ---- */

/* Whether settings->compare is, or leads on the same grid to, another stationary path. A true
   motion that is clearly apart is one. */
static enum ad_status compare_given(const struct search *s, struct ad_error *error)
{
    const struct phys_path_settings *settings = s->settings;
    size_t n = s->slices, dof = s->dof, size = settings->rule->degree * dof * n;
    struct phys_path_info info;
    double wide = extent(s, s->path);
    s->found->another =
        settings->compare_true && !isnan(s->found->discretisation) &&
        s->found->reference_distance > fmax(APART * s->found->discretisation, CLEAR * wide);
    if (s->found->another)
        return AD_OK;
    double *path = malloc(size * sizeof *path);
    if (!path)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(path, settings->compare, size * sizeof *path);
    for (size_t k = 0; k < dof; k++) { /* between the same ends */
        path[k * n] = s->path[k * n];
        path[k * n + n - 1] = s->path[k * n + n - 1];
    }
    s->found->another =
        phys_newton_settle(s->newton, path, &info, error) && apart(s, path, s->path) > SAME * wide;
    free(path);
    return error->status;
}

/* ---- all of it ---- */

/* Whether the path is the one that was refined, on the same grid. */
static bool is_refined(const struct search *s, const struct phys_refined *refined)
{
    const struct phys_path_settings *own = s->settings, *theirs = refined->settings;
    return refined->path && own->rule == theirs->rule && own->slices == theirs->slices &&
           own->dt == theirs->dt && apart(s, s->path, refined->path) <= AGREE * extent(s, s->path);
}

/* NULL where they are not known. */
static enum ad_status find_forces(struct search *s, struct ad_error *error)
{
    struct phys_path_found *found = s->found;
    struct ad_error lost = {0};
    if (!s->system->scene->constraint || !found->stationary)
        return AD_OK;
    if (!(found->force = malloc(s->dof * s->slices * sizeof *found->force)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_surface_forces(s->system, &s->newton->hessian, s->path, found->force, &lost) !=
        AD_OK) {
        free(found->force);
        found->force = NULL;
    }
    return phys_keep_memory(&lost, error);
}

static bool has_its_ends(const struct search *s, const double *path)
{
    bool has = true;
    for (size_t k = 0; k < s->dof; k++)
        for (size_t i = 0; i < s->slices; i += s->slices - 1)
            has = has && path[k * s->slices + i] == s->path[k * s->slices + i];
    return has;
}

/* Where the motion is lost, and the solver ended by itself or where the gradient is small. */
static enum ad_status find_singular(struct search *s, struct ad_error *error)
{
    struct phys_path_found *found = s->found;
    struct ad_error lost = {0};
    const enum phys_stop stop = found->info.stop;
    const bool ended = stop == PHYS_STOP_TOLERANCE || stop == PHYS_STOP_ROUNDING ||
                       (stop == PHYS_STOP_STALLED && !s->newton) ||
                       found->info.grad_norm <= SMALL * found->info.start.grad_norm;
    if (!*found->no_motion || s->system->scene->constraint || !ended)
        return AD_OK;
    phys_path_is_singular(s->system, s->settings, s->path, &found->singular, &lost);
    return phys_keep_memory(&lost, error);
}

static enum ad_status measure(struct search *s, struct ad_error *error)
{
    const double *compare = s->settings->compare;
    struct phys_path_found *found = s->found;
    found->keeps_energy = phys_keeps_energy(s->system, error);
    if (compare)
        found->reference_distance = apart(s, s->path, compare);
    if (find_kind(s, error) != AD_OK || find_forces(s, error) != AD_OK ||
        compare_motion(s, error) != AD_OK || find_singular(s, error) != AD_OK || !found->stationary)
        return error->status;
    bool rounding = found->spectrum.undetermined;
    struct ad_error lost = {0};
    if (s->refined)
        found->discretisation = s->refined->finer;
    else if (phys_path_discretisation(s->system, s->settings, NULL, s->path, false,
                                      &found->discretisation, &found->spectrum,
                                      &lost) == AD_E_ACCURACY)
        return give_up(s);
    if (lost.status != AD_OK)
        return ad_fail(error, lost.status, "%s", lost.message);
    found->unknown = found->spectrum.undetermined &&
                     (rounding || !isfinite(found->discretisation)) &&
                     !(found->discretisation <= CLEAR * extent(s, s->path));
    if (found->singular) { /* what the grid alone has is no kind of path */
        phys_spectrum_free(&found->spectrum);
        found->spectrum.undetermined = true;
    }
    if (isinf(found->discretisation) || found->singular)
        found->discretisation = (double)NAN;
    if (compare && compare_given(s, error) == AD_OK && s->settings->compare_true &&
        !found->another && has_its_ends(s, compare)) /* the finer rule may err alike, at kinks */
        found->discretisation = fmax(found->discretisation, found->reference_distance);
    return error->status;
}

enum ad_status phys_path_find(const struct phys_solver *solver, const struct phys_system *system,
                              const struct phys_path_settings *settings, double *path,
                              struct phys_path_found *found, struct ad_error *error)
{
    struct phys_newton newton = {0};
    if (AD_LACKS(error, found))
        return error->status;
    *found = (struct phys_path_found){.reference_distance = NAN,
                                      .true_distance = NAN,
                                      .true_known = NAN,
                                      .discretisation = NAN,
                                      .free_momentum = NAN};
    if (phys_path_check(solver, system, settings, path, &found->info, error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    struct phys_path_settings own = *settings;
    struct phys_refined *refined = settings->refined;
    double *momentum = malloc(system->dof * sizeof *momentum);
    if (!momentum)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (!own.start_momentum)
        own.start_momentum = momentum;
    struct search s = {.system = system,
                       .settings = &own,
                       .path = path,
                       .newton = solver == &phys_solver_newton ? &newton : NULL,
                       .found = found,
                       .dof = system->dof,
                       .slices = settings->slices};
    if (!s.newton)
        solver->solve(system, &own, path, &found->info, error);
    else if (phys_newton_new(&newton, system, &own, refined ? refined->of : NULL, error) == AD_OK)
        phys_newton_solve(&newton, path, &found->info, error);
    if (error->status == AD_OK)
        s.unit = phys_path_units(system, &own, refined ? refined->of : NULL, path, error);
    if (s.unit && refined && s.newton && is_refined(&s, refined))
        s.refined = refined;
    if (error->status == AD_OK)
        measure(&s, error);
    phys_newton_free(&newton);
    AD_FREE(momentum, s.unit);
    return error->status;
}

void phys_path_found_free(struct phys_path_found *found)
{
    if (!found)
        return;
    phys_spectrum_free(&found->spectrum);
    free(found->force);
    found->force = NULL;
}
