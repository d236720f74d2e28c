/* The files of simulate --ensemble: CSV and HDF5. */
#include "simulate_ensemble.h"
#include "apps/output/report.h"

#include <math.h>
#include <stdlib.h>

void simulate_ensemble_csv(const void *context, FILE *out)
{
    const struct ensemble_run *r = context;
    const struct phys_ensemble *e = &r->ensemble;
    char name[SIMULATE_NAME];
    if (r->run->section.number) {
        simulate_section_csv(r->run, out);
        return;
    }
    fprintf(out, "row,%s", phys_time_name(e->system));
    for (size_t k = 0; k <= 2 * e->dof; k++) {
        simulate_quantity(e->system, k, name);
        fprintf(out, ",%s", name);
    }
    fputc('\n', out);
    for (size_t i = 0; i < e->n; i++)
        for (size_t j = 0; j < e->n_times; j++) {
            const size_t at = i * e->n_times + j;
            const double *x = e->x + 2 * e->dof * at;
            if (isnan(x[0]))
                break;
            fprintf(out, "%zu,%.17g", i + 1, e->t[j]);
            for (size_t k = 0; k < 2 * e->dof; k++)
                fprintf(out, ",%.17g", x[k]);
            fprintf(out, ",%.17g\n", e->energy[at]);
        }
}

/* Coordinates (half 0) or velocities, [members x dof x times]. */
static enum ad_status file_half(const struct phys_ensemble *e, size_t half, const char *name,
                                const char *unit, phys_hdf5 *file, struct ad_error *error)
{
    double *values = malloc(e->n * e->dof * e->n_times * sizeof *values), *to = values;
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < e->n; i++)
        for (size_t k = half * e->dof; k < (half + 1) * e->dof; k++)
            for (size_t j = 0; j < e->n_times; j++)
                *to++ = e->x[(i * e->n_times + j) * 2 * e->dof + k];
    phys_hdf5_write(file, name, AD_F64, 3, (size_t[]){e->n, e->dof, e->n_times}, values);
    phys_hdf5_text(file, name, "axes", "row, coordinate, time");
    phys_hdf5_text(file, name, "unit", unit);
    free(values);
    return error->status;
}

/* The folder "spread": [2 dof + 1 x times], coordinates, velocities and energy. */
static enum ad_status file_spread(const struct phys_ensemble *e, phys_hdf5 *file,
                                  struct ad_error *error)
{
    static const char *const names[] = {"spread/members", "spread/mean", "spread/deviation",
                                        "spread/q05",     "spread/q25",  "spread/q50",
                                        "spread/q75",     "spread/q95"};
    const size_t n = 2 * e->dof + 1;
    double *values = malloc(n * e->n_times * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_hdf5_folder(file, "spread");
    for (size_t what = 0; what < sizeof names / sizeof *names; what++) {
        for (size_t k = 0; k < n; k++)
            for (size_t j = 0; j < e->n_times; j++) {
                const struct phys_spread *s = &e->spread[j * n + k];
                values[k * e->n_times + j] = what == 0   ? (double)s->n
                                             : what == 1 ? s->mean
                                             : what == 2 ? s->deviation
                                                         : s->quantile[what - 3];
            }
        phys_hdf5_write(file, names[what], AD_F64, 2, (size_t[]){n, e->n_times}, values);
        phys_hdf5_text(file, names[what], "axes", "coordinates, velocities and energy; time");
    }
    free(values);
    return error->status;
}

/* The folder "events": of all members in turn. */
static enum ad_status file_events(const struct ensemble_run *r, phys_hdf5 *file,
                                  struct ad_error *error)
{
    static const char *const names[] = {"events/row", "events/number", "events/time",
                                        "events/uncertainty", "events/touch"};
    const struct phys_ensemble *e = &r->ensemble;
    size_t n = 0, states = 2 * e->dof;
    for (size_t i = 0; i < e->n; i++)
        n += e->member[i].crossed.n;
    if (r->settings.motion->n_crossings == 0)
        return AD_OK;
    double *values = malloc((n + 1) * states * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_hdf5_folder(file, "events");
    for (size_t what = 0; n > 0 && what <= sizeof names / sizeof *names; what++) {
        double *to = values;
        for (size_t i = 0; i < e->n; i++) {
            const struct phys_crossed *c = &e->member[i].crossed;
            for (size_t k = 0; k < c->n; k++) {
                const double of[] = {(double)i + 1, c->which[k], c->t[k], c->uncertainty[k],
                                     c->touch[k]};
                for (size_t s = 0; what == sizeof names / sizeof *names && s < states; s++)
                    *to++ = c->x[k * states + s];
                if (what < sizeof names / sizeof *names)
                    *to++ = of[what];
            }
        }
        if (what < sizeof names / sizeof *names)
            phys_hdf5_write(file, names[what], AD_F64, 1, &n, values);
        else
            phys_hdf5_write(file, "events/state", AD_F64, 2, (size_t[]){n, states}, values);
    }
    free(values);
    return error->status;
}

enum ad_status simulate_ensemble_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct ensemble_run *r = context;
    const struct phys_ensemble *e = &r->ensemble;
    const struct phys_scene *scene = e->system->scene;
    char speed[64];
    const char *time = unit_shown(scene->time_unit);
    snprintf(speed, sizeof speed, "%s%s%s", scene->unit, *time ? "/" : "", time);
    simulate_section_file(r->run, file);
    phys_hdf5_integer(file, "/", "seed", (int64_t)r->run->options->common.seed, NULL);
    report_parameters(e->system, file);
    phys_hdf5_write(file, "columns", AD_F64, 2, (size_t[]){r->settings.n, r->settings.n_columns},
                    r->settings.values);
    phys_hdf5_text(file, "columns", "axes", "row, column");
    phys_hdf5_write(file, "time", AD_F64, 1, &e->n_times, e->t);
    phys_hdf5_text(file, "time", "unit", scene->time_unit);
    phys_hdf5_write(file, "energy", AD_F64, 2, (size_t[]){e->n, e->n_times}, e->energy);
    phys_hdf5_text(file, "energy", "unit", scene->energy_unit);
    phys_hdf5_text(file, "energy", "axes", "row, time");
    if (file_half(e, 0, "path", scene->unit, file, error) == AD_OK &&
        file_half(e, 1, "velocity", speed, file, error) == AD_OK &&
        file_spread(e, file, error) == AD_OK)
        file_events(r, file, error);
    return error->status;
}
