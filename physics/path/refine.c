/* Finds the coarsest setting that meets an error (path.h) by doubling elements, with the same ends
   and time. Cheap elements say which path it is; once two levels agree on that, a rule of as high
   an order as the error needs begins with as many elements. The error of its path is the distance
   from that of a rule of higher order on half as many elements more.

   With a given rule, free time, or more coordinates than that takes, the error of a path is
   estimated from its distance to the previous one, at the slices of both.

   With d that distance and d' the one before it, errors fall by r = d'/d per level, at most by 2^p
   for a rule of order p; the error of the finer path is then d/(r - 1). Where r is not yet
   meaningful, d itself is used, which is the error of the coarser path. Far from the limit errors
   may change sign, and r mean nothing: an estimate that is small enough is raised to the distance
   from the path of a rule of higher order on the same slices, if it is less. Where the path is much
   steeper in some places than in others its elements are placed anew instead (mesh.h). */
#include "autodiff/free.h"
#include "mesh.h"
#include "newton.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COARSEST = 4, CHEAP = 32, FINEST = 1 << 14, UNSETTLED = 1 << 9 }; /* elements */
enum { UNPLACED = 64 }; /* even elements that should do to tell where the path is steep */
enum {
    MOST_PLACED = 4
}; /* times that elements are placed anew: a path that asks for more is singular */
enum { DESCENT = 500 }; /* steps of Adam, where Newton's method alone finds no one path */
enum { PARTED = 5 }; /* levels that find several paths from the guess: the next goes on with one */

static const double CAUTION = 2;   /* the law of convergence holds in the limit */
static const double MARGIN = 1.5;  /* the path of the rule of higher order errs, too ... */
static const double ALONE = 3;     /* ... and without levels to compare, at other slices more */
static const double LOST = 1e-12;  /* of the path's size: not by rounding alone */
static const double EXACT = 1e-14; /* of the path's size: no distance but rounding */
static const double FINE = 1e-7;   /* of the path's size: where rounding may stop the fall */
static const double FALLING = 0.7; /* of the distance, from level to level, at the least */
static const double NEAR = 1e-2;   /* of the path's size: as close as to be the same path */
static const double WORTH = 3;     /* times fewer elements, for which they are placed anew */

/* Degrees of the rule of high order, and coordinates of its element: larger ones cost more than
   twice as many. */
enum { LOWEST = 4, HIGHEST = 12, LARGEST = 96 };

/* The path of a level. */
struct stage {
    struct phys_grid grid;
    double *start, *path, *mesh;
    double distance; /* from the level before, or of high order from a finer one; NaN: none */
    bool apart;      /* its elements are not those of the level before, halved */
};

struct climb {
    const struct phys_system *system;
    const double *guess; /* on the grid `given` */
    struct phys_grid given;
    size_t adam_steps, placed;                /* placed: how often the elements were */
    double time, tolerance, ends_error, size; /* size: the path's largest coordinate */
    struct stage before, here;
    bool high; /* rungs of high order */
    struct phys_refined *to;
    struct ad_error lost; /* why the last level has no path */
};

static void drop(struct stage *stage)
{
    AD_FREE(stage->start, stage->path, stage->mesh);
    *stage = (struct stage){.distance = (double)NAN};
}

/* ---- one level ---- */

/* Near enough to the level before to be the same path. */
static bool settled(const struct climb *c, const struct stage *stage)
{
    return stage->path && stage->distance <= NEAR * c->size;
}

