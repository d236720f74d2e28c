/* Output files of a simulation (simulate.h): CSV and run file. */
#include "simulate.h"
#include "apps/output/report.h"

#include <stdlib.h>

/* ---- CSV ---- */

void simulate_write_csv(const void *context, FILE *out)
{
    const struct simulate_run *run = context;
    const struct phys_motion_solution *s = &run->motion;
    size_t dof = run->system.dof;
    char name[SIMULATE_NAME];
    if (run->section.number) {
        simulate_section_csv(run, out);
        return;
    }
    if (run->family.n) {
        simulate_family_csv(run, out);
        return;
    }
    fputs(phys_time_name(&run->system), out);
    for (size_t k = 0; k < 2 * dof; k++) {
        simulate_quantity(&run->system, k, name);
        fprintf(out, ",%s", name);
    }
    for (size_t k = 0; run->reactions && k < dof; k++) {
        simulate_quantity(&run->system, k, name);
        fprintf(out, ",reaction_%s", name);
    }
    for (size_t k = 0; run->observed && k < run->system.scene->n_observables; k++)
        fprintf(out, ",%s", run->system.scene->observables[k].name);
    fputc('\n', out);
    for (size_t i = 0; i < s->n; i++) {
        fprintf(out, "%.17g", s->t[i]);
        for (size_t k = 0; k < 2 * dof; k++)
            fprintf(out, ",%.17g", s->x[2 * i * dof + k]);
        for (size_t k = 0; run->reactions && k < dof; k++)
            fprintf(out, ",%.17g", run->reactions[i * dof + k]);
        for (size_t k = 0; run->observed && k < run->system.scene->n_observables; k++)
            fprintf(out, ",%.17g", run->observed[k * s->n + i]);
        fputc('\n', out);
    }
}

/* ---- run file ---- */

/* Half 0 (coordinates) or 1 (velocities) of the samples, as [dof x samples]. */
static enum ad_status file_half(const struct phys_motion_solution *s, size_t half, const char *name,
                                phys_hdf5 *file, struct ad_error *error)
{
    size_t dof = s->system->dof;
    double *values = malloc(dof * s->n * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < s->n; i++)
            values[k * s->n + i] = s->x[(2 * i + half) * dof + k];
    phys_hdf5_write(file, name, AD_F64, 2, (size_t[]){dof, s->n}, values);
    phys_hdf5_text(file, name, "axes", "coordinate, sample");
    free(values);
    return AD_OK;
}

static void file_units(const struct phys_scene *scene, phys_hdf5 *file)
{
    const char *time = unit_shown(scene->time_unit);
    char speed[64];
    snprintf(speed, sizeof speed, "%s%s%s", scene->unit, *time ? "/" : "", time);
    phys_hdf5_text(file, "path", "unit", scene->unit);
    phys_hdf5_text(file, "velocity", "unit", speed);
}

/* The folder "events": number of the question, time, state. */
static void file_events(const struct simulate_run *run, phys_hdf5 *file)
{
    const struct phys_crossed *c = &run->motion.crossed;
    if (run->settings.n_crossings == 0)
        return;
    phys_hdf5_folder(file, "events");
    for (size_t k = 0; k < run->settings.n_crossings; k++) {
        char name[24];
        snprintf(name, sizeof name, "%zu", k + 1);
        phys_hdf5_text(file, "events", name, run->crossings[k].text);
    }
    if (c->n == 0)
        return;
    phys_hdf5_write(file, "events/number", AD_F64, 1, &c->n, c->which);
    phys_hdf5_write(file, "events/touch", AD_F64, 1, &c->n, c->touch);
    phys_hdf5_write(file, "events/time", AD_F64, 1, &c->n, c->t);
    phys_hdf5_write(file, "events/uncertainty", AD_F64, 1, &c->n, c->uncertainty);
    phys_hdf5_write(file, "events/state", AD_F64, 2, (size_t[]){c->n, 2 * run->system.dof}, c->x);
    phys_hdf5_text(file, "events/state", "axes", "event, coordinates and velocities");
}

enum ad_status simulate_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct simulate_run *run = context;
    const struct phys_scene *scene = run->system.scene;
    const struct phys_motion_solution *s = &run->motion;
    phys_hdf5_integer(file, "/", "seed", (int64_t)run->options->common.seed, NULL);
    report_parameters(&run->system, file);
    phys_hdf5_write(file, "time", AD_F64, 1, &s->n, s->t);
    phys_hdf5_text(file, "time", "unit", scene->time_unit);
    phys_hdf5_write(file, "energy", AD_F64, 1, &s->n, s->energy);
    phys_hdf5_text(file, "energy", "unit", scene->energy_unit);
    if (s->distance) {
        phys_hdf5_write(file, "error", AD_F64, 1, &s->n, s->distance);
        phys_hdf5_text(file, "error", "unit", scene->unit);
    }
    if (run->reactions) {
        phys_hdf5_write(file, "reaction", AD_F64, 2, (size_t[]){s->n, run->system.dof},
                        run->reactions);
        phys_hdf5_text(file, "reaction", "axes", "sample, coordinate");
    }
    if (run->observed) {
        phys_hdf5_write(file, "observable", AD_F64, 2,
                        (size_t[]){run->system.scene->n_observables, s->n}, run->observed);
        phys_hdf5_text(file, "observable", "axes", "observable, sample");
    }
    file_events(run, file);
    simulate_section_file(run, file);
    if (simulate_family_file(run, file, error) == AD_OK &&
        file_half(s, 0, "path", file, error) == AD_OK &&
        file_half(s, 1, "velocity", file, error) == AD_OK)
        file_units(scene, file);
    return error->status;
}
