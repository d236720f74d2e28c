/* leastaction path --ends periodic: closed paths of a period or of an energy that is given, or the
   share of one after which alike bodies follow each other; and the periodic motion that the path
   is of, by Newton's method of its own (physics/stability/periodic.h), which is the reference. */
#include "apps/interrupt.h"
#include "apps/output/periodic.h"
#include "autodiff/clock.h"
#include "autodiff/free.h"
#include "path.h"
#include "physics/motion/method.h"
#include "physics/path/path_units.h"
#include "physics/stability/family.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DOUBLINGS = 6 };             /* of elements, for --tol */
static const double resting = 1e-6; /* of the extent of the start */

bool path_is_periodic(const struct path_options *options)
{
    return strcmp(options->ends, "periodic") == 0;
}

size_t path_shares(const struct path_run *run)
{
    return run->options->choreography ? run->system.bodies : 1;
}

enum ad_status path_periodic_check(const struct path_run *run, struct ad_error *error)
{
    const struct path_options *o = run->options;
    const struct conflict rows[] = {
        {!o->time || strcmp(o->time, "free") == 0,
         "--ends periodic needs --time T, the period, or, with --energy E, one near it"},
        {o->start || o->end || o->relate || o->data || o->preset || o->follow || o->all ||
             o->reference || o->hold != 1 || !isnan(o->grad_tolerance),
         "--ends periodic: not with --start, --end, --relate, --data, --preset, --continue, --all, "
         "--reference, --hold or --grad-tol; leave these out"},
        {run->solver && strcmp(run->solver->name, "newton") != 0,
         "--ends periodic needs --solver newton; leave out --solver"},
        {o->init && strcmp(o->init, "line") == 0,
         "--init line: no closed path begins with a line; expected ode, or FILE.csv with a closed "
         "curve"},
        {o->choreography && run->system.bodies < 2,
         "--choreography: expected a scene of two bodies or more"},
    };
    if (path_is_periodic(o) && run->system.dof > PHYS_PERIODIC_DOF)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--ends periodic: %s has %zu coordinates; expected at most %d",
                       run->system.scene->name, run->system.dof, PHYS_PERIODIC_DOF);
    if (!path_is_periodic(o))
        return o->choreography
                   ? ad_fail(error, AD_E_ARGUMENT, "--choreography needs --ends periodic")
                   : AD_OK;
    return options_conflicts(sizeof rows / sizeof *rows, rows, error);
}

/* ---- ends ---- */

enum ad_status path_periodic_ends(struct path_run *run, struct ad_error *error)
{
    const size_t dof = run->system.dof;
    run->given = malloc(2 * dof * sizeof *run->given);
    run->moves = malloc(2 * dof * sizeof *run->moves);
    run->relation = malloc(dof * (2 * dof + 1) * sizeof *run->relation);
    run->settings.start_momentum = malloc(dof * sizeof(double));
    if (!run->given || !run->moves || !run->relation || !run->settings.start_momentum)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < 2 * dof; k++) {
        run->given[k] = (double)NAN;
        run->moves[k] = true;
    }
    run->ends.free[0] = run->moves;
    run->ends.free[1] = run->moves + dof;
    run->ends.families = true;
    run->ends.n_relations = dof;
    run->ends.relation = run->relation;
    return AD_OK;
}

/* Each coordinate ends where the one of `turn` bodies further began: the sum of squares that the
   start leaves of that. */
static double relate(struct path_run *run, size_t turn)
{
    const size_t dof = run->system.dof, n = run->settings.slices, columns = 2 * dof + 1;
    double left = 0;
    memset(run->relation, 0, dof * columns * sizeof *run->relation);
    for (size_t k = 0; k < dof; k++) {
        const size_t from = (k + turn * run->system.dims) % dof;
        run->relation[k * columns + from] = -1;
        run->relation[k * columns + dof + k] = 1;
        left += pow(run->start[k * n + n - 1] - run->start[from * n], 2);
    }
    return left;
}

void path_periodic_relate(struct path_run *run)
{
    const size_t last = path_shares(run) - 1; /* the next body, or the one before */
    const double back = relate(run, last);
    if (last > 0 && relate(run, 1) > back)
        relate(run, last);
}

/* ---- the motion ---- */

/* q and v at the start of the path. */
static enum ad_status start_of(const struct path_run *run, double *x, struct ad_error *error)
{
    const size_t dof = run->system.dof, n = run->settings.slices;
    phys_legendre *legendre = NULL;
    for (size_t k = 0; k < dof; k++) {
        x[k] = run->path[k * n];
        x[dof + k] = (run->path[k * n + 1] - x[k]) / run->settings.dt;
    }
    if (run->settings.rule->order > 1 && phys_legendre_new(&run->system, &legendre, error) == AD_OK)
        phys_legendre_velocity(legendre, x, run->settings.start_momentum, 0, x + dof, error);
    phys_legendre_free(legendre);
    return error->status;
}

