/* The start and the reference of a path run (path.h): from files, the scene's motion, tables, or a
   line. */
#include "autodiff/free.h"
#include "path.h"
#include "apps/interrupt.h"

#include <stdlib.h>
#include <string.h>

/* Room for the inner nodes of the rule, too. */
static size_t path_rows(const struct path_run *run)
{
    return run->settings.rule->degree * run->system.dof;
}

double *path_new(const struct path_run *run, struct ad_error *error)
{
    size_t rows = path_rows(run), slices = run->settings.slices;
    double *path =
        slices <= SIZE_MAX / sizeof *path / rows ? malloc(slices * rows * sizeof *path) : NULL;
    if (!path)
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", slices);
    return path;
}

enum ad_status path_motion(const struct path_run *run, size_t slices, double dt, double tolerance,
                           double *path, struct ad_error *error)
{
    const struct phys_simulation how = {.size = sizeof how,
                                        .rtol = tolerance,
                                        .max_steps = PHYS_MOTION_STEPS,
                                        .ode = run->settings.ode,
                                        .proceed = interrupt_proceed};
    return phys_scene_path(&run->system, run->options->common.seed, &how, slices, dt, path, error);
}

/* One of the system for all its motions; where there is none each says why. Parameters that change
   are of another. */
static void share_motion(struct path_run *run)
{
    struct ad_error none = {0};
    if (run->follow.name || run->system.scene->between)
        return;
    if (phys_ode_for(&run->system, phys_integrator_find("dop853", &none), &run->ode, &none) ==
        AD_OK)
        run->settings.ode = &run->ode;
}

/* The scene's motion, which gives the ends; the true motion if an error is asked for. */
static double *scene_motion(struct path_run *run, struct ad_error *error)
{
    static const char *const names[] = {
        [PHYS_PATH_TRUE] = "the true motion",
        [PHYS_PATH_CLOSED] = "the closed form",
        [PHYS_PATH_GRID] = "the motion of this discretisation",
        [PHYS_PATH_LOST] = "the true motion",
        [PHYS_PATH_PUBLISHED] = "the published motion",
    };
    share_motion(run);
    struct phys_path_settings settings = run->settings;
    enum phys_motion_of which = PHYS_PATH_TRUE;
    double *path = path_new(run, error);
    if (path_wants_tolerance(run->options))
        settings.rule = phys_rule_find("gauss2", error);
    settings.proceed = interrupt_proceed;
    if (path)
        phys_path_motion(&run->system, &settings, run->preset, run->options->common.seed, path,
                         &which, error);
    bool repeats = which == PHYS_PATH_GRID && settings.rule->repeat; /* its last slice differs */
    run->reference_is = repeats ? "the motion of rule left" : names[which];
    run->led_away = which == PHYS_PATH_LOST;
    run->settings.compare_true = which != PHYS_PATH_GRID && which != PHYS_PATH_PUBLISHED;
    return path;
}

/* The motion from the first epoch of tables, as published with a preset. */
static double *observed_motion(struct path_run *run, const double *observed, struct ad_error *error)
{
    const struct phys_path_settings *s = &run->settings;
    uint64_t seed = run->options->common.seed;
    double *path = path_new(run, error);
    bool published = run->preset && strncmp(s->rule->name, "left", 4) == 0;
    run->reference_is = published ? "the published motion" : "the true motion";
    if (path && published)
        phys_published_path(&run->system, seed, s->slices, s->dt, true, run->preset->damping,
                            observed, path, error);
    else if (path)
        phys_scene_path(&run->system, seed, NULL, s->slices, s->dt, path, error);
    return path;
}

/* The start: from the file, the tables, the motion, or a line between the ends of the observed or
   computed motion; then the noise. */
static enum ad_status make_start(struct path_run *run, const double *file, const double *motion,
                                 const double *observed, struct ad_error *error)
{
    size_t dof = run->system.dof, slices = run->settings.slices;
    size_t bytes = dof * slices * sizeof(double);
    if (file)
        memcpy(run->start, file, bytes);
    else if (run->given && !motion)
        ; /* a line between the ends alone */
    else if (path_from_line(run->options) && !(run->led_away && !run->options->init))
        phys_path_line(dof, slices, observed ? observed : motion, run->start);
    else if (path_from_tables(run->options))
        memcpy(run->start, observed, bytes);
    else {
        memcpy(run->start, motion, bytes);
        if (observed && !run->preset && run->solver != &phys_solver_march)
            phys_path_bend(dof, slices, observed, run->start);
    }
    if (path_is_periodic(run->options))
        path_periodic_relate(run);
    if (run->given && path_meet_ends(run, !file && !motion, error) != AD_OK)
        return error->status;
    if (run->noise.sigma > 0)
        phys_noise_add(&run->noise, &run->system, run->settings.slices, run->options->common.seed,
                       run->start);
    return AD_OK;
}

