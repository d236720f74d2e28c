/* Where a path run starts and what it is held against (path.h): files, the scene's motion, what the
   tables say, or a line. */
#include "path.h"

#include <math.h>
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

/* Columns 0 and 1 of `path`: from `given`, else from the scene's start. */
static enum ad_status first_slices(const struct path_run *run, phys_motion *motion,
                                   const double *given, double *path, struct ad_error *error)
{
    const struct phys_system *system = &run->system;
    size_t dof = system->dof, n = run->settings.slices;
    for (size_t k = 0; given && k < dof; k++) {
        path[k * n] = given[k * n];
        path[k * n + 1] = given[k * n + 1];
    }
    if (given)
        return AD_OK;
    double *q = malloc(2 * dof * sizeof *q);
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    bool euler = !run->preset || run->preset->euler_start;
    if (system->scene->start(system->params, run->options->common.seed, q, q + dof, error) == AD_OK)
        phys_first_slices(motion, q, q + dof, n, run->settings.dt, euler, path, error);
    free(q);
    return error->status;
}

/* For the left rules the equations of the discretised action march the published ODE path; other
   rules, tables without the preset, and an error asked for, take the motion itself. */
static enum ad_status integrate(const struct path_run *run, phys_motion *motion, double *path,
                                struct ad_error *error)
{
    size_t dof = run->system.dof, n = run->settings.slices;
    double dt = run->settings.dt;
    bool tables = run->n_tables && !path_from_file(run->options);
    if (strncmp(run->settings.rule->name, "left", 4) == 0 && !path_wants_tolerance(run->options) &&
        !(tables && !run->preset))
        return phys_ode_path(motion, n, dt, run->damping, path, error);
    double *q = malloc(2 * dof * sizeof *q), *v = q ? q + dof : NULL;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < dof; k++) {
        q[k] = path[k * n];
        v[k] = (path[k * n + 1] - path[k * n]) / dt;
    }
    if (tables) /* have velocities */
        run->system.scene->start(run->system.params, run->options->common.seed, q, v, error);
    phys_motion_path(&run->system, NULL, q, v, n, dt, path, error);
    free(q);
    return error->status;
}

static const char same_grid[] = "the motion of this discretisation", tight[] = "the true motion";
static const double led_away = 10; /* extents of the motion: what its discretisation may be off */

/* Whether the motion of the discretisation is lost: further from the true one than that is wide. */
static bool diverges(const struct path_run *run, const double *crude, const double *motion)
{
    size_t n = run->settings.slices, dof = run->system.dof;
    double width = 0, distance = 0;
    for (size_t k = 0; k < dof * n; k++) {
        width = fmax(width, fabs(motion[k] - motion[k / n * n]));
        if (!(fabs(crude[k] - motion[k]) <= distance))
            distance = fabs(crude[k] - motion[k]);
    }
    return !(distance <= led_away * width);
}

/* Of a discretisation, by its own equations; `given` may be NULL. */
static enum ad_status crude_motion(const struct path_run *run, const double *given, double *path,
                                   struct ad_error *error)
{
    phys_motion *motion = NULL;
    if (phys_motion_new(&run->system, &motion, error) == AD_OK &&
        first_slices(run, motion, given, path, error) == AD_OK)
        integrate(run, motion, path, error);
    phys_motion_free(motion);
    return error->status;
}

/* The scene's motion, which gives the ends: for the left rules, that of the same discretisation as
   long as it is near the true one; for other rules the true one. */
