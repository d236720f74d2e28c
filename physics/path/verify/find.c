/* Finds a path and verifies it (path.h): its kind of stationary point, and its distances from
   independent results: the motion from its start by an adaptive method, the path of a rule of
   higher order, and the stationary path at the given reference. */
#include "autodiff/free.h"
#include "grid_independence.h"
#include "find.h"
#include "physics/lagrangian/conserved.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double STATIONARY =
    1e-6;                         /* a tolerance of the gradient that asks for more: no verdict */
static const double SMALL = 1e-6; /* of a start's gradient */
static const double AGREE = 1e-9; /* of the extent: and paths that are one agree to that */
static const double APART = 10;   /* errors of discretisation: a motion further away is another */
static const double CLEAR = 1e-3; /* of the extent: and as far at the least */

/* ---- its kind ---- */

/* Interrupted: the path is found, and not its kind. */
static enum ad_status give_up(struct phys_search *s)
{
    s->found->info.stop = PHYS_STOP_INTERRUPTED;
    s->found->stationary = false;
    return AD_OK;
}

static enum ad_status find_kind(struct phys_search *s, struct ad_error *error)
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

/* ---- other stationary paths ---- */

/* Whether settings->compare is, or leads on the same grid to, another stationary path. A true
   motion that is clearly apart is one. */
static enum ad_status compare_given(const struct phys_search *s, struct ad_error *error)
{
    const struct phys_path_settings *settings = s->settings;
    size_t n = s->slices, dof = s->dof, size = settings->rule->degree * dof * n;
    struct phys_path_info info;
    double wide = phys_search_extent(s, s->path);
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
    s->found->another = phys_newton_settle(s->newton, path, &info, error) &&
                        phys_search_apart(s, path, s->path) > PHYS_SEARCH_SAME * wide;
    free(path);
    return error->status;
}

/* ---- all of it ---- */

/* Whether the path is the one that was refined, on the same grid. */
static bool is_refined(const struct phys_search *s, const struct phys_refined *refined)
{
    const struct phys_path_settings *own = s->settings, *theirs = refined->settings;
    return refined->path && own->rule == theirs->rule && own->slices == theirs->slices &&
           own->dt == theirs->dt &&
           phys_search_apart(s, s->path, refined->path) <= AGREE * phys_search_extent(s, s->path);
}

/* NULL where they are not known. */
static enum ad_status find_forces(struct phys_search *s, struct ad_error *error)
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

static bool has_its_ends(const struct phys_search *s, const double *path)
{
    bool has = true;
    for (size_t k = 0; k < s->dof; k++)
        for (size_t i = 0; i < s->slices; i += s->slices - 1)
            has = has && path[k * s->slices + i] == s->path[k * s->slices + i];
    return has;
}

/* Where the motion is lost, and the solver ended by itself or where the gradient is small. */
static enum ad_status find_singular(struct phys_search *s, struct ad_error *error)
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

static enum ad_status measure(struct phys_search *s, struct ad_error *error)
{
    const double *compare = s->settings->compare;
    struct phys_path_found *found = s->found;
    found->keeps_energy = phys_keeps_energy(s->system, error);
    if (compare)
        found->reference_distance = phys_search_apart(s, s->path, compare);
    if (find_kind(s, error) != AD_OK || find_forces(s, error) != AD_OK ||
        phys_search_motion(s, error) != AD_OK || find_singular(s, error) != AD_OK ||
        !found->stationary)
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
                     !(found->discretisation <= CLEAR * phys_search_extent(s, s->path));
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
    struct phys_search s = {.system = system,
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
