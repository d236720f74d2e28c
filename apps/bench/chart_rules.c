/* Rules of the action by order (chart_paths.h): the path between two points of a motion by Newton's
   method, compared with the motion; and the error that the published descent reaches there. */
#include "chart_paths.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FEWEST = 11, LEVELS = 9, SUBSTEPS = 800, ROUNDS = 3, N_BOUNDARIES = 3 };

/* Between the ends of a motion that starts where the scene does. */
static const struct boundary {
    const char *scene, *title;
    double time;
    bool published; /* the span of the paper: its descent is run too */
} boundaries[N_BOUNDARIES] = {
    {"pendulum", "Pendulum, a whole swing (index 1)", 99, true},
    {"dblpend", "Double pendulum, to t = 11.94 (index 6)", 11.94, true},
    {"kepler", "Half a Kepler orbit, e = 0.6", M_PI, false},
};

static const struct column columns[] = {
    {.key = "scene", .title = "scene", .width = -9},
    {.key = "solver", .title = "solver", .width = -7},
    {.key = "rule", .title = "rule", .width = -12},
    {.key = "slices", .title = "slices", .width = 6, .shown = 6},
    {.key = "seconds", .title = "CPU time (ms)", .width = 13, .shown = 3, .scale = 1e3},
    {.key = "error", .title = "error", .width = 9, .shown = 2},
    {.key = NULL},
};

struct problem {
    const struct boundary *boundary;
    struct phys_system system;
    struct sheet *sheet;
    double error; /* of the row measured last */
};

/* ---- the motion at the slices, by gauss5 ---- */

/* path [dof x slices] */
static enum ad_status motion_at(const struct problem *problem, size_t slices, double *path,
                                struct ad_error *error)
{
    size_t dof = problem->system.dof, each = (SUBSTEPS + slices - 2) / (slices - 1);
    struct phys_simulation s = {.size = sizeof s,
                                .integrator = phys_integrator_find("gauss5", error),
                                .t1 = problem->boundary->time,
                                .every = each};
    struct phys_ode ode = {0};
    double *q = malloc(4 * dof * sizeof *q), *y = q ? q + 2 * dof : NULL;
    s.dt = s.t1 / (double)(each * (slices - 1));
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ode_canonical(&problem->system, &ode, error) == AD_OK &&
        problem->system.scene->start(problem->system.params, 0, q, q + dof, error) == AD_OK &&
        phys_ode_enter(&ode, 0, q, q + dof, y, error) == AD_OK)
        phys_trajectory(&s, &ode, y, dof, slices, path, NULL, error);
    phys_ode_free(&ode);
    free(q);
    return error->status;
}

/* ---- one path ---- */

/* Moves the slices between the ends by a smooth bump of a hundredth of the path's size. */
static void disturb(size_t dof, size_t slices, double *path)
{
    for (size_t k = 0; k < dof; k++) {
        double size = 0;
        for (size_t i = 0; i < slices; i++)
            size = fmax(size, fabs(path[k * slices + i]));
        for (size_t i = 0; i < slices; i++)
            path[k * slices + i] += 0.01 * size * sin(M_PI * (double)i / (double)(slices - 1));
    }
}

/* Solves from the motion, disturbed by a bump or by the published noise; the median of a few times.
 */
static enum ad_status measure(struct problem *problem, const char *solver,
                              const struct phys_noise *noise,
                              const struct phys_path_settings *settings, size_t rounds,
                              struct ad_error *error)
{
    const struct phys_system *system = &problem->system;
    size_t slices = settings->slices, n = system->dof * slices, whole = n * settings->rule->degree;
    double *motion = malloc((n + 2 * whole) * sizeof *motion), seconds[ROUNDS];
    struct phys_path_info info;
    if (!motion)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *start = motion + n, *path = start + whole;
    if (motion_at(problem, slices, motion, error) == AD_OK) {
        memcpy(start, motion, n * sizeof *start);
        if (noise)
            phys_noise_add(noise, system, slices, 1, start);
        else
            disturb(system->dof, slices, start);
        phys_rule_interpolate(settings->rule, system->dof, slices, start);
    }
    for (size_t r = 0; r < rounds && error->status == AD_OK; r++) {
        memcpy(path, start, whole * sizeof *path);
        double before = processor_seconds();
        phys_path_solve(phys_solver_find(solver, error), system, settings, path, &info, error);
        seconds[r] = processor_seconds() - before;
    }
    if (error->status == AD_OK) {
        problem->error = phys_relative_distance(n, path, motion);
        sheet_row(problem->sheet,
                  ROW(NAME(problem->boundary->scene), NAME(solver), NAME(settings->rule->name),
                      NUMBER(slices), NUMBER(time_median(rounds, seconds)), NUMBER(problem->error)),
                  error);
    }
    free(motion);
    return error->status;
}

static enum ad_status newton_point(struct problem *problem, const struct phys_rule *rule,
                                   size_t slices, size_t rounds, struct ad_error *error)
{
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = rule,
                                                .slices = slices,
                                                .steps = 50,
                                                .dt =
                                                    problem->boundary->time / (double)(slices - 1),
                                                .learning_rate = 1e-2,
                                                .threads = 1};
    return measure(problem, "newton", NULL, &settings, rounds, error);
}

