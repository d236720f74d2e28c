/* Files of a simulation (simulate.h): CSV and run file. */
#include "simulate.h"
#include "apps/command.h"
#include "apps/output/unit.h"

#include <stdlib.h>

/* ---- CSV ---- */

void simulate_write_csv(const struct simulate_run *run, const struct simulate_result *result,
                        FILE *out)
{
    const struct simulate_samples *s = &result->samples;
    char name[64];
    fputs("t", out);
    for (size_t k = 0; k < 2 * s->dof; k++) {
        phys_coordinate_name(&run->system, k % s->dof, name, sizeof name);
        fprintf(out, ",%s%s", k < s->dof ? "" : "v_", name);
    }
    fputc('\n', out);
    for (size_t i = 0; i < s->n; i++) {
        fprintf(out, "%.17g", s->t[i]);
        for (size_t k = 0; k < 2 * s->dof; k++)
            fprintf(out, ",%.17g", s->x[2 * i * s->dof + k]);
        fputc('\n', out);
    }
}

/* ---- run file ---- */

static void file_parameters(const struct simulate_run *run, phys_runfile *file)
{
    const struct phys_scene *scene = run->system.scene;
    phys_runfile_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_runfile_number(file, "parameters", scene->params[k].name,
                            phys_system_get(&run->system, scene->params[k].name),
                            scene->params[k].unit);
}

/* Half 0 (coordinates) or 1 (velocities) of the samples, as [dof x samples]. */
static enum ad_status file_half(const struct simulate_result *result, size_t half, const char *name,
                                phys_runfile *file, struct ad_error *error)
{
    const struct simulate_samples *s = &result->samples;
    double *values = malloc(s->dof * s->n * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < s->dof; k++)
        for (size_t i = 0; i < s->n; i++)
            values[k * s->n + i] = s->x[(2 * i + half) * s->dof + k];
    phys_runfile_write(file, name, AD_F64, 2, (size_t[]){s->dof, s->n}, values);
    phys_runfile_text(file, name, "axes", "coordinate, sample");
    free(values);
    return AD_OK;
}

static void file_units(const struct phys_scene *scene, phys_runfile *file)
{
    const char *time = unit_shown(scene->time_unit);
    char speed[64];
    snprintf(speed, sizeof speed, "%s%s%s", scene->unit, *time ? "/" : "", time);
    phys_runfile_text(file, "path", "unit", scene->unit);
    phys_runfile_text(file, "velocity", "unit", speed);
}

enum ad_status simulate_file(const struct simulate_run *run, const struct simulate_result *result,
                             const struct report *report, phys_runfile *file,
                             struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    const struct simulate_samples *s = &result->samples;
    phys_runfile_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_runfile_text(file, "/", "command", run->options->common.command);
    phys_runfile_integer(file, "/", "seed", (int64_t)run->options->common.seed, NULL);
    report_file(report, file, error);
    file_parameters(run, file);
    phys_runfile_write(file, "time", AD_F64, 1, &s->n, s->t);
    phys_runfile_text(file, "time", "unit", scene->time_unit);
    phys_runfile_write(file, "energy", AD_F64, 1, &s->n, s->energy);
    phys_runfile_text(file, "energy", "unit", scene->energy_unit);
    if (result->distance) {
        phys_runfile_write(file, "error", AD_F64, 1, &s->n, result->distance);
        phys_runfile_text(file, "error", "unit", scene->unit);
    }
    if (event_answers_file(&result->events, &run->questions, file, error) != AD_OK)
        return error->status;
    if (file_half(result, 0, "path", file, error) == AD_OK &&
        file_half(result, 1, "velocity", file, error) == AD_OK)
        file_units(scene, file);
    return error->status;
}
