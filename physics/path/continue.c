/* Continuation (path.h): a path is followed while a parameter of the scene changes, each value's
   Newton iteration begun at the path of the last one. A step is halved where it fails, where the
   path moves far, or faster than it did, or where a rule of higher order does not find it near:
   what is followed is then one branch, as long as nothing turns back. */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "mesh.h"
#include "newton.h"
#include "path_units.h"
#include "physics/io/grow.h"

#include <math.h>
#include <stdlib.h>

enum { FEWEST = 32, FINER = 512, MOST = 4096 }; /* elements on the way: finer for short steps */
static const double FIRST = 0.02, LONGEST = 0.1, LEAST = 1e-6; /* steps: shares of the way */
static const double FAR = 0.1;     /* of the path's size: as far as it may move in a step ... */
static const double FASTER = 3;    /* ... and as many times the rate of the last step ... */
static const double STILL = 1e-3;  /* ... but for this, of the size */
static const double HALVED = 0.25; /* of the first step: shorter ones get more elements */
static const double COARSE = 1e-3; /* of the size: error on the way */

struct branch {
    struct phys_system *system;
    const struct phys_continuation *of;
    struct phys_path_settings settings; /* of the path */
    double *path, *mesh, *unit;         /* unit: of path_units.h */
    double at, rate, size; /* share of the way; movement over it; extent of the largest path */
    double tolerance;
    struct phys_continued *to;
    struct ad_error lost; /* why the last step failed */
};

static double value_at(const struct phys_continuation *of, double at)
{
    if (at >= 1)
        return of->to;
    return of->from * of->to > 0 ? of->from * pow(of->to / of->from, at)
                                 : of->from + at * (of->to - of->from);
}

static enum ad_status set_value(struct branch *b, double value, struct ad_error *error)
{
    size_t dof = b->system->dof;
    if (phys_system_set(b->system, b->of->name, value, error) == AD_OK && b->system->dof != dof)
        ad_fail(error, AD_E_ARGUMENT, "%s = %g: it changes the number of coordinates", b->of->name,
                value);
    return error->status;
}

/* The branch's path becomes `path`, with its mesh: both are taken. */
static void adopt(struct branch *b, const struct phys_path_settings *settings,
                  struct phys_derivatives *of, double *path, double *mesh, struct ad_error *error)
{
    AD_FREE(b->path, b->mesh, b->unit);
    b->unit = phys_path_units(b->system, settings, of, path, error);
    b->settings = *settings;
    b->settings.mesh = mesh;
    b->path = path;
    b->mesh = mesh;
    for (size_t k = 0; k < b->system->dof; k++)
        for (size_t i = 0; i < settings->slices; i++)
            b->size = fmax(b->size, fabs(path[k * settings->slices + i]));
}

static bool note(struct branch *b, double value, const struct phys_spectrum *spectrum)
{
    struct phys_continued *to = b->to;
    if (!phys_grow(&to->step, to->n, sizeof *to->step))
        return false;
    to->step[to->n++] =
        (struct phys_continued_step){value, b->settings.slices - 1, spectrum->index};
    return true;
}

/* Newton's method at the value set, on `elements` elements placed by the branch's path: settings,
   path and start. False: not found. */