/* Elements of c->here: placed by the level before, or its own, or those given, divided. */
static enum ad_status choose_mesh(struct climb *c, struct ad_error *error)
{
    const struct stage *before = &c->before;
    const struct phys_grid *from = before->path ? &before->grid : &c->given;
    struct stage *here = &c->here;
    size_t dof = c->system->dof, n = here->grid.slices;
    double gain = 0;
    if (before->path && (settled(c, before) || n > UNPLACED) && from->rule->degree > 1 &&
        !c->system->scene->between)
        phys_mesh_place(from, before->path, dof, 0, NULL, &gain, error);
    here->apart =
        gain > WORTH && !before->apart && 2 * (n - 1) <= FINEST; /* the next is compared with it */
    if (here->apart && c->placed++ == MOST_PLACED)
        return ad_fail(
            error, AD_E_ACCURACY,
            "error %g is out of reach: the path is singular, as at a collision, or "
            "nearly: %zu elements placed where it is steep do not resolve it; try another "
            "start, or other ends",
            c->tolerance, from->slices - 1);
    if (here->apart && !(here->mesh = malloc(n * sizeof *here->mesh)))
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
    else if (here->apart)
        phys_mesh_place(from, before->path, dof, n - 1, here->mesh, &gain, error);
    else if (from->mesh)
        here->mesh = phys_mesh_divide(from->mesh, from->slices, n, error);
    here->grid.mesh = here->mesh;
    return error->status;
}

/* Start and settings of c->here, whose grid is set: from the level before once two agree on which
   path it is, or where several from the guess did not; else from the guess. */
static enum ad_status begin(struct climb *c, struct ad_error *error)
{
    struct stage *stage = &c->here;
    struct phys_path_settings *settings = &c->to->settings;
    size_t dof = c->system->dof, n = stage->grid.slices, m = c->given.slices;
    bool again = settled(c, &c->before) || (c->before.path && c->to->n > PARTED);
    struct phys_grid from = again ? c->before.grid : c->given;
    from.dt = stage->grid.dt * (double)(n - 1) / (double)(from.slices - 1); /* a free time is new */
    stage->start =
        phys_path_resample(&from, again ? c->before.path : c->guess, &stage->grid, dof, error);
    size_t bytes = stage->grid.rule->degree * dof * n * sizeof *stage->path;
    stage->path = stage->start ? malloc(bytes) : NULL;
    if (!stage->path)
        return ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
    for (size_t k = 0; k < dof; k++)
        for (size_t end = 0; end < 2; end++)
            if (!(settings->ends && settings->ends->free[end] && settings->ends->free[end][k]))
                stage->start[k * n + end * (n - 1)] = c->guess[k * m + end * (m - 1)];
    memcpy(stage->path, stage->start, bytes);
    settings->rule = stage->grid.rule;
    settings->slices = n;
    settings->dt = stage->grid.dt;
    settings->mesh = stage->grid.mesh;
    settings->adam_steps = again ? 0 : c->adam_steps;
    return AD_OK;
}

static bool time_is_free(const struct climb *c)
{
    return c->to->settings.ends && c->to->settings.ends->free_time;
}

/* A level whose path is not found is none to compare with. */
static enum ad_status solve(struct climb *c, struct phys_level *level, struct ad_error *error)
{
    struct phys_path_info info = {0};
    struct ad_error lost = {0};
    if (begin(c, error) != AD_OK)
        return error->status;
    struct phys_path_settings *settings = &c->to->settings;
    bool free_time = time_is_free(c);
    if (free_time)
        phys_newton_free_time(c->system, settings, c->to->of, settings->ends->energy, c->here.path,
                              &info, &lost);
    else
        phys_newton_over(c->system, settings, c->to->of, c->here.path, &info, &lost);
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE &&
        !(free_time && lost.status == AD_E_ACCURACY))
        return ad_fail(error, lost.status, "%s", lost.message);
    if (info.stop == PHYS_STOP_INTERRUPTED)
        return ad_fail(error, AD_E_ACCURACY, "interrupted at %zu elements of %s", level->elements,
                       level->rule->name);
    c->lost = lost;
    level->seconds = info.seconds;
    level->found = lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING;
    if (level->found)
        c->here.grid.dt = settings->dt;
    return AD_OK;
}

/* ---- its error ---- */

/* Errors that no refinement removes: that of the ends, and rounding in every element. */
static double rounding(const struct climb *c, size_t elements)
{
    return c->ends_error + CAUTION * DBL_EPSILON * c->size * (double)elements;
}

