/* Results of a path run (path.h): table, JSON, CSV and run file. */
#include "path.h"
#include "apps/output/json.h"
#include "apps/command.h"
#include "apps/output/unit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *path_stop_name(enum phys_stop stop)
{
    static const char *const names[] = {
        [PHYS_STOP_STEPS] = "all steps taken",   [PHYS_STOP_TOLERANCE] = "tolerance reached",
        [PHYS_STOP_INTERRUPTED] = "interrupted", [PHYS_STOP_ROUNDING] = "zero but for rounding",
        [PHYS_STOP_STALLED] = "stalled",         [PHYS_STOP_REFERENCE] = "nearest to the reference",
    };
    return names[stop];
}

/* ---- table ---- */

static void print_row(const char *name, double reference, double start, double found,
                      const char *unit)
{
    printf("  %-14s", name);
    for (int k = 0; k < 3; k++) {
        double value = k == 0 ? reference : k == 1 ? start : found;
        if (isnan(value))
            printf(" %13s", "");
        else
            printf(" %13.6g", value);
    }
    printf("%s%s\n", *unit ? "  " : "", unit);
}

/* What --data was found to be. */
static void print_tables(const struct path_run *run)
{
    for (size_t k = 0; k < run->n_tables; k++) {
        const struct phys_horizons *t = &run->tables[k];
        printf("%s: about %s, %s, %s, %zu epochs from %s; first slice at index %zu\n", t->target,
               t->center, t->frame, t->units, t->n, t->start_date, run->first_epoch);
    }
}

void path_print(const struct path_run *run, const struct path_result *result)
{
    const struct phys_scene *scene = run->system.scene;
    const struct path_figures *r = &result->reference, *s = &result->start, *f = &result->found;
    const char *length = unit_shown(scene->unit), *energy = unit_shown(scene->energy_unit);
    const char *time = unit_shown(scene->time_unit);
    char product[64], square[64];
    snprintf(product, sizeof product, "%s%s%s", energy, *energy && *time ? " " : "", time);
    snprintf(square, sizeof square, "%s%s", length, *length ? "^2" : "");
    print_tables(run);
    path_print_levels(run);
    printf("%s: %zu slices of %g%s%s, rule %s, %s, %zu steps in %.3g s%s, %s\n\n", scene->name,
           run->settings.slices, run->settings.dt, *time ? " " : "", time, run->settings.rule->name,
           run->solver->name, result->info.steps, result->info.seconds,
           result->info.native ? " as machine code" : "", path_stop_name(result->info.stop));
    if (run->options->common.verbose && *result->info.interpreted)
        printf("  interpreted: %s\n\n", result->info.interpreted);
    printf("  %-14s %13s %13s %13s\n", "", "reference", "start", "found");
    print_row("S mean", r->action_mean, s->action_mean, f->action_mean, energy);
    print_row("T mean", r->kinetic_mean, s->kinetic_mean, f->kinetic_mean, energy);
    print_row("V mean", r->potential_mean, s->potential_mean, f->potential_mean, energy);
    print_row("action", r->action, s->action, f->action, product);
    print_row("|gradient|", r->grad_norm, s->grad_norm, f->grad_norm, "");
    print_row("MSE", NAN, result->mse_initial, result->mse_final, square);
    print_row("largest error", NAN, NAN, result->max_error, length);
    print_row("energy drift", NAN, NAN, result->energy_drift, "of the start");
    path_print_kind(run, result);
    path_print_answers(run, result);
}

/* ---- JSON ---- */

static void json_tables(struct json *json, const struct path_run *run)
{
    json_array(json, "tables");
    for (size_t k = 0; k < run->n_tables; k++) {
        const struct phys_horizons *table = &run->tables[k];
        json_object(json, NULL);
        json_text(json, "target", table->target);
        if (table->id != PHYS_HORIZONS_NO_ID)
            json_number(json, "id", table->id);
        json_text(json, "center", table->center);
        json_text(json, "frame", table->frame);
        json_text(json, "units", table->units);
        json_count(json, "epochs", table->n);
        json_text(json, "start", table->start_date);
        json_end_object(json);
    }
    json_end_array(json);
}

void path_print_json(const struct path_run *run, const struct path_result *result)
{
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "scene", run->system.scene->name);
    json_count(&json, "dof", run->system.dof);
    json_count(&json, "slices", run->settings.slices);
    json_number(&json, "dt", run->settings.dt);
    json_text(&json, "solver", run->solver->name);
    json_text(&json, "rule", run->settings.rule->name);
    json_count(&json, "steps", result->info.steps);
    json_number(&json, "seconds", result->info.seconds);
    json_bool(&json, "native", result->info.native);
    json_number(&json, "action", result->found.action);
    json_number(&json, "action_mean", result->found.action_mean);
    json_number(&json, "kinetic_mean", result->found.kinetic_mean);
    json_number(&json, "potential_mean", result->found.potential_mean);
    json_number(&json, "grad_norm", result->info.grad_norm);
    path_json_kind(&json, run, result);
    path_json_answers(&json, result);
    path_json_levels(&json, run);
    json_number(&json, "mse_initial", result->mse_initial);
    json_number(&json, "mse_final", result->mse_final);
    json_number(&json, "max_error", result->max_error);
    json_number(&json, "energy_drift", result->energy_drift);
    json_text(&json, "stop", path_stop_name(result->info.stop));
    if (run->n_tables)
        json_tables(&json, run);
    json_close(&json);
}