/* The periodic motion at the slices, over the time of the path. */
static enum ad_status follow(struct path_run *run, struct ad_error *error)
{
    const size_t dof = run->system.dof, n = run->settings.slices;
    struct phys_ode ode = {0};
    double *y = malloc(2 * dof * sizeof *y);
    free(run->reference);
    run->reference = path_new(run, error);
    if (!y)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (run->reference && phys_ode_lagrangian(&run->system, &ode, error) == AD_OK &&
             phys_ode_enter(&ode, 0, run->periodic.x, run->periodic.x + dof, y, error) == AD_OK) {
        const struct phys_simulation how = {.size = sizeof how,
                                            .integrator = phys_motion_method(&ode, y, error),
                                            .t1 = run->periodic.period / (double)path_shares(run),
                                            .n_samples = n - 1,
                                            .rtol = PATH_TIGHTEST,
                                            .max_steps = PHYS_MOTION_STEPS,
                                            .proceed = interrupt_proceed};
        if (how.integrator &&
            phys_trajectory(&how, &ode, y, dof, n, run->reference, NULL, error) == AD_OK)
            phys_rule_interpolate(run->settings.rule, dof, n, run->reference);
    }
    phys_ode_free(&ode);
    free(y);
    return error->status;
}

/* The motion of the energy asked for in the family of the one near x. */
static enum ad_status follow_energy(struct path_run *run, const double *x, double period,
                                    struct ad_error *error)
{
    const double energy = run->options->energy;
    const struct phys_family_settings how = {.size = sizeof how,
                                             .x = x,
                                             .period = period,
                                             .along = "energy",
                                             .to = energy,
                                             .proceed = interrupt_proceed};
    struct phys_family family;
    if (phys_family_follow(&run->system, &how, &family, error) == AD_OK) {
        struct phys_family_member *last = &family.member[family.n - 1];
        if (family.end != PHYS_FAMILY_REACHED)
            ad_fail(error, AD_E_ACCURACY, "its family was followed to energy %.9g only",
                    last->energy);
        run->periodic = last->motion;
        last->motion = (struct phys_periodic){0};
    }
    phys_family_free(&family);
    return error->status;
}

/* The motion from which the path is, of its period or of the energy asked for. */
static enum ad_status find(struct path_run *run, bool of_energy, struct ad_error *error)
{
    const struct path_options *o = run->options;
    const double slices = (double)(run->settings.slices - 1);
    double *x = malloc(2 * run->system.dof * sizeof *x);
    const struct phys_periodic_settings how = {.size = sizeof how,
                                               .x = x,
                                               .period = slices * run->settings.dt *
                                                         (double)path_shares(run),
                                               .hold_period = !of_energy,
                                               .hold_energy = of_energy,
                                               .energy = of_energy ? &o->energy : NULL,
                                               .proceed = interrupt_proceed,
                                               .choreography = o->choreography};
    struct ad_error far = {0};
    phys_periodic_free(&run->periodic);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (start_of(run, x, error) == AD_OK &&
        phys_periodic_find(&run->system, &how, &run->periodic, &far) != AD_OK) {
        phys_periodic_free(&run->periodic);
        if (!of_energy || o->choreography || far.status != AD_E_ACCURACY)
            *error = far;
        else
            follow_energy(run, x, how.period, error);
    }
    if (error->status == AD_OK)
        run->settings.dt = run->periodic.period / (double)path_shares(run) / slices;
    free(x);
    return error->status;
}

/* A path at rest closes, too. */
static enum ad_status refuse_rest(const struct path_run *run, struct ad_error *error)
{
    const size_t dof = run->system.dof, n = run->settings.slices;
    double *unit = phys_path_units(&run->system, &run->settings, NULL, run->start, error);
    if (unit && phys_path_extent(unit, run->path, dof, n) <
                    resting * phys_path_extent(unit, run->start, dof, n))
        ad_fail(error, AD_E_ACCURACY,
                "--ends periodic: the path found is at rest; try another --init or --time, nearer "
                "to a motion");
    free(unit);
    return error->status;
}

