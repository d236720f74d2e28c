/* Where a path run starts and what it is held against (path.h): files, the scene's motion, what the
   tables say, or a line. */
#include "path.h"
#include "physics/io/csv.h"

#include <stdlib.h>
#include <string.h>

enum { SUBSTEPS = 100 }; /* of the integrated reference, a slice */

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

/* A path from a file [slices x dof], turned into [dof x slices]. */
static double *read_path(const struct path_run *run, const char *file, struct ad_error *error)
{
    size_t dof = run->system.dof, slices = run->settings.slices, rows, columns;
    double *table, *path = NULL;
    if (phys_table_read(file, &rows, &columns, &table, error) != AD_OK)
        return NULL;
    if (columns != dof)
        ad_fail(error, AD_E_INPUT, "%s: %zu columns, expected one for each coordinate of %s: %zu",
                file, columns, run->system.scene->name, dof);
    else if (rows != slices)
        ad_fail(error, AD_E_INPUT,
                "%s: %zu rows, expected one for each slice: %zu; or give --slices %zu", file, rows,
                slices, rows);
    else
        path = path_new(run, error);
    for (size_t k = 0; path && k < dof; k++)
        for (size_t i = 0; i < slices; i++)
            path[k * slices + i] = table[i * dof + k];
    free(table);
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
    phys_fine_path(motion, q, v, n, dt, SUBSTEPS, path, error);
    free(q);
    return error->status;
}

/* The scene's own stationary path, else the motion from the first two slices of `given`, else from
   the scene's start. */
static double *motion_path(const struct path_run *run, const double *given, struct ad_error *error)
{
    phys_motion *motion = NULL;
    double *path = path_new(run, error);
    const struct phys_scene *scene = run->system.scene;
    if (path && scene->between)
        scene->between(run->system.params, run->settings.slices, path, error);
    else if (path && phys_motion_new(&run->system, &motion, error) == AD_OK &&
             first_slices(run, motion, given, path, error) == AD_OK)
        integrate(run, motion, path, error);
    phys_motion_free(motion);
    if (error->status == AD_OK)
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
    else if (path_from_line(run->options))
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
    phys_rule_interpolate(run->settings.rule, dof, slices, run->reference);
    phys_rule_interpolate(run->settings.rule, dof, slices, run->start);
    memcpy(run->path, run->start, path_rows(run) * slices * sizeof *run->path);
}

bool path_from_line(const struct path_options *options)
{
    return options->init ? strcmp(options->init, "line") == 0 : !options->preset && !options->data;
}

bool path_from_tables(const struct path_options *options)
{
    return options->data &&
           (options->init ? strcmp(options->init, "table") == 0 : !options->preset);
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
    double *file = path_from_file(options) ? read_path(run, init, error) : NULL, *motion = NULL;
    if (error->status == AD_OK && options->reference)
        run->reference = read_path(run, options->reference, error);
    if (error->status == AD_OK)
        motion = motion_path(run, file ? file : observed, error);
    if (error->status == AD_OK && (run->start = path_new(run, error)) &&
        (run->path = path_new(run, error)))
        make_start(run, file, motion, observed);
    if (!run->reference && error->status == AD_OK) {
        double **best = observed && !run->preset ? &observed : &motion;
        run->reference = *best;
        *best = NULL;
    }
    if (error->status == AD_OK)
        place_nodes(run);
    if (options->stop_at_reference)
        run->settings.reference = run->reference;
    free(file);
    free(motion);
    free(observed);
    return error->status;
}