/* ---- CSV ---- */

void path_write_csv(const struct path_run *run, FILE *out)
{
    size_t dof = run->system.dof, n = run->settings.slices;
    char name[32];
    for (size_t k = 0; k < dof; k++) {
        phys_coordinate_name(&run->system, k, name, sizeof name);
        fprintf(out, "%s%s", k ? "," : "", name);
    }
    fputc('\n', out);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < dof; k++)
            fprintf(out, "%.17g%c", run->path[k * n + i], k + 1 < dof ? ',' : '\n');
}

/* ---- run file ---- */

static void file_parameters(const struct path_run *run, phys_runfile *file)
{
    const struct phys_scene *scene = run->system.scene;
    phys_runfile_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_runfile_number(file, "parameters", scene->params[k].name,
                            phys_system_get(&run->system, scene->params[k].name),
                            scene->params[k].unit);
}

/* Where observed motion came from. */
static void file_tables(const struct path_run *run, phys_runfile *file)
{
    char name[80];
    for (size_t k = 0; k < run->n_tables; k++) {
        const struct phys_horizons *table = &run->tables[k];
        snprintf(name, sizeof name, "tables/%zu", k);
        phys_runfile_folder(file, name);
        phys_runfile_text(file, name, "target", table->target);
        phys_runfile_text(file, name, "center", table->center);
        phys_runfile_text(file, name, "frame", table->frame);
        phys_runfile_number(file, name, "first_epoch", table->jd[run->first_epoch], "JD TDB");
    }
}

static void file_path(const struct path_run *run, phys_runfile *file, const char *name,
                      const double *path)
{
    phys_runfile_write(file, name, AD_F64, 2, (size_t[]){run->system.dof, run->settings.slices},
                       path);
    phys_runfile_text(file, name, "unit", run->system.scene->unit);
    phys_runfile_text(file, name, "axes", "coordinate, slice");
}

static enum ad_status file_times(const struct path_run *run, phys_runfile *file,
                                 struct ad_error *error)
{
    size_t n = run->settings.slices;
    double *time = malloc(n * sizeof *time);
    if (!time)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < n; i++)
        time[i] = (double)i * run->settings.dt;
    phys_runfile_write(file, "time", AD_F64, 1, &n, time);
    phys_runfile_text(file, "time", "unit", run->system.scene->time_unit);
    free(time);
    return AD_OK;
}

enum ad_status path_file_begin(const struct path_run *run, phys_runfile *file,
                               struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_path_settings *settings = &run->settings;
    phys_runfile_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_runfile_text(file, "/", "command", run->options->common.command);
    phys_runfile_text(file, "/", "scene", scene->name);
    phys_runfile_text(file, "/", "solver", run->solver->name);
    phys_runfile_text(file, "/", "rule", settings->rule->name);
    phys_runfile_number(file, "/", "dt", settings->dt, scene->time_unit);
    phys_runfile_number(file, "/", "learning_rate", settings->learning_rate, NULL);
    phys_runfile_number(file, "/", "energy_weight", settings->energy_weight, NULL);
    phys_runfile_integer(file, "/", "seed", (int64_t)run->options->common.seed, NULL);
    file_parameters(run, file);
    file_tables(run, file);
    file_path(run, file, "reference", run->reference);
    phys_runfile_extendable(file, "step", AD_F64, 1, (size_t[]){0});
    phys_runfile_extendable(file, "path", AD_F64, 3,
                            (size_t[]){0, run->system.dof, settings->slices});
    phys_runfile_text(file, "path", "unit", scene->unit);
    phys_runfile_text(file, "path", "axes", "stored step, coordinate, slice");
    return file_times(run, file, error);
}

/* One column of the history as a dataset. */
static void file_column(const struct path_record *record, phys_runfile *file, const char *name,
                        const char *unit, size_t offset, double *column)
{
    for (size_t i = 0; i < record->n; i++)
        memcpy(&column[i], (const char *)&record->figures[i] + offset, sizeof *column);
    phys_runfile_write(file, name, AD_F64, 1, &record->n, column);
    if (unit)
        phys_runfile_text(file, name, "unit", unit);
}

static enum ad_status file_history(const struct path_run *run, const struct path_record *record,
                                   phys_runfile *file, struct ad_error *error)
{
    const char *energy = run->system.scene->energy_unit;
    double *column = malloc(record->n * sizeof *column);
    if (!column)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
#define COLUMN(member, unit)                                                                       \
    file_column(record, file, "history/" #member, unit, offsetof(struct path_figures, member),     \
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

enum ad_status path_file_end(const struct path_run *run, const struct path_record *record,
                             const struct path_result *result, phys_runfile *file,
                             struct ad_error *error)
{
    if (result->info.steps % run->every != 0) { /* the found path is always the last one stored */
        double step = (double)result->info.steps;
        phys_runfile_append(file, "step", &step);
        phys_runfile_append(file, "path", run->path);
    }
    phys_runfile_integer(file, "/", "steps", (int64_t)result->info.steps, NULL);
    phys_runfile_text(file, "/", "stop", path_stop_name(result->info.stop));
    phys_runfile_number(file, "/", "mse_initial", result->mse_initial, NULL);
    phys_runfile_number(file, "/", "mse_final", result->mse_final, NULL);
    phys_runfile_number(file, "/", "max_error", result->max_error, run->system.scene->unit);
    phys_runfile_number(file, "/", "energy_drift", result->energy_drift, NULL);
    return file_history(run, record, file, error);
}
