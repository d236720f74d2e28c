/* Finds the coarsest setting that meets an error (path.h) by doubling elements, with the same ends
   and time. Cheap elements say which path it is; once two levels agree on that, a rule of as high
   an order as the error needs begins with as many elements. The error of its path is the distance
   from that of a rule of higher order on half as many elements more; without such a rule levels are
   compared (error.c). Where the path is much steeper in some places than in others its elements are
   placed anew instead (physics/path/mesh.h). */
#include "internal.h"
#include "autodiff/free.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { COARSEST = 4, CHEAP = 32, SPARED = 16, UNSETTLED = 1 << 9 }; /* elements */
/* Levels after which elements of high order that part are the last: all fit. */
enum { MOST_PARTED = PHYS_LEVELS / 2 };
enum { DESCENT = 500 }; /* steps of Adam, where Newton's method alone finds no one path */

static const double LOST = 1e-12; /* of the path's size: not by rounding alone */

/* Degrees of the rule of high order, and coordinates of its element: larger ones cost more than
   twice as many. */
enum { LOWEST = 4, HIGHEST = 12, LARGEST = 96 };

static void drop(struct phys_stage *stage)
{
    AD_FREE(stage->start, stage->path, stage->mesh);
    *stage = (struct phys_stage){.distance = (double)NAN};
}

/* Elements of high order have gone from the path that coarser ones agreed on to another: the
   grid alone held it, as one through a collision. */
static bool has_parted(const struct phys_climb *c)
{
    return c->high && phys_climb_settled(c, &c->before) && isfinite(c->here.distance);
}

/* True when the climb is over, one way or the other. */
static bool climb_level(struct phys_climb *c, const struct phys_rule *rule, size_t elements,
                        struct ad_error *error)
{
    struct phys_level *level = &c->to->level[c->to->n++];
    *level = (struct phys_level){.rule = rule, .elements = elements};
    if (c->before.path && phys_climb_free_time(c))
        c->time = c->before.grid.dt * (double)(c->before.grid.slices - 1);
    c->here.grid =
        (struct phys_grid){.rule = rule, .slices = elements + 1, .dt = c->time / (double)elements};
    if (phys_climb_mesh(c, error) != AD_OK || phys_climb_solve(c, level, error) != AD_OK)
        return true;
    phys_climb_estimate(c, level, error);
    if (phys_climb_verified(c, level, error) || error->status != AD_OK)
        return true;
    if (level->found && c->ends_error > fmax(c->tolerance, LOST * c->size)) {
        ad_fail(
            error, AD_E_ACCURACY,
            "error %g is out of reach: the ends, taken from the motion, are known to %.2g; allow "
            "a larger error, shorten the time, or give the ends in a file",
            c->tolerance, c->ends_error);
        return true;
    }
    if (level->found && phys_climb_at_rounding(c, level)) {
        ad_fail(error, AD_E_ACCURACY,
                "error %g is out of reach: rounding takes over at %zu elements of %s, error about "
                "%.2g; allow a larger error",
                c->tolerance, elements, rule->name,
                fmax(level->estimate, phys_climb_rounding(c, elements)));
        return true;
    }
    if (c->lost.status == AD_E_ACCURACY && !c->before.path && c->to->n > PHYS_CLIMB_PARTED) {
        ad_fail(error, AD_E_ACCURACY, "%s", c->lost.message);
        return true;
    }
    const bool settled = phys_climb_settled(c, &c->here), parts = !settled && has_parted(c);
    c->doubted |= parts;
    c->parted = parts && c->adam_steps >= DESCENT && c->to->n < MOST_PARTED;
    const size_t unsettled = c->sparing ? SPARED : UNSETTLED;
    if ((parts || (elements >= unsettled && !settled)) && !c->parted) {
        c->to->unsettled = true;
        ad_fail(error, AD_E_ACCURACY,
                "error %g: up to %zu elements of %s do not agree on a path, which may be one of "
                "several; try a shorter time or another start",
                c->tolerance, elements, rule->name);
        return true;
    }
    drop(&c->before);
    if (level->found && !c->parted)
        c->before = c->here;
    else
        drop(&c->here);
    c->here = (struct phys_stage){.distance = (double)NAN};
    return false;
}

/* The rule with which as many elements as two levels needed to agree come to the tolerance: in each
   the error of order p falls by the same factor per order. NULL: none, the levels of one rule are
   compared. */