/* Distance of c->here from the level before, at the slices of both, and its error by that. */
static void estimate(struct climb *c, struct phys_level *level)
{
    const struct stage *coarse = &c->before;
    size_t dof = c->system->dof, n = coarse->grid.slices, m = c->here.grid.slices;
    c->here.distance = level->estimate = NAN;
    if (!level->found)
        return;
    c->size = 0;
    for (size_t k = 0; k < dof * m; k++)
        c->size = fmax(c->size, fabs(c->here.path[k]));
    if (c->here.apart) { /* the path before errs more between its slices */
        double moved = 0;
        for (size_t k = 0; k < dof * m; k++)
            moved = fmax(moved, fabs(c->here.start[k] - c->here.path[k]));
        c->here.distance = settled(c, coarse) ? moved : (double)NAN;
        return;
    }
    if (c->high || !coarse->path || coarse->grid.rule != level->rule || 2 * n != m + 1)
        return;
    double d = 0, widest = 0; /* of a step between slices */
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < n; i++) {
            const double *x = coarse->path + k * n + i;
            d = fmax(d, fabs(*x - c->here.path[k * m + 2 * i]));
            double length = i > 0 && coarse->mesh ? coarse->mesh[i] - coarse->mesh[i - 1] : 1;
            widest = fmax(widest, i > 0 ? fabs(x[0] - x[-1]) / length : 0);
        }
    double later = 2 * c->here.grid.dt - coarse->grid.dt; /* 0 unless the time is free */
    if (time_is_free(c))
        d = fmax(d, widest * (double)(n - 1) * fabs(later) / coarse->grid.dt);
    double fall = coarse->distance / d, most = pow(2, (double)level->rule->order);
    double error = fall > 2 && !coarse->apart ? CAUTION * d / (fmin(fall, most) - 1) : d;
    c->here.distance = d;
    if (isnan(coarse->distance) && d <= EXACT * c->size)
        return; /* the slices of two levels alone may be exact by symmetry */
    level->estimate = fmax(fmin(error, d), rounding(c, level->elements));
}

static enum ad_status find_spectrum(struct climb *c, struct phys_spectrum *spectrum,
                                    struct ad_error *error)
{
    struct phys_newton newton = {0};
    if (phys_newton_new(&newton, c->system, &c->to->settings, c->to->of, error) == AD_OK)
        phys_newton_spectrum(&newton, c->here.path, spectrum, error);
    phys_newton_free(&newton);
    return error->status;
}

/* Whether the error of c->here is small enough, also by the rule of higher order. Between conjugate
   ends all levels may agree on a path that the grid alone holds. */
static bool verified(struct climb *c, struct phys_level *level, struct ad_error *error)
{
    double *finer = &c->to->finer;
    struct phys_spectrum *spectrum = &c->to->spectrum;
    if (!level->found || !(c->high || level->estimate < c->tolerance))
        return false;
    if (find_spectrum(c, spectrum, error) == AD_OK)
        phys_path_discretisation(c->system, &c->to->settings, c->to->of, c->here.path, true, finer,
                                 spectrum, error);
    if (c->high) {
        c->here.distance = *finer;
        level->estimate = rounding(c, level->elements);
    }
    level->estimate =
        fmax(level->estimate, (c->high ? ALONE : MARGIN) * *finer); /* fmax ignores NaN */
    bool close = level->estimate < c->tolerance && error->status == AD_OK;
    if (close && spectrum->undetermined)
        ad_fail(error, AD_E_ACCURACY,
                "error %g cannot be verified: an eigenvalue of the second variation is zero within "
                "its error, so that the path may lie elsewhere; try other ends, or another time",
                c->tolerance);
    if (!close)
        phys_spectrum_free(spectrum);
    return close;
}

/* The distances do not fall any more, and are small. */
static bool at_rounding(const struct climb *c, const struct phys_level *level)
{
    return rounding(c, level->elements) > c->tolerance ||
           (c->before.distance <= FINE * c->size && c->here.distance <= FINE * c->size &&
            c->here.distance > FALLING * c->before.distance);
}