static double *scene_motion(struct path_run *run, struct ad_error *error)
{
    const struct phys_path_settings *settings = &run->settings;
    bool left = strncmp(settings->rule->name, "left", 4) == 0 &&
                !path_wants_tolerance(run->options) && !run->system.scene->between;
    struct ad_error lost = {0}, none = {0};
    double *path = path_new(run, error), *crude = path && left ? path_new(run, error) : NULL;
    if (error->status == AD_OK && run->preset && crude) { /* as published, whatever it is */
        free(path);
        run->reference_is = same_grid;
        crude_motion(run, NULL, crude, error);
        return crude;
    }
    run->reference_is = run->system.scene->between ? "the closed form" : tight;
    if (error->status == AD_OK) {
        path_motion(run, settings->slices, settings->dt, PATH_TIGHTEST, path, &lost);
        if (crude && crude_motion(run, NULL, crude, &none) == AD_OK &&
            (lost.status != AD_OK || !diverges(run, crude, path))) {
            double *swap = path;
            path = crude;
            crude = swap;
            run->reference_is = same_grid;
        } else if (lost.status != AD_OK) {
            ad_fail(error, lost.status, "%s", lost.message);
        }
        run->led_away = crude && run->reference_is == tight;
        run->settings.compare_true = run->reference_is != same_grid;
    }
    free(crude);
    if (error->status == AD_OK)
        return path;
    free(path);
    return NULL;
}

/* The motion from the first two slices of what was observed. */
static double *observed_motion(struct path_run *run, const double *observed, struct ad_error *error)
{
    double *path = path_new(run, error);
    run->reference_is = same_grid;
    if (path && crude_motion(run, observed, path, error) == AD_OK)
        return path;
    free(path);
    return NULL;
}

/* A straight line between the ends of `between`. */
static void draw_line(const struct path_run *run, const double *between, double *path)
{
    size_t n = run->settings.slices;
    for (size_t k = 0; k < run->system.dof; k++)
        for (size_t i = 0; i < n; i++) {
            double s = (double)i / (double)(n - 1);
            path[k * n + i] = (1 - s) * between[k * n] + s * between[k * n + n - 1];
        }
}

/* The motion from the first epoch of tables, and what it misses their last one by, in proportion to
   the time: near the path between their ends. */
static void bend(const struct path_run *run, const double *motion, const double *observed,
                 double *path)
{
    size_t n = run->settings.slices;
    for (size_t k = 0; k < run->system.dof; k++) {
        double miss = observed[k * n + n - 1] - motion[k * n + n - 1];
        for (size_t i = 0; i < n; i++)
            path[k * n + i] = motion[k * n + i] + miss * (double)i / (double)(n - 1);
    }
}

/* The start, from the file that was read, the tables, the motion, or a line between the ends of
   what was observed, else of the motion; then the noise. */
static void make_start(struct path_run *run, const double *file, const double *motion,
                       const double *observed)
{
    size_t bytes = run->system.dof * run->settings.slices * sizeof(double);
    if (file)
        memcpy(run->start, file, bytes);
    else if (path_from_line(run->options) && !(run->led_away && !run->options->init))
        draw_line(run, observed ? observed : motion, run->start);
    else if (path_from_tables(run->options))
        memcpy(run->start, observed, bytes);
    else if (observed && !run->preset && run->solver != &phys_solver_march)
        bend(run, motion, observed, run->start);
    else
        memcpy(run->start, motion, bytes);
    if (run->noise.sigma > 0)
        phys_noise_add(&run->noise, &run->system, run->settings.slices, run->options->common.seed,
                       run->start);
}

/* Slices are what files and pictures show; a rule of higher degree has nodes between them. */
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

/* Where the motion by the rule is lost, the true motion is the start; but where Newton's method
   does not arrive from it, the rule is too coarse for that motion, and a line is the start. */
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
    draw_line(run, run->reference, run->start);
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
    if (error->status == AD_OK && !file) /* the ends of a file need no motion */
        motion = observed ? observed_motion(run, observed, error) : scene_motion(run, error);
    if (error->status == AD_OK && (run->start = path_new(run, error)) &&
        (run->path = path_new(run, error)))
        make_start(run, file, motion, observed);
    if (run->reference) {
        run->reference_is = options->reference;
        run->settings.compare_true = false;
    } else if (error->status == AD_OK && !(file && !observed)) {
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
                init);
    if (error->status == AD_OK)
        place_nodes(run);
    if (error->status == AD_OK && run->led_away && !init &&
        strcmp(run->solver->name, "newton") == 0)
        choose_start(run, error);
    if (options->stop_at_reference)
        run->settings.reference = run->reference;
    free(file);
    free(motion);
    free(observed);
    return error->status;
}
