/* Path solvers (chart_paths.h): distance from the stationary path of rule `left` over time, from
   the published noise; Newton's method beside the published descent and the paper's remedies. */
#include "chart_jobs.h"
#include "chart_paths.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SEED = 1, TRIAL_STEPS = 30 };

static const double closer = 1.12; /* seconds from one point that is kept to the next */

static const struct contest {
    const char *scene;
    size_t adam_steps; /* before newton and lbfgs, where the noise is too far for them */
    bool slow;         /* not in a quick chart */
} contests[] = {
    {"freebody", 0, false},    {"pendulum", 0, false}, {"dblpend", 0, false},
    {"threebody", 300, false}, {"gas", 500, true},     {"ephemeris", 0, false},
};

enum energy { FREE, AS_PUBLISHED, FROM_START, FROM_BEFORE };

static const struct solver {
    const char *name, *solver, *rule;
    size_t hold;
    enum energy energy;
    double momentum;
    const char *colour;
    double width;
} solvers[] = {
    {"Adam as published", "adam", "left+repeat", 1, AS_PUBLISHED, 0, "#b8261b", 3},
    {"Adam + 3 slices held", "adam", "left", 3, FREE, 0, "#d55e00", 1.6},
    {"Adam + energy penalty", "adam", "left", 1, FROM_START, 0, "#f2b134", 1.6},
    {"Adam + local energy penalty", "adam", "left", 1, FROM_BEFORE, 0, "#a8703a", 1.6},
    {"momentum descent", "sgd", "left", 1, FREE, 0.9, "#9a9a9a", 1.6},
    {"L-BFGS", "lbfgs", "left", 1, FREE, 0, "#56b4e9", 1.6},
    {"Newton", "newton", "left", 1, FREE, 0, "#0b4f8a", 3},
};

enum {
    N_CONTESTS = sizeof contests / sizeof *contests,
    N_SOLVERS = sizeof solvers / sizeof *solvers
};

struct scene_run {
    const struct contest *contest;
    struct phys_system system;
    size_t n; /* dof x slices */
    struct phys_path_settings settings;
    double *reference, *start, *path; /* [n] each */
    double energy;                    /* |T| + |V|, means of the reference */
};

/* ---- reference and start ---- */

static bool take_energy(void *context, const struct phys_path_step *step)
{
    struct scene_run *run = context;
    if (step->step == 0)
        run->energy = fabs(step->kinetic_mean) + fabs(step->potential_mean);
    return true;
}

/* The motion of the published discretisation; where it is not stationary itself (velocities enter
   the forces), the stationary path nearby. */
static enum ad_status find_reference(struct scene_run *run, struct ad_error *error)
{
    const struct phys_preset *paper = run->system.scene->paper;
    size_t slices = paper->slices;
    struct phys_path_settings newton = run->settings;
    struct phys_path_info info;
    newton.rule = phys_rule_find("left", error);
    newton.steps = 50;
    newton.progress = take_energy;
    newton.context = run;
    if (phys_published_path(&run->system, SEED, slices, paper->dt, paper->euler_start, 1, NULL,
                            run->reference, error) == AD_OK) {
        memcpy(run->start, run->reference, run->n * sizeof *run->start);
        phys_noise_add(&paper->noise, &run->system, slices, SEED, run->start);
        phys_path_solve(phys_solver_find("newton", error), &run->system, &newton, run->reference,
                        &info, error);
    }
    return error->status;
}

