/* Output files of a path run (path.h): CSV and run file. */
#include "path.h"
#include "apps/output/report.h"

#include <stdlib.h>
#include <string.h>

/* ---- CSV ---- */

void path_write_titles(const struct path_run *run, FILE *out)
{
    char name[32];
    fputs(phys_time_name(&run->system), out);
    for (size_t k = 0; k < run->system.dof; k++) {
        phys_coordinate_name(&run->system, k, name, sizeof name);
        fprintf(out, ",%s", name);
    }
    for (size_t k = 0; run->found.force && k < run->system.dof; k++) {
        phys_coordinate_name(&run->system, k, name, sizeof name);
        fprintf(out, ",reaction_%s", name);
    }
    fputc('\n', out);
}

void path_write_csv(const void *context, FILE *out)
{
    const struct path_run *run = context;
    size_t dof = run->system.dof, n = run->settings.slices;
    const struct phys_grid grid = phys_grid_of(&run->settings);
    path_write_titles(run, out);
    for (size_t i = 0; i < n; i++) {
        fprintf(out, "%.17g", phys_grid_time(&grid, i));
        for (size_t k = 0; k < dof; k++)
            fprintf(out, ",%.17g", run->path[k * n + i]);
        for (size_t k = 0; run->found.force && k < dof; k++)
            fprintf(out, ",%.17g", run->found.force[k * n + i]);
        fputc('\n', out);
    }
}

/* ---- run file ---- */

static void file_path(const struct path_run *run, phys_hdf5 *file, const char *name,
                      const char *unit, const double *path)
{
    phys_hdf5_write(file, name, AD_F64, 2, (size_t[]){run->system.dof, run->settings.slices}, path);
    phys_hdf5_text(file, name, "unit", unit);
    phys_hdf5_text(file, name, "axes", "coordinate, slice");
}

static enum ad_status file_times(const struct path_run *run, phys_hdf5 *file,
                                 struct ad_error *error)
{
    size_t n = run->settings.slices;
    const struct phys_grid grid = phys_grid_of(&run->settings);
    double *time = malloc(n * sizeof *time);
    if (!time)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < n; i++)
        time[i] = phys_grid_time(&grid, i);
    phys_hdf5_write(file, "time", AD_F64, 1, &n, time);
    phys_hdf5_text(file, "time", "unit", run->system.scene->time_unit);
    free(time);
    return AD_OK;
}

enum ad_status path_file_begin(const struct path_run *run, phys_hdf5 *file, struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_path_settings *settings = &run->settings;
    phys_hdf5_number(file, "/", "learning_rate", settings->learning_rate, NULL);
    phys_hdf5_number(file, "/", "energy_weight", settings->energy_weight, NULL);
    phys_hdf5_integer(file, "/", "seed", (int64_t)run->options->common.seed, NULL);
    report_parameters(&run->system, file);
    if (run->reference && !path_is_periodic(run->options)) /* that is known at the end */
        file_path(run, file, "reference", scene->unit, run->reference);
    phys_hdf5_extendable(file, "step", AD_F64, 1, (size_t[]){0});
    phys_hdf5_extendable(file, "path", AD_F64, 3, (size_t[]){0, run->system.dof, settings->slices});
    phys_hdf5_text(file, "path", "unit", scene->unit);
    phys_hdf5_text(file, "path", "axes", "stored step, coordinate, slice");
    return file_times(run, file, error);
}

/* One column of the history as a dataset. */
static void file_column(const struct path_run *run, phys_hdf5 *file, const char *name,
                        const char *unit, size_t offset, double *column)
{
    for (size_t i = 0; i < run->record.n; i++)
        memcpy(&column[i], (const char *)&run->record.figures[i] + offset, sizeof *column);
    phys_hdf5_write(file, name, AD_F64, 1, &run->record.n, column);
    if (unit)
        phys_hdf5_text(file, name, "unit", unit);
}

static enum ad_status file_history(const struct path_run *run, phys_hdf5 *file,
                                   struct ad_error *error)
{
    const char *energy = run->system.scene->energy_unit;
    double *column = malloc(run->record.n * sizeof *column);
    if (!column)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
#define COLUMN(member, unit)                                                                       \
    file_column(run, file, "history/" #member, unit, offsetof(struct phys_path_figures, member),   \
                column)
    COLUMN(action, NULL);
    COLUMN(action_mean, energy);
    COLUMN(kinetic_mean, energy);
    COLUMN(potential_mean, energy);
    COLUMN(objective, NULL);
    COLUMN(grad_norm, NULL);
#undef COLUMN
    free(column);
    return AD_OK;
}

enum ad_status path_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct path_run *run = context;
    if (run->periodic.n || run->found.info.steps % run->every != 0) { /* the last one stored */
        double step = (double)run->found.info.steps;
        phys_hdf5_append(file, "step", &step);
        phys_hdf5_append(file, "path", run->path);
    }
    if (run->periodic.n)
        file_path(run, file, "reference", run->system.scene->unit, run->reference);
    if (run->found.force) {
        const struct phys_scene *scene = run->system.scene;
        char unit[UNIT_FORCE];
        unit_of_force(scene->energy_unit, scene->unit, unit);
        file_path(run, file, "reaction", unit, run->found.force);
    }
    return file_history(run, file, error);
}