/* Files and pictures have slices only; a rule of higher degree has nodes between them. */
static void place_nodes(struct path_run *run)
{
    size_t dof = run->system.dof, slices = run->settings.slices;
    if (run->reference)
        phys_rule_interpolate(run->settings.rule, dof, slices, run->reference);
    phys_rule_interpolate(run->settings.rule, dof, slices, run->start);
    memcpy(run->path, run->start, path_rows(run) * slices * sizeof *run->path);
}

bool path_from_line(const struct path_options *options)
{
    return options->init ? strcmp(options->init, "line") == 0
                         : !options->preset && !options->data && strcmp(options->ends, "both") == 0;
}

bool path_from_tables(const struct path_options *options)
{
    return options->data &&
           (options->init ? strcmp(options->init, "table") == 0 : !options->preset);
}

/* If the motion by the rule is lost, the start is the true motion; if Newton's method does not
   converge from that, the rule is too coarse for the motion, and a line is the start. */
static enum ad_status choose_start(struct path_run *run, struct ad_error *error)
{
    struct phys_path_settings settings = run->settings;
    struct phys_path_info info = {0};
    struct ad_error lost = {0};
    double *trial = path_new(run, error);
    if (!trial)
        return error->status;
    memcpy(trial, run->start, path_rows(run) * settings.slices * sizeof *trial);
    settings.adam_steps = 0;
    phys_path_solve(run->solver, &run->system, &settings, trial, &info, &lost);
    free(trial);
    if (lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING) {
        if (run->options->adam_steps == OPTION_NO_COUNT)
            run->settings.adam_steps = 0;
        return AD_OK;
    }
    phys_path_line(run->system.dof, settings.slices, run->reference, run->start);
    place_nodes(run);
    return AD_OK;
}

bool path_from_file(const struct path_options *options)
{
    const char *init = options->init;
    return init && strcmp(init, "line") != 0 && strcmp(init, "ode") != 0 &&
           !path_from_tables(options);
}

enum ad_status path_start(struct path_run *run, double *observed, struct ad_error *error)
{
    const struct path_options *options = run->options;
    const char *init = options->init;
    double *file = path_from_file(options) ? path_read(run, init, error) : NULL, *motion = NULL;
    if (error->status == AD_OK && options->reference)
        run->reference = path_read(run, options->reference, error);
    bool needed = !file && !(run->given && path_from_line(options)); /* ends that are given: not */
    if (error->status == AD_OK && needed)
        motion = observed ? observed_motion(run, observed, error) : scene_motion(run, error);
    if (error->status == AD_OK && (run->start = path_new(run, error)) &&
        (run->path = path_new(run, error)))
        make_start(run, file, motion, observed, error);
    bool ends_apart = run->given || path_time_is_free(options); /* not those of the motion */
    if (run->reference) {
        run->reference_is = options->reference;
        run->settings.compare_true = false;
    } else if (error->status == AD_OK && !(file && !observed) && !ends_apart) {
        bool table = observed && (!run->preset || file);
        double **best = table ? &observed : &motion;
        run->reference = *best;
        *best = NULL;
        run->reference_is = table ? "the tables" : run->reference_is;
    }
    if (error->status == AD_OK && options->stop_at_reference && !run->reference)
        ad_fail(error, AD_E_ARGUMENT,
                "--stop-at-reference: the ends of %s come without a reference; give --reference "
                "FILE.csv, too",
                file ? init : "--end");
    if (error->status == AD_OK)
        place_nodes(run);
    if (error->status == AD_OK && run->led_away && !init &&
        strcmp(run->solver->name, "newton") == 0)
        choose_start(run, error);
    if (options->stop_at_reference)
        run->settings.reference = run->reference;
    AD_FREE(file, motion, observed);
    return error->status;
}
