/* Sections of motions by a surface, with --section (simulate.h): a row for each crossing of it. The
   start is no crossing, nor is a touch. */
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void simulate_quantity(const struct phys_system *system, size_t k, char *name)
{
    char coordinate[64];
    if (k >= 2 * system->dof) {
        snprintf(name, SIMULATE_NAME, "%s",
                 k == 2 * system->dof ? "energy" : phys_time_name(system));
        return;
    }
    phys_coordinate_name(system, k % system->dof, coordinate, sizeof coordinate);
    snprintf(name, SIMULATE_NAME, "%s%s", k < system->dof ? "" : "v_", coordinate);
}

/* ---- rows ---- */

/* The larger of the errors known before and after t, as not every sample is compared; NaN: one of
   them is not. Times ascend, and so does *sample, the last before t that is compared. */
static double error_at(const struct phys_motion_solution *m, double t, size_t *sample)
{
    for (size_t i = *sample; m->distance && i < m->n; i++) {
        if (isnan(m->distance[i]))
            continue;
        if (m->t[i] >= t)
            return fmax(m->distance[*sample], m->distance[i]);
        *sample = i;
    }
    return (double)NAN;
}

static enum ad_status collect(struct simulate_run *run, const struct phys_ensemble *many,
                              struct ad_error *error)
{
    struct simulate_section *s = &run->section;
    const size_t dof = run->system.dof, columns = 3 + 2 * dof, members = many ? many->n : 1;
    size_t n = 0;
    for (size_t i = 0; i < members; i++)
        n += many ? many->member[i].crossed.n : run->motion.crossed.n;
    if (!(s->row = malloc((n + 1) * columns * sizeof *s->row)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < members; i++) {
        const struct phys_crossed *c = many ? &many->member[i].crossed : &run->motion.crossed;
        for (size_t k = 0, sample = 0; k < c->n; k++) {
            double *row = s->row + s->n * columns;
            bool ours = (size_t)c->which[k] == s->number, touch = c->touch[k] != 0;
            s->touches += ours && touch;
            if (!ours || touch)
                continue;
            row[0] = (double)i + 1;
            row[1] = c->t[k];
            memcpy(row + 2, c->x + 2 * dof * k, 2 * dof * sizeof *row);
            row[2 + 2 * dof] = !many                      ? error_at(&run->motion, c->t[k], &sample)
                               : isnan(c->uncertainty[k]) ? (double)NAN
                                                          : many->member[i].error;
            s->n++;
        }
    }
    return AD_OK;
}

/* Points after one that is not known are not known either, by whatever the chance is that the error
   shrinks. */
static void find_known(struct simulate_run *run, const struct phys_ensemble *many)
{
    const double share = 1e-3; /* as fine as a picture shows */
    struct simulate_section *s = &run->section;
    const size_t dof = run->system.dof, columns = 3 + 2 * dof;
    const size_t samples = many ? many->n * many->n_times : run->motion.n;
    const double *x = many ? many->x : run->motion.x;
    double size = 0, member = 0;
    bool lost = false;
    for (size_t i = 0; i < samples; i++)
        for (size_t k = 0; k < dof; k++)
            size = fmax(size, fabs(x[2 * dof * i + k]));
    s->accuracy = run->settings.error > 0 ? run->settings.error : share * size;
    s->lost = (double)NAN;
    for (size_t i = 0; i < s->n; i++) {
        double *row = s->row + i * columns, *error = row + 2 + 2 * dof;
        lost = row[0] == member && lost;
        member = row[0];
        if (!lost && !(*error <= s->accuracy)) {
            s->lost = fmin(row[1], isnan(s->lost) ? INFINITY : s->lost);
            lost = true;
        }
        *error = lost && *error <= s->accuracy ? (double)NAN : *error;
        s->known += !lost;
    }
}

enum ad_status simulate_section(struct simulate_run *run, const struct phys_ensemble *many,
                                struct ad_error *error)
{
    struct simulate_section *s = &run->section;
    struct phys_diagnosis *d = &run->diagnosis;
    if (s->number == 0 || collect(run, many, error) != AD_OK)
        return error->status;
    find_known(run, many);
    if (s->known < s->n && d->n_warnings < PHYS_DIAGNOSIS_WARNINGS)
        snprintf(d->warning[d->n_warnings++], sizeof *d->warning,
                 "section %s: %zu of %zu points%s, the first at t = %.6g, are not known to %.2g to "
                 "be of %s: %s",
                 run->options->section, s->n - s->known, s->n, many ? " of all members" : "",
                 s->lost, s->accuracy, many ? "these starts" : "this start",
                 run->options->no_reference ? "no error is measured"
                                            : "try a smaller --tol, or a shorter --time");
    return AD_OK;
}

enum ad_status simulate_section_judge(const struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_section *s = &run->section;
    return s->number && s->n == 0
               ? ad_fail(error, AD_E_ACCURACY,
                         "--section %s: not crossed before t = %g; try another value, or a longer "
                         "--time",
                         run->options->section,
                         run->options->ensemble ? run->settings.time : run->motion.info.t)
               : AD_OK;
}

/* ---- writing ---- */

void simulate_section_report(const struct simulate_run *run, struct report *report)
{
    const struct simulate_section *s = &run->section;
    const struct phys_scene *scene = run->system.scene;
    if (s->number == 0)
        return;
    report_text(report, "section", NULL, run->options->section);
    report_count(report, "section_points", "points of the section", s->n);
    report_count(report, "section_touches", s->touches ? "  touched, not crossed" : NULL,
                 s->touches);
    report_count(report, "section_known", "  known to the accuracy", s->known);
    report_number(report, "section_accuracy", "  accuracy", scene->unit, s->accuracy);
    report_number(report, "section_lost", "  not known from t =", scene->time_unit, s->lost);
}

void simulate_section_csv(const struct simulate_run *run, FILE *out)
{
    const struct simulate_section *s = &run->section;
    const size_t dof = run->system.dof, columns = 3 + 2 * dof;
    const size_t first = run->options->ensemble ? 0 : 1;
    char name[SIMULATE_NAME];
    fprintf(out, "%s%s", first ? "" : "row,", phys_time_name(&run->system));
    for (size_t k = 0; k < 2 * dof; k++) {
        simulate_quantity(&run->system, k, name);
        fprintf(out, ",%s", name);
    }
    fputs(",error\n", out);
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = first; k < columns; k++) {
            double x = s->row[i * columns + k];
            if (k > first)
                fputc(',', out);
            if (!isnan(x))
                fprintf(out, "%.17g", x);
            if (k + 1 == columns)
                fputc('\n', out);
        }
}

void simulate_section_file(const struct simulate_run *run, phys_hdf5 *file)
{
    const struct simulate_section *s = &run->section;
    if (s->n == 0)
        return;
    phys_hdf5_write(file, "section", AD_F64, 2, (size_t[]){s->n, 3 + 2 * run->system.dof}, s->row);
    phys_hdf5_text(file, "section", "axes", "point; row, t, coordinates, velocities, error");
}
