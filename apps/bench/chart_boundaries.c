/* Paths to an error (chart_paths.h): phys_path_refine from a straight line between two points of a
   motion, over tolerances. CPU time contains the verification, and with the first path the
   recording of L, which the others have at hand; errors are against the motion by an adaptive
   integrator, which no rule of the action shares. */
#include "chart_paths.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>

enum { ROUNDS = 5, N_PROBLEMS = 6 };
static const double TIGHT = 1e-13, ROUGH = 1e-12; /* of the motion, and of its uncertainty */
static const double LEAST = 2e-11;                /* error asked for */

/* From the scene's start; each so short that the line leads to the motion. */
static const struct problem {
    const char *scene;
    double time;
} problems[N_PROBLEMS] = {
    {"pendulum", 40},  {"dblpend", 2}, {"kepler", 2.5},
    {"threebody", 20}, {"figure8", 1}, {"pythagorean", 1.5},
};

static const struct column columns[] = {
    {.key = "problem", .title = "problem", .width = -12},
    {.key = "method"},
    {.key = "tol", .title = "asked", .width = 8, .shown = 1},
    {.key = "rule", .title = "rule", .width = -7},
    {.key = "elements", .title = "elements", .width = 8, .shown = 4},
    {.key = "seconds", .title = "CPU time (ms)", .width = 13, .shown = 3, .scale = 1e3},
    {.key = "first", .title = "with recording", .width = 14, .shown = 3, .scale = 1e3},
    {.key = "estimate", .title = "estimate", .width = 9, .shown = 2},
    {.key = "largest", .title = "largest error", .width = 13, .shown = 2},
    {.key = "error", .title = "relative error", .width = 14, .shown = 2},
    {.key = NULL},
};

/* The motion of the problem at the slices of a path: [dof x slices], to be freed. */
static double *motion_at(const struct phys_system *system, double time, double rtol, size_t slices,
                         struct ad_error *error)
{
    const struct phys_simulation how = {.size = sizeof how, .rtol = rtol};
    double *motion = malloc(system->dof * slices * sizeof *motion);
    if (!motion)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        phys_scene_path(system, 0, &how, slices, time / (double)(slices - 1), motion, error);
    return motion;
}

/* The row of a refined path. An error beyond its estimate and what the motion is known to is
 * missed.
 */
static enum ad_status add_row(struct chart *chart, struct sheet *sheet,
                              const struct phys_system *system, const struct problem *problem,
                              double tol, const double *seconds, const struct phys_refined *refined,
                              struct ad_error *error)
{
    const struct phys_level *level = &refined->level[refined->n - 1];
    size_t slices = refined->settings->slices, n = system->dof * slices;
    double *motion = motion_at(system, problem->time, TIGHT, slices, error);
    double *rough = motion_at(system, problem->time, ROUGH, slices, error);
    if (error->status == AD_OK) {
        double most = phys_farthest(n, refined->path, motion);
        if (!(most <= level->estimate + phys_farthest(n, motion, rough)))
            chart->missed = "a path errs by more than was estimated";
        sheet_row(sheet,
                  ROW(NAME(problem->scene), NAME("path"), NUMBER(tol), NAME(level->rule->name),
                      NUMBER(level->elements), NUMBER(seconds[1]), NUMBER(seconds[0]),
                      NUMBER(level->estimate), NUMBER(most),
                      NUMBER(phys_relative_distance(n, refined->path, motion))),
                  error);
    }
    free(motion);
    free(rough);
    return error->status;
}

/* At a tolerance relative to the largest coordinate of the ends [dof x 2]. */
static enum ad_status measure(struct chart *chart, struct sheet *sheet,
                              const struct phys_system *system, const struct problem *problem,
                              const double *ends, double tol, struct ad_error *error)
{
    struct phys_path_settings settings = phys_path_defaults(system);
    struct phys_refined refined[2] = {{0}}; /* the second has the recording of the first */
    double seconds[2][ROUNDS], absolute = tol * phys_largest(2 * system->dof, ends), median[2];
    size_t rounds = chart->quick ? 1 : ROUNDS;
    settings.rule = NULL;
    settings.slices = 2;
    settings.dt = problem->time;
    settings.adam_steps = 200; /* as leastaction path from a line */
    for (size_t r = 0; r < 2 * rounds && error->status == AD_OK; r++) {
        const size_t k = r % 2;
        phys_refined_free(&refined[1]);
        if (k == 0)
            phys_refined_free(&refined[0]);
        settings.refined = k ? &refined[0] : NULL;
        double before = processor_seconds();
        phys_path_refine(system, &settings, ends, 0, absolute, &refined[k], error);
        seconds[k][r / 2] = processor_seconds() - before;
    }
    for (size_t k = 0; k < 2; k++)
        median[k] = time_median(rounds, seconds[k]);
    if (error->status == AD_OK)
        add_row(chart, sheet, system, problem, tol, median, &refined[1], error);
    phys_refined_free(&refined[1]);
    phys_refined_free(&refined[0]);
    return error->status;
}

enum ad_status chart_boundaries(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "boundaries", columns, error);
    struct plot *plot = chart_picture(chart, "boundaries", error);
    const double factor = chart->quick ? 1e-3 : 1e-1;
    for (const struct problem *p = problems; p < problems + N_PROBLEMS; p++) {
        struct phys_system system = {0};
        double *ends = NULL;
        if (error->status == AD_OK && phys_system_open(p->scene, &system, error) == AD_OK)
            ends = motion_at(&system, p->time, TIGHT, 2, error);
        for (double tol = 1e-2; tol > LEAST && error->status == AD_OK; tol *= factor)
            measure(chart, sheet, &system, p, ends, tol, error);
        free(ends);
        phys_system_close(&system);
    }
    if (error->status != AD_OK)
        return error->status;
    struct figure figure;
    struct layout layout = figure_pair;
    layout.title =
        "Paths from a straight line: CPU time to an error, and errors of what was asked for";
    figure_begin(&figure, plot, &layout);
    for (int panel = 0; panel < 2; panel++) {
        figure_panel(&figure, &(struct panel){.x = panel ? "error asked for" : "relative error",
                                              .y = panel ? "relative error" : "CPU time (s)",
                                              .log = "xy",
                                              .x_range = "[1e-14:1]",
                                              .x_tics = "1e4",
                                              .y_range = panel ? "[1e-14:1]" : NULL,
                                              .y_tics = panel ? "1e4" : NULL,
                                              .key = panel ? NULL : KEY_BESIDE});
        for (size_t p = 0; p < N_PROBLEMS; p++)
            figure_curve(&figure, sheet, panel ? "tol" : "error", panel ? "error" : "seconds",
                         panel ? NULL : problems[p].scene, STYLE(figure_colours[p], 7, 1.8, 0.6),
                         "problem", problems[p].scene);
    }
    figure_element(&figure, "x with lines lc rgb '" COLOUR_REFERENCE "' notitle");
    figure_end(&figure);
    return AD_OK;
}
