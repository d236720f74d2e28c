/* leastaction path --tol E: the coarsest setting that meets an error. Elements are doubled, between
   the same ends and over the same time; what a path errs is estimated from its distance to the one
   before, at the slices of both.

   With d that distance and d' the one before it, errors fall by r = d'/d a level, at most by 2^p of
   a rule of order p; the finer path then errs d/(r - 1). Where r says nothing yet, d itself is
   taken: the error of the coarser path. */
#include "path_stage.h"
#include "apps/interrupt.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COARSEST = 4, FINEST = 1 << 14, UNSETTLED = 1 << 9 }; /* elements */

static const double caution = 2;      /* the law of convergence holds in the limit */
static const double fine = 1e-7;      /* of the path's size: where rounding may stop the fall */
static const double tightest = 1e-13; /* of the motion that gives ends and reference */
static const double falling = 0.7;    /* of the distance, from level to level, at the least */

/* Without --rule: cheap elements while few will do, then those of high order. */
static const struct rung {
    const char *rule;
    size_t first, last;
} ladder[] = {{"gauss2", COARSEST, 32}, {"gauss4", 8, FINEST}};

/* Largest distance at the slices of the coarser path. */
static double distance(const struct stage *coarse, const struct stage *finer, size_t dof)
{
    size_t n = coarse->grid.slices, m = finer->grid.slices;
    double most = 0;
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < n; i++)
            most = fmax(most, fabs(coarse->path[k * n + i] - finer->path[k * m + 2 * i]));
    return most;
}

/* What no refinement removes: the error of the ends, and rounding in every element. */
static double rounding(const struct refinement *r, size_t elements)
{
    return r->ends_error + DBL_EPSILON * r->size * (double)elements;
}

static double estimate(const struct refinement *r, const struct path_level *level)
{
    double d = r->here.distance, fall = r->before.distance / d;
    double most = pow(2, (double)level->rule->order);
    double error = fall > 2 ? caution * d / (fmin(fall, most) - 1) : d;
    return isnan(d) ? d : fmax(fmin(error, d), rounding(r, level->elements));
}

static double largest(const struct stage *stage, size_t dof)
{
    double most = 0;
    for (size_t k = 0; k < dof * stage->grid.slices; k++)
        most = fmax(most, fabs(stage->path[k]));
    return most;
}

static void compare(struct refinement *r, struct path_level *level)
{
    size_t dof = r->run->system.dof;
    const struct phys_grid *before = &r->before.grid;
    r->here.distance = NAN;
    level->estimate = NAN;
    if (!level->found)
        return;
    r->size = largest(&r->here, dof);
    if (r->before.path && before->rule == level->rule && 2 * before->slices == level->elements + 2)
        r->here.distance = distance(&r->before, &r->here, dof);
    level->estimate = estimate(r, level);
}

/* The distances do not fall any more, and are small. */
static bool at_rounding(const struct refinement *r, const struct path_level *level, double E)
{
    return rounding(r, level->elements) > E || (r->before.distance <= fine * r->size &&
                                                r->here.distance > falling * r->before.distance);
}

/* True when the climb is over, one way or the other. */
static bool climb(struct refinement *r, const struct phys_rule *rule, size_t elements,
                  struct ad_error *error)
{
    struct path_run *run = r->run;
    double E = run->options->tolerance;
    struct path_level *level = &run->level[run->n_levels++];
    *level = (struct path_level){.rule = rule, .elements = elements};
    r->here.grid = (struct phys_grid){rule, elements + 1, r->time / (double)elements};
    if (stage_solve(r, level, error) != AD_OK)
        return true;
    compare(r, level);
    level->chosen = level->estimate < E;
    if (level->chosen)
        return true;
    if (level->found && at_rounding(r, level, E)) {
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g is out of reach: rounding takes over at %zu elements of %s, error about "
                "%.2g; allow a larger error",
                E, elements, rule->name, fmax(level->estimate, rounding(r, elements)));
        return true;
    }
    if (elements >= UNSETTLED && !stage_settled(r, &r->here)) {
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g: up to %zu elements of %s do not agree on a path, which may be one of "
                "several; try %s, or a shorter time",
                E, elements, rule->name,
                path_from_file(run->options) ? "--adam-steps 500" : "--init ode");
        return true;
    }
    stage_free(&r->before);
    if (level->found)
        r->before = r->here;
    else
        stage_free(&r->here);
    r->here = (struct stage){.distance = (double)NAN};
    return false;
}

