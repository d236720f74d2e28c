/* Results of a rollout (rollout.h): report, CSV, run file. */
#include "rollout.h"

#include <math.h>
#include <stdlib.h>

/* ---- report ---- */

void rollout_report_models(struct report *report, size_t n_rows, const struct rollout_row rows[],
                           size_t n, const struct rollout_model models[])
{
    report_line(report, "\n  %-24s %14s %14s", "", rollout_name(&models[0]),
                n > 1 ? rollout_name(&models[1]) : "");
    for (size_t k = 0; k < n; k++) {
        report->object = k ? "against" : NULL;
        report_text(report, "file", NULL, models[k].file);
        report_text(report, "model", NULL, rollout_name(&models[k]));
    }
    for (size_t r = 0; r < n_rows; r++)
        for (size_t k = 0; k < n; k++) {
            const char *at = (const char *)&models[k] + rows[r].offset;
            report->object = k ? "against" : NULL;
            report_number(report, rows[r].key, rows[r].label, NULL,
                          *(const double *)(const void *)at);
        }
    for (size_t k = 0; k < n; k++) {
        report->object = k ? "against" : NULL;
        report_count(report, "evaluations", "evaluations", models[k].info.evaluations);
    }
    for (size_t k = 0; k < n; k++) {
        const struct rollout_model *m = &models[k];
        double from = m->outside < m->path.n ? m->path.t[m->outside] : (double)NAN;
        report->object = k ? "against" : NULL;
        report->passing = true;
        report_number(report, "seconds", NULL, "s", m->info.seconds);
        report->passing = false;
        report_number(report, "outside_from", NULL, NULL, from);
        report_text(report, "outside", NULL, isnan(from) ? NULL : m->what);
        if (!isnan(from))
            report_line(report, "\n%s: outside its range of training from t = %.4g on: %s",
                        rollout_name(m), from, m->what);
    }
    report->object = NULL;
}

size_t rollout_numbers(const struct rollout_row **rows)
{
#define AT(member) offsetof(struct rollout_model, member)
    static const struct rollout_row all[] = {
        {"energy_mse", "true energy, MSE", AT(energy_mse)},
        {"energy_mse_published", "  as published", AT(score.energy_mse_published)},
        {"energy_mse_model", "H of the model, MSE", AT(energy_mse_model)},
        {"coordinate_mse", "state, MSE", AT(coordinate_mse)},
        {"conserved_drift", "H, largest change", AT(conserved_drift)},
        {"reversal_error", "reversal error", AT(info.reversal_error)},
    };
#undef AT
    *rows = all;
    return sizeof all / sizeof *all;
}

static void report_run(const void *context, struct report *report)
{
    const struct rollout_run *run = context;
    const struct rollout_row *rows;
    const size_t n_rows = rollout_numbers(&rows);
    const struct hnn_rollout_settings *s = &run->settings;
    double time = s->t[s->n - 1] - s->t[0];
    size_t starts = option_count_or(run->options->starts, 1);
    report_line(report, "%s, %zu outputs over a time of %g, %zu start%s", rollout_method(run), s->n,
                time, starts, starts > 1 ? "s: means" : "");
    report_text(report, "integrator", NULL, rollout_method(run));
    report_text(report, "truth", NULL, run->options->truth);
    report_count(report, "starts", NULL, starts);
    report_count(report, "points", NULL, s->n);
    report_number(report, "time", NULL, NULL, time);
    rollout_report_models(report, n_rows, rows, run->n_models, run->model);
}

/* ---- CSV ---- */

/* Energies of a sample: H of the curve's model (of the truth: of the first model), and the true
   one. */
static void energies(const struct rollout_run *run, const struct rollout_curve *c, size_t i,
                     double energy[2])
{
    const struct phys_ode *H = &(c->model ? c->model : &run->model[0])->ode;
    energy[0] = hnn_path_energy(H, c->path, i);
    energy[1] = hnn_path_energy(&run->energy, c->path, i);
}

static void names(const struct rollout_run *run, const struct rollout_curve *c, FILE *out)
{
    const struct phys_ode *ode = &run->model[0].ode;
    char name[32];
    for (size_t k = 0; k < ode->n; k++) {
        phys_ode_component(ode, k, name, sizeof name);
        fprintf(out, ",%s%s", c->prefix, name);
    }
    fprintf(out, ",%sH,%senergy", c->prefix, c->prefix);
}

static void cells(const struct rollout_run *run, const struct rollout_curve *c, size_t i, FILE *out)
{
    double energy[2];
    energies(run, c, i, energy);
    for (size_t k = 0; k < c->path->states; k++)
        fprintf(out, ",%.17g", c->path->x[i * c->path->states + k]);
    for (size_t k = 0; k < 2; k++)
        csv_number(out, 17, energy[k]);
}

static void write_csv(const void *context, FILE *out)
{
    const struct rollout_run *run = context;
    struct rollout_curve curve[ROLLOUT_MODELS + 1];
    size_t n = rollout_curves(run, curve);
    fputc('t', out);
    for (size_t c = 0; c < n; c++)
        names(run, &curve[c], out);
    for (size_t i = 0; i < run->settings.n; i++) {
        fprintf(out, "\n%.17g", run->t[i]);
        for (size_t c = 0; c < n; c++)
            cells(run, &curve[c], i, out);
    }
    fputc('\n', out);
}

/* ---- run file ---- */

static void file_curve(const struct rollout_run *run, const struct rollout_curve *c, double *values,
                       phys_hdf5 *file)
{
    static const char *const kind[] = {"H", "energy"};
    size_t n = c->path->n;
    char name[32];
    snprintf(name, sizeof name, "%sstate", c->prefix);
    phys_hdf5_write(file, name, AD_F64, 2, (size_t[]){n, c->path->states}, c->path->x);
    phys_hdf5_text(file, name, "axes", "output, component: coordinates, then momenta");
    for (size_t i = 0; i < n; i++) {
        double energy[2];
        energies(run, c, i, energy);
        values[i] = energy[0];
        values[n + i] = energy[1];
    }
    for (size_t k = 0; k < 2; k++) {
        snprintf(name, sizeof name, "%s%s", c->prefix, kind[k]);
        if (!isnan(values[k * n]))
            phys_hdf5_write(file, name, AD_F64, 1, &n, values + k * n);
    }
}

static void component(const void *ode, size_t k, char *text, size_t size)
{
    phys_ode_component(ode, k, text, size);
}

static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct rollout_run *run = context;
    const struct phys_ode *ode = &run->model[0].ode;
    struct rollout_curve curve[ROLLOUT_MODELS + 1];
    size_t n = rollout_curves(run, curve);
    double *values = malloc(2 * run->settings.n * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    report_coordinates(file, ode->n, ode, component, 0);
    phys_hdf5_write(file, "time", AD_F64, 1, &run->settings.n, run->t);
    for (size_t c = 0; c < n; c++)
        file_curve(run, &curve[c], values, file);
    free(values);
    return AD_OK;
}

const struct output_kind rollout_outputs = {report_run, write_file, write_csv, rollout_picture,
                                            NULL};
