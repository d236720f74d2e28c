/* leastaction path --tol E: compatible options, and the levels tried (path.h). */
#include "autodiff/free.h"
#include "path.h"
#include "apps/interrupt.h"
#include "physics/path/mesh.h"
#include "physics/path/path_units.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ALONG = 128, PASSES = 16 }; /* elements along a motion, and how often they are placed */
static const double PLACED = 2;    /* times more even elements are needed: they are placed well */

bool path_wants_tolerance(const struct path_options *options) { return !isnan(options->tolerance); }

double path_estimate(const struct path_run *run)
{
    const struct phys_refined *r = &run->refined;
    return r->n ? r->level[r->n - 1].estimate : (double)NAN;
}

enum ad_status path_check_tolerance(const struct path_run *run, struct ad_error *error)
{
    const struct path_options *options = run->options;
    const struct conflict rows[] = {
        {options->preset != NULL, "--tol does not go with --preset: its slices are fixed"},
        {path_wants_all(options), "--tol does not go with --all, --energy: it refines one path"},
        {strcmp(options->ends, "both") != 0,
         "--tol does not go with --ends start: it needs both ends"},
        {options->data != NULL, "--tol does not go with --data: observations have slices of their "
                                "own; simulate ephemeris --data DIR --tol KM "
                                "finds the least model"},
        {options->reference != NULL, "--tol does not go with --reference: the rows of the file are "
                                     "slices of their own; compare the --csv of the run"},
        {options->hold != 1, "--tol does not go with --hold: it chooses the slices"},
        {!isnan(options->grad_tolerance),
         "--tol does not go with --grad-tol: every level is solved to rounding"},
    };
    if (options_conflicts(sizeof rows / sizeof *rows, rows, error) != AD_OK)
        return error->status;
    if (strcmp(run->solver->name, "newton") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--tol needs --solver newton, got %s; leave out --solver",
                       run->solver->name);
    return AD_OK;
}

/* The change of the start's ends when the motion is followed less accurately; 0 for ends from a
   file or by --start, --end. */
static double ends_error(const struct path_run *run, struct ad_error *error)
{
    size_t dof = run->system.dof, n = run->settings.slices;
    double most = 0, *ends = malloc(2 * dof * sizeof *ends), *unit = NULL;
    if (!ends)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (!path_from_file(run->options) && !run->given &&
             path_motion(run, 2, (double)(n - 1) * run->settings.dt, 10 * PATH_TIGHTEST, ends,
                         error) == AD_OK)
        unit = phys_path_units(&run->system, &run->settings, NULL, run->start, error);
    for (size_t k = 0; unit && k < 2 * dof; k++)
        most = fmax(most, fabs(ends[k] - run->start[k / 2 * n + k % 2 * (n - 1)]) / unit[k / 2]);
    AD_FREE(ends, unit);
    return most;
}

/* The motion at all nodes of a mesh: path [s*dof x slices]. */
static enum ad_status motion_on_mesh(const struct path_run *run, struct phys_grid grid,
                                     double *path, struct ad_error *error)
{
    struct phys_rule_table table;
    grid.rule->fill(grid.rule, &table);
    size_t s = table.degree, dof = run->system.dof, n = s * (grid.slices - 1) + 1;
    double dt = phys_grid_time(&grid, grid.slices - 1) / (double)(n - 1);
    double *times = malloc((dof + 1) * n * sizeof *times), *nodes = times + n;
    const struct phys_simulation how = {.size = sizeof how,
                                        .rtol = PATH_TIGHTEST,
                                        .max_steps = PHYS_MOTION_STEPS,
                                        .ode = run->settings.ode,
                                        .times = times + 1,
                                        .proceed = interrupt_proceed};
    if (!times)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t j = 0; j + 1 < n; j++) {
        double from = phys_grid_time(&grid, j / s), to = phys_grid_time(&grid, j / s + 1);
        times[j] = from + table.node[j % s] * (to - from);
    }
    times[n - 1] = (double)(n - 1) * dt;
    phys_scene_path(&run->system, run->options->common.seed, &how, n, dt, nodes, error);
    for (size_t k = 0; k < dof; k++)
        for (size_t j = 0; j < s * grid.slices; j++) /* the last column repeats the last slice */
            path[(j % s * dof + k) * grid.slices + j / s] = nodes[k * n + (j < n ? j : n - 1)];
    free(times);
    return error->status;
}

/* The run becomes that of the chosen level, about to be solved; its reference, the motion at the
   level's slices. */
static enum ad_status adopt(struct path_run *run, struct ad_error *error)
{
    struct phys_refined *r = &run->refined;
    const struct phys_rule *rule = r->settings->rule;
    size_t n = r->settings->slices, dof = run->system.dof;
    AD_FREE(run->start, run->path);
    run->start = r->start;
    r->start = NULL;
    run->settings.rule = rule;
    run->settings.slices = n;
    run->settings.dt = r->settings->dt;
    run->settings.mesh = r->settings->mesh;
    run->settings.adam_steps = r->settings->adam_steps;
    run->settings.refined = r;
    run->path = path_new(run, error);
    if (!run->path)
        return error->status;
    memcpy(run->path, run->start, rule->degree * dof * n * sizeof *run->path);
    if (!run->reference)
        return AD_OK;
    free(run->reference);
    run->reference = path_new(run, error);
    if (run->reference && run->settings.mesh)
        motion_on_mesh(run, phys_grid_of(&run->settings), run->reference, error);
    else if (run->reference &&
             path_motion(run, n, r->settings->dt, PATH_TIGHTEST, run->reference, error) == AD_OK)
        phys_rule_interpolate(rule, dof, n, run->reference);
    return error->status;
}