/* ---- all levels ---- */

/* True when the climb is over, one way or the other. */
static bool climb(struct climb *c, const struct phys_rule *rule, size_t elements,
                  struct ad_error *error)
{
    struct phys_level *level = &c->to->level[c->to->n++];
    *level = (struct phys_level){.rule = rule, .elements = elements};
    if (c->before.path && time_is_free(c))
        c->time = c->before.grid.dt * (double)(c->before.grid.slices - 1);
    c->here.grid =
        (struct phys_grid){.rule = rule, .slices = elements + 1, .dt = c->time / (double)elements};
    if (choose_mesh(c, error) != AD_OK || solve(c, level, error) != AD_OK)
        return true;
    estimate(c, level);
    if (verified(c, level, error) || error->status != AD_OK)
        return true;
    if (level->found && c->ends_error > fmax(c->tolerance, LOST * c->size)) {
        ad_fail(
            error, AD_E_ACCURACY,
            "error %g is out of reach: the ends, taken from the motion, are known to %.2g; allow "
            "a larger error, shorten the time, or give the ends in a file",
            c->tolerance, c->ends_error);
        return true;
    }
    if (level->found && at_rounding(c, level)) {
        ad_fail(error, AD_E_ACCURACY,
                "error %g is out of reach: rounding takes over at %zu elements of %s, error about "
                "%.2g; allow a larger error",
                c->tolerance, elements, rule->name, fmax(level->estimate, rounding(c, elements)));
        return true;
    }
    if (c->lost.status == AD_E_ACCURACY && !c->before.path && c->to->n > PARTED) {
        ad_fail(error, AD_E_ACCURACY, "%s", c->lost.message);
        return true;
    }
    if (elements >= UNSETTLED && !settled(c, &c->here)) {
        c->to->unsettled = true;
        ad_fail(error, AD_E_ACCURACY,
                "error %g: up to %zu elements of %s do not agree on a path, which may be one of "
                "several; try a shorter time or another start",
                c->tolerance, elements, rule->name);
        return true;
    }
    drop(&c->before);
    if (level->found)
        c->before = c->here;
    else
        drop(&c->here);
    c->here = (struct stage){.distance = (double)NAN};
    return false;
}

/* The rule with which as many elements as two levels needed to agree come to the tolerance: in each
   the error of order p falls by the same factor per order. NULL: none, the levels of one rule are
   compared. */
static const struct phys_rule *high_rule(const struct climb *c, struct ad_error *error)
{
    size_t dof = c->system->dof;
    if (!settled(c, &c->before) || time_is_free(c) ||
        (LOWEST + PHYS_FINER_DEGREES) * dof > PHYS_FINER_MOST)
        return NULL;
    double order = (double)c->before.grid.rule->order;
    double left = c->before.distance / exp2(order / 2); /* it falls by 2^order in the limit */
    double here = log(fmax(left / c->size, DBL_EPSILON));
    double degree = 1 + ceil(order / 2 * log(c->tolerance / c->size) / here);
    double most = fmin(HIGHEST, LARGEST / (double)dof);
    char name[24];
    snprintf(name, sizeof name, "gauss%.0f", fmax(LOWEST, floor(fmin(degree, most))));
    return phys_rule_find(name, error);
}

/* Levels of a rule, and with `any` one of high order once two agree. True when the climb is over.
 */
static bool climb_rungs(struct climb *c, const struct phys_rule *rule, size_t first, size_t last,
                        bool any, struct ad_error *error)
{
    for (size_t elements = first; elements <= last; elements *= 2) {
        if (climb(c, rule, elements, error))
            return true;
        const struct phys_rule *high = any ? high_rule(c, error) : NULL;
        if (high) {
            c->high = true;
            return climb_rungs(c, high, elements, FINEST, false, error);
        }
    }
    return false;
}