static enum ad_status open_scene(struct scene_run *run, const struct contest *contest,
                                 struct ad_error *error)
{
    *run = (struct scene_run){.contest = contest};
    if (phys_system_open(contest->scene, &run->system, error) != AD_OK)
        return error->status;
    const struct phys_preset *paper = run->system.scene->paper;
    if (phys_system_set_all(&run->system, paper->n_set, paper->set, error) != AD_OK)
        return error->status;
    run->settings = (struct phys_path_settings){.size = sizeof(struct phys_path_settings),
                                                .slices = paper->slices,
                                                .steps = paper->steps,
                                                .dt = paper->dt,
                                                .learning_rate = paper->learning_rate,
                                                .threads = 1};
    run->n = run->system.dof * paper->slices;
    if (!(run->reference = malloc(3 * run->n * sizeof *run->reference)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    run->start = run->reference + run->n;
    run->path = run->start + run->n;
    return find_reference(run, error);
}

static void close_scene(struct scene_run *run)
{
    free(run->reference);
    phys_system_close(&run->system);
}

/* ---- a run, watched ---- */

struct watch {
    const struct scene_run *run;
    const char *scene, *solver;
    double began, away;  /* seconds: when the run began, spent here */
    double next;         /* seconds after which a point is kept */
    struct sheet *sheet; /* NULL: points are not kept */
    size_t steps;
    double seconds, error;  /* of the last step */
    double target, reached; /* seconds until the error first was no more than the target */
};

static void keep(struct watch *w)
{
    struct ad_error lost = {0};
    if (!w->sheet)
        return;
    sheet_row(w->sheet,
              ROW(NAME(w->scene), NAME(w->solver), NUMBER(w->steps), NUMBER(w->seconds),
                  NUMBER(w->error), NUMBER(fmax(w->error, 1e-17))),
              &lost);
    w->next = closer * w->seconds;
}

static bool watch(void *context, const struct phys_path_step *step)
{
    struct watch *w = context;
    double now = processor_seconds();
    w->seconds = now - w->began - w->away;
    w->steps = step->step;
    w->error = phys_relative_distance(w->run->n, step->path, w->run->reference);
    if (w->error <= w->target)
        w->reached = fmin(w->reached, w->seconds);
    if (w->seconds >= w->next)
        keep(w);
    w->away += processor_seconds() - now;
    return w->error < 1e6; /* paths this far away do not come back */
}

static bool no_worse(void *context, const struct phys_path_step *step)
{
    double *objective = context;
    if (step->step == 0)
        objective[0] = step->objective;
    objective[1] = step->objective;
    return isfinite(step->objective) && step->objective <= objective[0] + fabs(objective[0]);
}

/* The largest rate, by factors of two, at which plain descent does not climb. */
static double tuned_rate(struct scene_run *run, const struct phys_solver *solver,
                         struct phys_path_settings settings, struct ad_error *error)
{
    double objective[2] = {0, 0};
    settings.steps = TRIAL_STEPS;
    settings.progress = no_worse;
    settings.context = objective;
    for (double rate = 0x1p20; rate > 0x1p-300; rate /= 2) {
        struct phys_path_info info;
        struct ad_error lost = {0};
        settings.learning_rate = rate;
        memcpy(run->path, run->start, run->n * sizeof *run->path);
        phys_path_solve(solver, &run->system, &settings, run->path, &info, &lost);
        if (lost.status == AD_OK && info.stop == PHYS_STOP_STEPS && objective[1] < objective[0])
            return rate;
        if (lost.status != AD_OK && lost.status != AD_E_NONFINITE)
            ad_fail(error, lost.status, "%s", lost.message);
    }
    return settings.learning_rate;
}

static struct phys_path_settings settings_of(const struct scene_run *run, const struct solver *s,
                                             struct ad_error *error)
{
    struct phys_path_settings settings = run->settings;
    double slices = (double)settings.slices;
    bool descent = strcmp(s->solver, "adam") == 0 || strcmp(s->solver, "sgd") == 0;
    settings.rule = phys_rule_find(s->rule, error);
    settings.hold = s->hold;
    settings.momentum = s->momentum;
    settings.adam_steps = descent ? 0 : run->contest->adam_steps;
    /* energies of slices are divided by their number; this is about the published weight of the
       pendulum */
    settings.energy_weight = s->energy == FREE           ? 0
                             : s->energy == AS_PUBLISHED ? run->system.scene->paper->energy_weight
                                                         : slices * slices / run->energy;
    settings.energy_local = s->energy == FROM_BEFORE;
    return settings;
}

static enum ad_status run_solver(struct scene_run *run, const struct solver *s, struct watch *w,
                                 struct ad_error *error)
{
    const struct phys_solver *solver = phys_solver_find(s->solver, error);
    struct phys_path_settings settings = settings_of(run, s, error);
    struct phys_path_info info;
    struct ad_error lost = {0};
    if (strcmp(s->solver, "sgd") == 0)
        settings.learning_rate = tuned_rate(run, solver, settings, error);
    w->run = run;
    w->scene = run->contest->scene;
    w->solver = s->name;
    w->reached = INFINITY;
    settings.progress = watch;
    settings.context = w;
    memcpy(run->path, run->start, run->n * sizeof *run->path);
    w->began = processor_seconds();
    phys_path_solve(solver, &run->system, &settings, run->path, &info, &lost);
    keep(w);
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE)
        return ad_fail(error, lost.status, "%s: %s", run->contest->scene, lost.message);
    return error->status;
}

static const struct solver *solver_named(const char *name)
{
    const struct solver *s = solvers;
    while (strcmp(s->name, name) != 0)
        s++;
    return s;
}

enum ad_status jobs_paths(bool quick, struct job jobs[], size_t *n, struct ad_error *error)
{
    for (size_t k = 0; k < N_CONTESTS && error->status == AD_OK; k++) {
        struct scene_run run;
        struct watch adam = {0}, newton = {0};
        if (quick && contests[k].slow)
            continue;
        if (open_scene(&run, &contests[k], error) == AD_OK &&
            run_solver(&run, solver_named("Adam as published"), &adam, error) == AD_OK) {
            newton.target = adam.error;
            run_solver(&run, solver_named("Newton"), &newton, error);
            jobs[(*n)++] = (struct job){.name = contests[k].scene,
                                        .group = "path",
                                        .measure = "relative distance from the stationary path",
                                        .published = {adam.seconds, adam.error, false},
                                        .ours = {newton.seconds, newton.error, false},
                                        .level = newton.reached};
        }
        close_scene(&run);
    }
    return error->status;
}

/* ---- all ---- */

static const struct column columns[] = {{.key = "scene"}, {.key = "solver"},
                                        {.key = "step"},  {.key = "seconds"},
                                        {.key = "error"}, {.key = "drawn", .no_csv = true},
                                        {.key = NULL}};

static enum ad_status one_scene(struct chart *chart, const struct contest *contest,
                                struct sheet *sheet, struct ad_error *error)
{
    struct scene_run run;
    if (!chart->quiet)
        printf("%s: distance from the stationary path, CPU time (s)\n", contest->scene);
    json_object(&chart->json, contest->scene);
    open_scene(&run, contest, error);
    for (size_t s = 0; s < N_SOLVERS && error->status == AD_OK; s++) {
        struct watch w = {.sheet = sheet};
        if (run_solver(&run, &solvers[s], &w, error) != AD_OK)
            break;
        if (!chart->quiet)
            printf("  %-30s %8.1e %10.2g\n", solvers[s].name, w.error, w.seconds);
        json_number(&chart->json, solvers[s].name, w.error);
    }
    json_end_object(&chart->json);
    close_scene(&run);
    return error->status;
}

/* One panel per scene. */
static void draw_panel(struct figure *figure, const struct sheet *sheet, const char *scene)
{
    int p = figure->panel;
    figure_panel(figure, &(struct panel){.title = scene,
                                         .x = p < 3 ? NULL : "CPU time (s)",
                                         .y = p % 3 ? NULL : "largest distance",
                                         .log = "xy",
                                         .y_range = "[1e-16:30]",
                                         .y_tics = "1000",
                                         .key = p == 0 ? LEGEND_RIGHT : NULL});
    for (const struct solver *s = solvers; s < solvers + N_SOLVERS; s++)
        figure_curve(figure, sheet, "seconds", "drawn", s->name, STYLE(s->colour, 0, s->width, 0),
                     "scene", scene, "solver", s->name);
}

enum ad_status chart_solvers(struct chart *chart, struct ad_error *error)
{
    struct sheet *sheet = chart_sheet(chart, "paths", columns, error);
    struct plot *plot = chart_picture(chart, "paths", error);
    struct figure figure;
    struct layout layout = figure_of_six;
    layout.title = "Path solvers: largest distance from the stationary path over CPU time";
    if (error->status == AD_OK)
        figure_begin(&figure, plot, &layout);
    for (size_t k = 0; k < N_CONTESTS && error->status == AD_OK; k++)
        if ((!chart->quick || !contests[k].slow) &&
            one_scene(chart, &contests[k], sheet, error) == AD_OK)
            draw_panel(&figure, sheet, contests[k].scene);
    if (error->status == AD_OK)
        figure_end(&figure);
    return error->status;
}