static enum ad_status climb_all(struct refinement *r, struct ad_error *error)
{
    const struct path_options *options = r->run->options;
    const struct rung fixed = {options->rule, COARSEST, FINEST};
    const struct rung *rungs = options->rule ? &fixed : ladder;
    size_t n = options->rule ? 1 : sizeof ladder / sizeof *ladder;
    const struct path_level *last = r->run->level;
    for (size_t k = 0; k < n; k++) {
        const struct phys_rule *rule = phys_rule_find(rungs[k].rule, error);
        for (size_t elements = rungs[k].first; elements <= rungs[k].last; elements *= 2) {
            last = &r->run->level[r->run->n_levels];
            if (climb(r, rule, elements, error))
                return error->status;
        }
    }
    return ad_fail(error, AD_E_ACCURACY,
                   "--tol %g is out of reach: %zu elements of %s come to %.2g; allow a larger "
                   "error or take another --rule",
                   options->tolerance, last->elements, last->rule->name, last->estimate);
}

/* ---- before and after ---- */

/* The first and last row of a file, else those of the motion, and how far they move when it is
   followed less closely. */
static enum ad_status find_ends(struct refinement *r, struct ad_error *error)
{
    const struct path_run *run = r->run;
    size_t dof = run->system.dof, n = r->given.slices;
    r->ends = malloc(4 * dof * sizeof *r->ends);
    if (!r->ends)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (path_from_file(run->options)) {
        for (size_t k = 0; k < dof; k++) {
            r->ends[2 * k] = run->start[k * n];
            r->ends[2 * k + 1] = run->start[k * n + n - 1];
        }
        return AD_OK;
    }
    double *looser = r->ends + 2 * dof;
    if (path_motion(run, 2, r->time, 10 * tightest, looser, error) == AD_OK &&
        path_motion(run, 2, r->time, tightest, r->ends, error) == AD_OK)
        for (size_t k = 0; k < 2 * dof; k++)
            r->ends_error = fmax(r->ends_error, fabs(r->ends[k] - looser[k]));
    return error->status;
}

/* The run becomes that of the chosen level, about to be solved; its reference, the motion at the
   level's slices. */
static enum ad_status adopt(struct refinement *r, struct ad_error *error)
{
    struct path_run *run = r->run;
    const struct phys_grid *grid = &r->here.grid;
    size_t rows = grid->rule->degree * run->system.dof;
    double *reference = NULL;
    if (run->reference) {
        reference = malloc(rows * grid->slices * sizeof *reference);
        if (!reference)
            return ad_fail(error, AD_E_MEMORY, "out of memory");
        if (path_motion(run, grid->slices, grid->dt, tightest, reference, error) == AD_OK)
            phys_rule_interpolate(grid->rule, run->system.dof, grid->slices, reference);
    }
    free(run->reference);
    free(run->start);
    free(run->path);
    run->reference = reference;
    run->start = r->here.start;
    run->path = r->here.path;
    memcpy(run->path, run->start, rows * grid->slices * sizeof *run->path);
    r->here.start = r->here.path = NULL;
    run->settings.rule = grid->rule;
    run->settings.slices = grid->slices;
    run->settings.dt = grid->dt;
    run->settings.adam_steps = r->here.adam_steps;
    return error->status;
}

enum ad_status path_refine(struct path_run *run, struct ad_error *error)
{
    const struct phys_path_settings *settings = &run->settings;
    struct refinement r = {.run = run,
                           .given = {phys_rule_find("left", error), settings->slices, settings->dt},
                           .time = (double)(settings->slices - 1) * settings->dt,
                           .before.distance = NAN};
    interrupt_catch();
    if (find_ends(&r, error) == AD_OK && climb_all(&r, error) == AD_OK)
        adopt(&r, error);
    stage_free(&r.before);
    stage_free(&r.here);
    free(r.ends);
    return error->status;
}