static const struct phys_rule *high_rule(const struct phys_climb *c, struct ad_error *error)
{
    size_t dof = c->system->dof;
    if (!phys_climb_settled(c, &c->before) || phys_climb_free_time(c) ||
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
static bool climb_rungs(struct phys_climb *c, const struct phys_rule *rule, size_t first,
                        size_t last, bool any, struct ad_error *error)
{
    for (size_t elements = first; elements <= last && !c->parted; elements *= 2) {
        c->rough = any && !phys_climb_free_time(c);
        if (climb_level(c, rule, elements, error))
            return true;
        const struct phys_rule *high = any ? high_rule(c, error) : NULL;
        if (high) {
            c->high = true;
            if (climb_rungs(c, high, elements, PHYS_FINEST, false, error) || !c->parted)
                return true;
            c->high = c->parted = false;
        }
    }
    return false;
}

/* All levels from the guess, after c->adam_steps. */
static enum ad_status climb_once(struct phys_climb *c, const struct phys_rule *given,
                                 struct ad_error *error)
{
    const struct phys_rule *coarse = phys_rule_find("gauss2", error);
    const struct phys_rule *only = c->approach ? c->given.rule : given;
    size_t first = c->given.mesh || c->approach ? c->given.slices - 1 : COARSEST;
    c->high = false;
    if (only ? climb_rungs(c, only, first, PHYS_FINEST, !given, error)
             : climb_rungs(c, coarse, first, CHEAP, true, error) ||
                   (!c->high && climb_rungs(c, phys_rule_find("gauss4", error),
                                            first < 2 * COARSEST ? 2 * COARSEST : first,
                                            PHYS_FINEST, true, error)))
        return error->status;
    const struct phys_level *last = &c->to->level[c->to->n - 1];
    return ad_fail(error, AD_E_ACCURACY,
                   "error %g is out of reach: %zu elements of %s come to %.2g; allow a larger "
                   "error or take another rule",
                   c->tolerance, last->elements, last->rule->name, last->estimate);
}

/* What is tried next. First Newton's method where it converges with the fewest steps of Adam, which
   may lead each level elsewhere from a guess far from every path, or to one that cannot be known;
   then after all of them, and where no path is agreed on, as from a line to a kink, after more; at
   last from another guess. */
static bool next_try(struct phys_climb *c, const struct phys_rule *given, struct ad_error *error)
{
    if (c->sparing) {
        c->sparing = false;
        return true;
    }
    if (!c->to->unsettled || c->approach)
        return false;
    if (c->adam_steps < DESCENT) {
        c->adam_steps = DESCENT;
        return true;
    }
    if (phys_climb_free_time(c))
        return false;
    c->adam_steps = 0;
    return phys_climb_approach(c, given ? given : phys_rule_find("gauss4", error), error) ==
               AD_OK &&
           c->approach;
}

static enum ad_status climb_all(struct phys_climb *c, const struct phys_rule *given,
                                struct ad_error *error)
{
    struct ad_error lost = {0};
    c->sparing = c->adam_steps > 0;
    while (climb_once(c, given, &lost) == AD_E_ACCURACY && next_try(c, given, error)) {
        drop(&c->before);
        drop(&c->here);
        phys_spectrum_free(&c->to->spectrum);
        c->to->n = c->placed = 0;
        c->to->unsettled = c->to->singular = c->doubted = c->parted = false;
        lost = (struct ad_error){0};
    }
    if (error->status == AD_OK && lost.status != AD_OK)
        ad_fail(error, lost.status, "%s", lost.message);
    return error->status;
}

/* Of L: those of an earlier path, or new ones. */
static enum ad_status find_derivatives(struct phys_refined *refined,
                                       const struct phys_system *system,
                                       const struct phys_path_settings *settings,
                                       struct ad_error *error)
{
    const struct phys_refined *earlier = settings->refined;
    refined->borrowed = earlier && earlier->of && phys_derivatives_serve(earlier->of, system);
    refined->of = refined->borrowed ? earlier->of : calloc(1, sizeof *refined->of);
    if (!refined->of)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (!refined->borrowed &&
        phys_derivatives_new(refined->of, system, PHYS_LADDER_COLUMNS, NULL, error) == AD_OK &&
        settings->native)
        phys_derivatives_native(refined->of);
    return error->status;
}

enum ad_status phys_path_refine(const struct phys_system *system,
                                const struct phys_path_settings *settings, const double *guess,
                                double ends_error, double tolerance, struct phys_refined *refined,
                                struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, refined) || AD_LACKS(error, system, system->scene, settings, guess))
        return error->status;
    if (phys_refuse_forces(system, "paths", error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    if (!(tolerance > 0))
        return ad_fail(error, AD_E_ARGUMENT, "error %g, expected a positive number", tolerance);
    if (settings->slices < 2)
        return ad_fail(error, AD_E_ARGUMENT, "%zu slices, expected 2 or more", settings->slices);
    if (settings->ends && settings->ends->free_time && phys_lacks_energy(system, error))
        return error->status;
    struct phys_climb c = {
        .system = system,
        .guess = guess,
        .given = {&phys_rule_left, settings->slices, settings->dt, settings->mesh},
        .adam_steps = settings->adam_steps,
        .time = (double)(settings->slices - 1) * settings->dt,
        .tolerance = tolerance,
        .ends_error = ends_error,
        .before.distance = NAN,
        .to = refined};
    refined->finer = (double)NAN;
    refined->settings = malloc(sizeof *refined->settings);
    if (!refined->settings)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *refined->settings = *settings;
    refined->settings->progress = NULL;
    refined->settings->reference = refined->settings->compare = NULL;
    refined->settings->refined = NULL;
    refined->settings->start_momentum = NULL;
    refined->settings->tolerance = 0;
    refined->settings->hold = 0;
    if (find_derivatives(refined, system, settings, error) == AD_OK &&
        climb_all(&c, settings->rule, error) == AD_OK) {
        refined->start = c.here.start;
        refined->path = c.here.path;
        refined->mesh = c.here.mesh;
        c.here.start = c.here.path = c.here.mesh = NULL;
    }
    refined->settings->mesh = refined->mesh;
    phys_newton_free(&c.newton);
    drop(&c.before);
    drop(&c.here);
    AD_FREE(c.unit, c.approach);
    return error->status;
}

void phys_refined_free(struct phys_refined *refined)
{
    if (!refined)
        return;
    if (refined->of && !refined->borrowed) {
        phys_derivatives_free(refined->of);
        free(refined->of);
    }
    phys_spectrum_free(&refined->spectrum);
    AD_FREE(refined->settings, refined->start, refined->path, refined->mesh);
    *refined = (struct phys_refined){0};
}