/* All levels from the guess, after c->adam_steps. */
static enum ad_status climb_once(struct climb *c, const struct phys_rule *given,
                                 struct ad_error *error)
{
    size_t first = c->given.mesh ? c->given.slices - 1 : COARSEST;
    const struct phys_rule *coarse = phys_rule_find("gauss2", error);
    c->high = false;
    if (given ? climb_rungs(c, given, first, FINEST, false, error)
              : climb_rungs(c, coarse, first, CHEAP, true, error) ||
                    (!c->high &&
                     climb_rungs(c, phys_rule_find("gauss4", error),
                                 first < 2 * COARSEST ? 2 * COARSEST : first, FINEST, true, error)))
        return error->status;
    const struct phys_level *last = &c->to->level[c->to->n - 1];
    return ad_fail(error, AD_E_ACCURACY,
                   "error %g is out of reach: %zu elements of %s come to %.2g; allow a larger "
                   "error or take another rule",
                   c->tolerance, last->elements, last->rule->name, last->estimate);
}

/* Newton's method may lead each level elsewhere from a guess far from every path, as from a line to
   a kink: then once more after descents. */
static enum ad_status climb_all(struct climb *c, const struct phys_rule *given,
                                struct ad_error *error)
{
    struct ad_error lost = {0};
    climb_once(c, given, &lost);
    if (c->to->unsettled && c->adam_steps < DESCENT) {
        drop(&c->before);
        drop(&c->here);
        c->to->n = c->placed = 0;
        c->to->unsettled = false;
        c->adam_steps = DESCENT;
        lost = (struct ad_error){0};
        climb_once(c, given, &lost);
    }
    return lost.status == AD_OK ? AD_OK : ad_fail(error, lost.status, "%s", lost.message);
}

enum ad_status phys_path_refine(const struct phys_system *system,
                                const struct phys_path_settings *settings, const double *guess,
                                double ends_error, double tolerance, struct phys_refined *refined,
                                struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, refined) || AD_LACKS(error, system, system->scene, settings, guess))
        return error->status;
    if (!(tolerance > 0))
        return ad_fail(error, AD_E_ARGUMENT, "error %g, expected a positive number", tolerance);
    if (settings->slices < 2)
        return ad_fail(error, AD_E_ARGUMENT, "%zu slices, expected 2 or more", settings->slices);
    if (settings->ends && settings->ends->free_time && phys_lacks_energy(system, error))
        return error->status;
    struct climb c = {.system = system,
                      .guess = guess,
                      .given = {&phys_rule_left, settings->slices, settings->dt, settings->mesh},
                      .adam_steps = settings->adam_steps,
                      .time = (double)(settings->slices - 1) * settings->dt,
                      .tolerance = tolerance,
                      .ends_error = ends_error,
                      .before.distance = NAN,
                      .to = refined};
    refined->finer = (double)NAN;
    refined->settings = *settings;
    refined->settings.progress = NULL;
    refined->settings.reference = refined->settings.compare = NULL;
    refined->settings.refined = NULL;
    refined->settings.start_momentum = NULL;
    refined->settings.tolerance = 0;
    refined->settings.hold = 0;
    refined->of = calloc(1, sizeof *refined->of);
    if (!refined->of)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_derivatives_new(refined->of, system, PHYS_LADDER_COLUMNS, NULL, error) == AD_OK &&
        settings->native)
        phys_derivatives_native(refined->of);
    if (error->status == AD_OK && climb_all(&c, settings->rule, error) == AD_OK) {
        refined->start = c.here.start;
        refined->path = c.here.path;
        refined->mesh = c.here.mesh;
        c.here.start = c.here.path = c.here.mesh = NULL;
    }
    refined->settings.mesh = refined->mesh;
    drop(&c.before);
    drop(&c.here);
    return error->status;
}

void phys_refined_free(struct phys_refined *refined)
{
    if (!refined)
        return;
    if (refined->of)
        phys_derivatives_free(refined->of);
    phys_spectrum_free(&refined->spectrum);
    AD_FREE(refined->of, refined->start, refined->path, refined->mesh);
    *refined = (struct phys_refined){0};
}