enum ad_status path_periodic_solve(struct path_run *run, struct phys_path_info *info,
                                   struct ad_error *error)
{
    const size_t rows = run->settings.rule->degree * run->system.dof;
    struct ad_error cause = {0};
    if (phys_path_solve(run->solver, &run->system, &run->settings, run->path, info, error) != AD_OK)
        return error->status;
    if (info->stop == PHYS_STOP_INTERRUPTED)
        return ad_fail(error, AD_E_ACCURACY, "interrupted after step %zu", info->steps);
    if (refuse_rest(run, error) != AD_OK)
        return error->status;
    if (find(run, !isnan(run->options->energy), &cause) != AD_OK)
        return ad_fail(error, cause.status,
                       "--ends periodic: from a path with |gradient| %.3g: %.400s", info->grad_norm,
                       cause.message);
    if (follow(run, error) == AD_OK)
        memcpy(run->path, run->reference, rows * run->settings.slices * sizeof *run->path);
    run->settings.adam_steps = 0;  /* the path is found, */
    run->settings.progress = NULL; /* and its steps are recorded */
    return error->status;
}

/* From the motion nearest to it: where there are families the path may be of another one. */
enum ad_status path_periodic_compare(struct path_run *run, const struct phys_path_info *info,
                                     struct ad_error *error)
{
    const size_t dof = run->system.dof, n = run->settings.slices;
    double *unit = NULL;
    if (find(run, false, error) == AD_OK && follow(run, error) == AD_OK)
        unit = phys_path_units(&run->system, &run->settings, NULL, run->start, error);
    if (!unit)
        return error->status;
    run->off = phys_path_apart(unit, run->path, run->reference, dof, n);
    free(unit);
    run->found.info.start = info->start;
    run->found.info.steps = info->steps;
    run->found.reference_distance = run->found.discretisation = run->off;
    run->reference_is = "the periodic motion";
    return refuse_rest(run, error);
}

/* ---- --tol ---- */

/* The path on twice as many elements. */
static enum ad_status finer(struct path_run *run, struct ad_error *error)
{
    const struct phys_grid from = phys_grid_of(&run->settings);
    run->settings.slices = 2 * from.slices - 1;
    run->settings.dt = from.dt / 2;
    const struct phys_grid to = phys_grid_of(&run->settings);
    double *path = phys_path_resample(&from, run->path, &to, run->system.dof, error);
    double *start = phys_path_resample(&from, run->start, &to, run->system.dof, error);
    AD_FREE(run->path, run->start);
    run->path = path;
    run->start = start;
    return error->status;
}

/* Whether the path on these elements is stationary, and how far it is from the motion. */
static enum ad_status try(struct path_run *run, struct phys_level *level, struct ad_error *error)
{
    const double began = ad_now();
    struct phys_path_info first, info;
    *level = (struct phys_level){run->settings.rule, run->settings.slices - 1, false, NAN, 0};
    if (path_periodic_solve(run, &first, error) != AD_OK ||
        phys_path_solve(run->solver, &run->system, &run->settings, run->path, &info, error) !=
            AD_OK ||
        path_periodic_compare(run, &first, error) != AD_OK)
        return error->status;
    level->found = info.stop == PHYS_STOP_ROUNDING;
    level->estimate = level->found ? run->off : NAN;
    level->seconds = ad_now() - began;
    return AD_OK;
}

enum ad_status path_periodic_refine(struct path_run *run, struct ad_error *error)
{
    struct phys_refined *r = &run->refined;
    interrupt_catch();
    run->settings.proceed = interrupt_proceed;
    while (try(run, &r->level[r->n++], error) == AD_OK && r->n <= DOUBLINGS &&
           !(r->level[r->n - 1].estimate <= run->options->tolerance))
        if (finer(run, error) != AD_OK)
            break;
    const struct phys_level *last = &r->level[r->n - 1];
    if (error->status == AD_OK && !(last->estimate <= run->options->tolerance))
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g is not met by %zu elements of %s: the periodic motion is %.2g away",
                run->options->tolerance, last->elements, last->rule->name, last->estimate);
    return error->status;
}

/* ---- results ---- */

enum ad_status path_periodic_judge(const struct path_run *run, struct ad_error *error)
{
    if (run->options->tolerance < run->off)
        ad_fail(error, AD_E_ACCURACY,
                "--tol %g is not met: the periodic motion is %.2g away; allow a larger error, or "
                "try more --slices or another --rule",
                run->options->tolerance, run->off);
    return error->status;
}

void path_periodic_report(const struct path_run *run, struct report *report)
{
    report_line(report, "  the periodic motion, by shooting from the path:");
    report_periodic(&run->system, &run->periodic, report);
    if (run->options->choreography)
        report_line(report, "  the path is a share of it, after which bodies follow each other");
}