/* The published descent: its rule, steps, rate and noise. */
static enum ad_status adam_point(struct problem *problem, size_t rounds, struct ad_error *error)
{
    const struct phys_preset *paper = problem->system.scene->paper;
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = phys_rule_find("left+repeat", error),
                                                .slices = paper->slices,
                                                .steps = paper->steps,
                                                .dt = paper->dt,
                                                .learning_rate = paper->learning_rate,
                                                .energy_weight = paper->energy_weight,
                                                .threads = 1};
    return measure(problem, "adam", &paper->noise, &settings, rounds, error);
}

/* ---- all ---- */

static enum ad_status measure_rules(struct problem *problem, bool quick, struct ad_error *error)
{
    static const double rounding = 1e-12;
    size_t levels = quick ? 5 : LEVELS, rounds = quick ? 1 : ROUNDS;
    if (phys_system_open(problem->boundary->scene, &problem->system, error) != AD_OK)
        return error->status;
    for (const struct phys_rule *const *rule = phys_rules; *rule; rule++) {
        problem->error = INFINITY;
        for (size_t level = 0; level < levels && problem->error >= rounding; level++)
            if (newton_point(problem, *rule, (FEWEST - 1) * ((size_t)1 << level) + 1, rounds,
                             error) != AD_OK)
                return error->status;
    }
    return problem->boundary->published ? adam_point(problem, rounds, error) : AD_OK;
}

/* Slope of the last stretch above rounding; NaN if there is none. */
static double order(const struct sheet *sheet, const char *scene, const char *rule)
{
    double result = NAN, error = INFINITY, slices = NAN;
    for (size_t r = 0; r < sheet->rows; r++) {
        if (!sheet_is(sheet, r, "scene", scene) || !sheet_is(sheet, r, "rule", rule) ||
            !sheet_is(sheet, r, "solver", "newton"))
            continue;
        double e = sheet_number(sheet, r, "error"), n = sheet_number(sheet, r, "slices") - 1;
        if (e > 1e-11 && error < 0.3)
            result = log(error / e) / log(n / slices);
        error = e, slices = n;
    }
    return result;
}

static void report(struct chart *chart, const struct sheet *sheet, const struct boundary *boundary)
{
    json_object(&chart->json, boundary->scene);
    for (const struct phys_rule *const *rule = phys_rules; *rule; rule++) {
        double is = order(sheet, boundary->scene, (*rule)->name);
        json_number(&chart->json, (*rule)->name, is);
        if (!chart->quiet)
            printf("%s%s %.2f", rule == phys_rules ? "measured order: " : ", ", (*rule)->name, is);
    }
    json_end_object(&chart->json);
    if (!chart->quiet)
        puts("");
}

/* ---- the picture: above errors over slices, below over seconds; a column a boundary ---- */

static void draw_panel(struct figure *figure, const struct sheet *sheet, size_t p, bool below)
{
    static const char *const colours[] = {"#9a9a9a", "#6b6b6b", "#e69f00", "#d1622b",
                                          "#8fc7e8", "#56b4e9", "#0b4f8a", "#4d1654"};
    const char *scene = boundaries[p].scene, *x = below ? "seconds" : "slices";
    size_t k = 0;
    figure_panel(
        figure,
        &(struct panel){.title = below ? NULL : boundaries[p].title,
                        .x = below ? "CPU time (s)" : "slices",
                        .y = p ? NULL : "relative error of the path",
                        .log = "xy",
                        .x_range = below ? NULL : "[10:3000]",
                        .x_tics =
                            below ? NULL : "('11' 11, '41' 41, '161' 161, '641' 641, '2561' 2561)",
                        .y_range = "[1e-14:3]",
                        .y_tics = "100",
                        .key = p == 0 && !below ? LEGEND_RIGHT : NULL});
    for (const struct phys_rule *const *rule = phys_rules; *rule; rule++, k++) {
        char title[64];
        snprintf(title, sizeof title, "%s: order %.2f", (*rule)->name,
                 order(sheet, boundaries[N_BOUNDARIES - 1].scene, (*rule)->name));
        figure_curve(figure, sheet, x, "error", title,
                     STYLE(colours[k % (sizeof colours / sizeof *colours)], 7, 1.8, 0.5), "scene",
                     scene, "rule", (*rule)->name);
    }
    figure_curve(figure, sheet, x, "error", "Adam as published", STYLE("#b8261b", 3, 0, 1.4),
                 "scene", scene, "solver", "adam");
}

enum ad_status chart_rules(struct chart *chart, struct ad_error *error)
{
    struct problem problem = {.sheet = chart_sheet(chart, "rules", columns, error)};
    struct plot *plot = chart_picture(chart, "rules", error);
    struct figure figure;
    for (size_t p = 0; p < N_BOUNDARIES && error->status == AD_OK; p++) {
        problem.boundary = &boundaries[p];
        if (measure_rules(&problem, chart->quick, error) == AD_OK)
            report(chart, problem.sheet, &boundaries[p]);
        phys_system_close(&problem.system);
    }
    if (error->status != AD_OK)
        return error->status;
    struct layout layout = figure_of_six;
    layout.title = "Rules of the action: error of the path over slices and CPU time";
    figure_begin(&figure, plot, &layout);
    for (size_t p = 0; p < 2 * N_BOUNDARIES; p++)
        draw_panel(&figure, problem.sheet, p % N_BOUNDARIES, p >= N_BOUNDARIES);
    figure_end(&figure);
    return AD_OK;
}