/* From the motion that the ends are of, on elements placed along it: a line, or the motion at even
   slices, may lead through a centre that it passes closely. */
static enum ad_status refine_along(struct path_run *run, struct phys_path_settings settings,
                                   double ends, struct ad_error *error)
{
    const size_t dof = run->system.dof, n = ALONG + 1;
    struct phys_grid grid = {phys_rule_find("gauss2", error), n,
                             (double)(settings.slices - 1) * settings.dt / ALONG, NULL};
    double gain = INFINITY,
           *unit = phys_path_units(&run->system, &settings, NULL, run->start, error);
    double *mesh = malloc((2 + 2 * dof) * n * sizeof *mesh);
    double *placed = mesh ? mesh + n : NULL, *path = mesh ? placed + n : NULL;
    if (!mesh)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (int k = 0; k < PASSES && gain > PLACED && error->status == AD_OK; k++) {
        if (motion_on_mesh(run, grid, path, error) == AD_OK &&
            phys_mesh_place(&grid, path, unit, dof, ALONG, placed, &gain, error) == AD_OK)
            memcpy(mesh, placed, n * sizeof *mesh);
        grid.mesh = mesh;
    }
    phys_refined_free(&run->refined);
    settings.slices = n;
    settings.dt = grid.dt;
    settings.mesh = mesh;
    settings.adam_steps = 0;
    if (error->status == AD_OK && motion_on_mesh(run, grid, path, error) == AD_OK)
        phys_path_refine(&run->system, &settings, path, ends, run->options->tolerance,
                         &run->refined, error);
    run->along = true;
    AD_FREE(unit, mesh);
    return error->status;
}

enum ad_status path_refine(struct path_run *run, struct ad_error *error)
{
    struct phys_path_settings settings = run->settings;
    struct ad_error lost = {0};
    double ends = ends_error(run, error);
    settings.rule = run->options->rule ? settings.rule : NULL;
    settings.proceed = interrupt_proceed;
    interrupt_catch();
    if (error->status == AD_OK && run->follow.name)
        phys_path_continue(&run->system, &settings, run->start, ends, run->options->tolerance,
                           &run->follow, &run->refined, &run->continued, &lost);
    else if (error->status == AD_OK)
        phys_path_refine(&run->system, &settings, run->start, ends, run->options->tolerance,
                         &run->refined, &lost);
    if (run->refined.singular && !run->follow.name && !run->given &&
        !path_from_file(run->options) && !(run->options->init && path_from_line(run->options))) {
        struct ad_error before = lost;
        lost = (struct ad_error){0};
        if (refine_along(run, settings, ends, &lost) == AD_E_ACCURACY && !interrupted()) {
            lost = before;
            run->refined.unsettled = false;
        }
    }
    if (lost.status != AD_OK)
        ad_fail(
            error, lost.status, "--%s: %s%s", run->follow.name ? "continue" : "tol", lost.message,
            run->refined.unsettled && !path_from_file(run->options) ? ": --init ode, --all" : "");
    return error->status == AD_OK ? adopt(run, error) : error->status;
}

void path_report_levels(const struct path_run *run, struct report *report)
{
    const struct phys_refined *r = &run->refined;
    const char *unit = run->system.scene->unit;
    char text[128];
    if (r->n == 0)
        return;
    report_line(report, "  tried, coarse to fine%s%s%s",
                run->along ? ", on elements along the motion" : "",
                r->approach ? ", from what was followed to these ends: " : "",
                r->approach ? r->approach : "");
    report_flag(report, "along_motion", NULL, run->along);
    report_text(report, "approach", NULL, r->approach ? r->approach : "the start given");
    for (size_t k = 0; k < r->n; k++) {
        const struct phys_level *level = &r->level[k];
        report_item(report, "tried");
        report_text(report, "rule", "rule", level->rule->name);
        report_count(report, "elements", "elements", level->elements);
        report_flag(report, "found", "path found", level->found);
        report->passing = true;
        report_number(report, "seconds", NULL, "s", level->seconds);
        report->passing = false;
        report_number(report, "estimate", "estimated error", unit, level->estimate);
    }
    report_item(report, NULL);
    snprintf(text, sizeof text, "%zu elements of %s: the first setting with an estimate under %g",
             r->level[r->n - 1].elements, run->settings.rule->name, run->options->tolerance);
    report_line(report, "  chosen: %s\n", text);
    report_text(report, "chosen", NULL, text);
    report_number(report, "error_estimate", NULL, unit, path_estimate(run));
}