static bool solve(struct branch *b, struct phys_derivatives *of, size_t elements,
                  struct phys_path_settings *settings, double *mesh, double **start, double **path,
                  struct ad_error *error)
{
    size_t dof = b->system->dof;
    const struct phys_grid from = phys_grid_of(&b->settings);
    struct phys_path_info info = {0};
    double gain;
    if (phys_mesh_place(&from, b->path, b->unit, dof, elements, mesh, &gain, error) != AD_OK)
        return false;
    *settings = b->settings;
    settings->rule = phys_rule_find("gauss4", error);
    settings->slices = elements + 1;
    settings->dt = phys_grid_time(&from, from.slices - 1) / (double)elements;
    settings->mesh = mesh;
    settings->adam_steps = 0;
    const struct phys_grid grid = phys_grid_of(settings);
    *start = phys_path_resample(&from, b->path, &grid, dof, error);
    *path = phys_path_resample(&from, b->path, &grid, dof, error);
    if (error->status != AD_OK)
        return false;
    if (settings->ends && settings->ends->free_time)
        phys_newton_free_time(b->system, settings, of, settings->ends->energy, *path, &info,
                              &b->lost);
    else
        phys_newton_over(b->system, settings, of, false, *path, &info, &b->lost);
    phys_keep_memory(&b->lost, error);
    if (info.stop == PHYS_STOP_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    return b->lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING;
}

/* The path at share `at` of the way, by a step of `length`, on as many elements as it needs. */
static bool try_step(struct branch *b, double at, double length, struct ad_error *error)
{
    size_t elements = FEWEST, dof = b->system->dof;
    /* few elements hold a path that hovers at an unstable rest, where the motion hardly does */
    for (double l = length; l < HALVED * FIRST && elements < FINER; l *= 2)
        elements *= 2;
    struct phys_derivatives of = {0};
    struct phys_newton newton = {0};
    struct phys_spectrum spectrum = {0};
    bool kept = false;
    b->lost = (struct ad_error){0};
    if (set_value(b, value_at(b->of, at), error) == AD_OK)
        phys_derivatives_new(&of, b->system, PHYS_LADDER_COLUMNS, NULL, error);
    for (bool again = true; again && error->status == AD_OK; elements *= 2) {
        struct phys_path_settings settings;
        double *start = NULL, *path = NULL, finer = (double)NAN;
        double *mesh = malloc((elements + 1) * sizeof *mesh);
        again = false;
        if (!mesh)
            ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", elements + 1);
        else if (solve(b, &of, elements, &settings, mesh, &start, &path, error)) {
            double moved = phys_path_apart(b->unit, start, path, dof, settings.slices);
            double most = fmin(FAR * b->size, b->rate * length * FASTER + STILL * b->size);
            if (phys_newton_new(&newton, b->system, &settings, &of, error) == AD_OK &&
                phys_newton_spectrum(&newton, PHYS_KIND, path, &spectrum, error) == AD_OK)
                phys_path_discretisation(b->system, &settings, &of, path, true, &finer, &spectrum,
                                         error);
            phys_newton_free(&newton);
            again = !(finer <= fmax(COARSE * b->size, b->tolerance)) && 2 * elements <= MOST;
            kept = !again && moved <= fmax(most, b->tolerance) && !spectrum.undetermined &&
                   finer <= fmax(COARSE * b->size, b->tolerance) && error->status == AD_OK;
            if (kept) {
                b->rate = fmax(moved, STILL * b->size) / length;
                b->at = at;
                adopt(b, &settings, &of, path, mesh, error);
                path = mesh = NULL;
                if (!note(b, value_at(b->of, at), &spectrum))
                    ad_fail(error, AD_E_MEMORY, "out of memory");
            } else if (!again && spectrum.undetermined) {
                ad_fail(&b->lost, AD_E_ACCURACY,
                        "an eigenvalue of the second variation is zero within its error");
            } else if (!again) {
                ad_fail(&b->lost, AD_E_ACCURACY, "the path moves by %.2g in a step of %.2g", moved,
                        value_at(b->of, at) - value_at(b->of, b->at));
            }
            phys_spectrum_free(&spectrum);
        }
        AD_FREE(start, path, mesh);
    }
    phys_derivatives_free(&of);
    return kept;
}

/* From the path at the first value to that at the last one. */
static enum ad_status follow(struct branch *b, struct ad_error *error)
{
    double length = FIRST;
    while (b->at < 1 && error->status == AD_OK) {
        double at = b->at + length >= 1 - 1e-9 ? 1 : b->at + length;
        if (try_step(b, at, at - b->at, error))
            length = fmin(LONGEST, 1.5 * length);
        else if ((length *= 0.5) < LEAST)
            ad_fail(error, AD_E_ACCURACY,
                    "lost beyond %s = %.8g: %s; the branch may turn back or end there", b->of->name,
                    value_at(b->of, b->at),
                    *b->lost.message ? b->lost.message : "Newton's method finds no path nearby");
    }
    return error->status;
}

/* The first path, to an error that the way allows. */
static enum ad_status begin(struct branch *b, const struct phys_path_settings *settings,
                            const double *guess, double ends_error, struct ad_error *error)
{
    struct phys_refined first = {0};
    struct phys_spectrum spectrum = {0};
    for (size_t k = 0; k < b->system->dof * settings->slices; k++)
        b->size = fmax(b->size, fabs(guess[k]));
    double tolerance = fmax(b->tolerance, 0.1 * COARSE * b->size);
    if (set_value(b, b->of->from, error) != AD_OK)
        return error->status;
    if (phys_path_refine(b->system, settings, guess, ends_error, tolerance, &first, &b->lost) !=
        AD_OK) {
        ad_fail(error, b->lost.status, "%s = %g: %s", b->of->name, b->of->from, b->lost.message);
    } else if (phys_path_spectrum(b->system, first.settings, first.path, &spectrum, error) ==
               AD_OK) {
        adopt(b, first.settings, first.of, first.path, first.mesh, error);
        first.path = first.mesh = NULL;
        if (!note(b, b->of->from, &spectrum))
            ad_fail(error, AD_E_MEMORY, "out of memory");
        b->rate = (double)INFINITY;
    }
    phys_spectrum_free(&spectrum);
    phys_refined_free(&first);
    return error->status;
}

/* The last path, to the error asked for; by its own levels, which must find the same one. */
static enum ad_status end(struct branch *b, const struct phys_rule *rule, double ends_error,
                          struct phys_refined *refined, struct ad_error *error)
{
    size_t dof = b->system->dof;
    struct phys_path_settings settings = b->settings;
    settings.rule = rule;
    if (phys_path_refine(b->system, &settings, b->path, ends_error, b->tolerance, refined, error) !=
        AD_OK)
        return error->status;
    const struct phys_grid from = phys_grid_of(refined->settings), to = phys_grid_of(&b->settings);
    struct phys_grid scaled = from;
    scaled.dt = phys_grid_time(&to, to.slices - 1) / (double)(from.slices - 1); /* a free time */
    double *path = phys_path_resample(&scaled, refined->path, &to, dof, error);
    if (path && phys_path_apart(b->unit, path, b->path, dof, to.slices) > FAR * b->size)
        ad_fail(error, AD_E_ACCURACY, "%s = %g: the path found is not that of the branch",
                b->of->name, b->of->to);
    free(path);
    return error->status;
}

enum ad_status phys_path_continue(struct phys_system *system,
                                  const struct phys_path_settings *settings, const double *guess,
                                  double ends_error, double tolerance,
                                  const struct phys_continuation *of, struct phys_refined *refined,
                                  struct phys_continued *continued, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, refined) || AD_LACKS_RESULT(error, continued) ||
        AD_LACKS(error, system, system->scene, settings, guess, of))
        return error->status;
    if (phys_refuse_forces(system, "paths", error) != AD_OK ||
        phys_refuse_constraints(system, "continued paths", error) != AD_OK)
        return error->status;
    AD_OWN(phys_continuation, of, to, error);
    PHYS_OWN_PATH(settings, error);
    if (!isfinite(of->from) || !isfinite(of->to))
        return ad_fail(error, AD_E_ARGUMENT, "%s from %g to %g, expected numbers", of->name,
                       of->from, of->to);
    struct branch b = {.system = system, .of = of, .tolerance = tolerance, .to = continued};
    struct phys_path_settings own = *settings;
    own.rule = NULL;
    if (begin(&b, &own, guess, ends_error, error) == AD_OK && follow(&b, error) == AD_OK)
        end(&b, settings->rule, ends_error, refined, error);
    AD_FREE(b.path, b.mesh, b.unit);
    if (error->status != AD_OK)
        phys_system_set(system, of->name, of->to, &(struct ad_error){0});
    return error->status;
}

void phys_continued_free(struct phys_continued *continued)
{
    if (!continued)
        return;
    free(continued->step);
    *continued = (struct phys_continued){0};
}
