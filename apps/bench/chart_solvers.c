/* Solvers of paths (chart_paths.h): from the published noise to the stationary path of rule `left`,
   distance over seconds; Newton's method beside the published descent and the paper's remedies. */
#include "chart_jobs.h"
#include "chart_paths.h"

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
    {"Adam + 3 slices held", "adam", "left", 3, FREE, 0, "#e8743b", 1.6},
    {"Adam + energy penalty", "adam", "left", 1, FROM_START, 0, "#f2b134", 1.6},
    {"Adam + local energy penalty", "adam", "left", 1, FROM_BEFORE, 0, "#a8703a", 1.6},
    {"momentum descent", "sgd", "left", 1, FREE, 0.9, "#9a9a9a", 1.6},
    {"L-BFGS", "lbfgs", "left", 1, FREE, 0, "#3c8dc5", 1.6},
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
    size_t dof = run->system.dof, slices = paper->slices;
    double *q = malloc(2 * dof * sizeof *q);
    phys_motion *motion = NULL;
    struct phys_path_settings newton = run->settings;
    struct phys_path_info info;
    newton.rule = phys_rule_find("left", error);
    newton.steps = 50;
    newton.progress = take_energy;
    newton.context = run;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_motion_new(&run->system, &motion, error) == AD_OK &&
        run->system.scene->start(run->system.params, SEED, q, q + dof, error) == AD_OK &&
        phys_first_slices(motion, q, q + dof, slices, paper->dt, paper->euler_start, run->reference,
                          error) == AD_OK &&
        phys_ode_path(motion, slices, paper->dt, 1, run->reference, error) == AD_OK) {
        memcpy(run->start, run->reference, run->n * sizeof *run->start);
        phys_noise_add(&paper->noise, &run->system, slices, SEED, run->start);
        phys_path_solve(phys_solver_find("newton", error), &run->system, &newton, run->reference,
                        &info, error);
    }
    phys_motion_free(motion);
    free(q);
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
    run->settings = (struct phys_path_settings){.slices = paper->slices,
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
    double began, away; /* seconds: when the run began, spent here */
    double next;        /* seconds after which a point is kept */
    FILE *csv, *data;   /* NULL: points are not kept */
    size_t steps;
    double seconds, error;  /* of the last step */
    double target, reached; /* seconds until the error first was no more than the target */
};

static void keep(struct watch *w)
{
    if (!w->csv)
        return;
    fprintf(w->csv, "%s,%s,%zu,%.6g,%.6g\n", w->scene, w->solver, w->steps, w->seconds, w->error);
    fprintf(w->data, "%.6g %.6g\n", w->seconds, fmax(w->error, 1e-17));
    w->next = closer * w->seconds;
}

static bool watch(void *context, const struct phys_path_step *step)
{
    struct watch *w = context;
    double now = processor_seconds();
    w->seconds = now - w->began - w->away;
    w->steps = step->step;
    w->error = path_distance(w->run->n, step->path, w->run->reference);
    if (w->error <= w->target)
        w->reached = fmin(w->reached, w->seconds);
    if (w->seconds >= w->next)
        keep(w);
    w->away += processor_seconds() - now;
    return w->error < 1e6; /* what is this far away does not come back */
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
    /* energies of slices are divided by their number; the published weight of the pendulum is about
       what this gives */
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

/* ---- the picture: a panel a scene ---- */

static void draw_panel(size_t p, size_t panels, const char *scene, FILE *out)
{
    size_t columns = (panels + 1) / 2, row = p / columns, column = p % columns;
    double left = 0.06 + 0.255 * (double)column;
    fprintf(out,
            "set lmargin at screen %g\nset rmargin at screen %g\nset tmargin at screen %g\n"
            "set bmargin at screen %g\nset title '%s' font ',13' offset 0,-0.5\nset xlabel '%s' "
            "offset 0,0.6\nset ylabel '%s' offset 1\n",
            left, left + 0.21, row ? 0.46 : 0.94, row ? 0.08 : 0.56, scene,
            row ? "seconds of the processor" : "", column ? "" : "distance from the path");
    fputs(p == 0 ? "set key at screen 0.998, screen 0.93 right top Left reverse samplen 2 spacing "
                   "1.4 font ',10'\nplot "
                 : "set key off\nplot ",
          out);
    for (size_t s = 0; s < N_SOLVERS; s++)
        fprintf(out, "data index %zu using 1:2 with lines lw %g lc rgb '%s' title '%s', \\\n    ",
                p * N_SOLVERS + s, solvers[s].width, solvers[s].colour, solvers[s].name);
    fputs("NaN notitle\n", out);
}

static void draw(size_t panels, const char *const scenes[], struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 1120;
    plot->height = 640;
    fputs("set multiplot\nset logscale xy\nset yrange [1e-16:30]\nset format xy '10^{%T}'\n"
          "set ytics 1000\nset grid lc rgb '#e6e6e6' lt 1\nset border 3\nset tics nomirror\n",
          out);
    for (size_t p = 0; p < panels; p++)
        draw_panel(p, panels, scenes[p], out);
    fputs("unset multiplot\n", out);
}

static enum ad_status one_scene(const struct chart_settings *settings,
                                const struct contest *contest, FILE *csv, FILE *data,
                                struct json *json, struct ad_error *error)
{
    struct scene_run run;
    if (!settings->quiet)
        printf("%s: distance from the stationary path, seconds\n", contest->scene);
    if (open_scene(&run, contest, error) == AD_OK) {
        json_object(json, contest->scene);
        for (size_t s = 0; s < N_SOLVERS && error->status == AD_OK; s++) {
            struct watch w = {.csv = csv, .data = data};
            fprintf(data, "# %s, %s: seconds, distance\n", contest->scene, solvers[s].name);
            if (run_solver(&run, &solvers[s], &w, error) != AD_OK)
                break;
            fputs("\n\n", data);
            if (!settings->quiet)
                printf("  %-30s %8.1e %10.2g\n", solvers[s].name, w.error, w.seconds);
            json_number(json, solvers[s].name, w.error);
        }
        json_end_object(json);
    }
    close_scene(&run);
    return error->status;
}

enum ad_status chart_solvers(const struct chart_settings *settings, struct json *json,
                             struct ad_error *error)
{
    struct result csv = {0};
    struct plot plot = {0};
    const char *scenes[N_CONTESTS];
    size_t n = 0;
    if (chart_csv(settings, "paths", &csv, error) == AD_OK &&
        chart_picture(settings, "paths", &plot, error) == AD_OK)
        fputs("scene,solver,step,seconds,error\n", csv.out);
    for (size_t k = 0; k < N_CONTESTS && error->status == AD_OK; k++) {
        if (settings->quick && contests[k].slow)
            continue;
        scenes[n++] = contests[k].scene;
        one_scene(settings, &contests[k], csv.out, plot.data, json, error);
    }
    if (error->status == AD_OK)
        draw(n, scenes, &plot);
    return chart_end(&plot, &csv, error);
}
