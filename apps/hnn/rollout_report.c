/* What a rollout came to (rollout.h): table, JSON, CSV, run file. */
#include "rollout.h"
#include "apps/command.h"
#include "apps/output/json.h"

#include <math.h>
#include <stdlib.h>

/* The measures, in the order of the table. */
static const struct measure {
    const char *key, *what;
    size_t offset; /* in struct rollout_model */
} measures[] = {
#define AT(member) offsetof(struct rollout_model, member)
    {"energy_mse", "true energy, mean square error", AT(energy_mse)},
    {"energy_mse_published", "the same as published", AT(score.energy_mse_published)},
    {"energy_mse_model", "H of the model, mean square error", AT(energy_mse_model)},
    {"coordinate_mse", "state, mean square error", AT(coordinate_mse)},
    {"conserved_drift", "H of the model, largest change", AT(conserved_drift)},
    {"reversal_error", "distance from the start, back", AT(info.reversal_error)},
#undef AT
};

enum { N_MEASURES = sizeof measures / sizeof *measures };

static double value_of(const struct rollout_model *m, const struct measure *measure)
{
    return *(const double *)((const char *)m + measure->offset);
}

/* ---- table ---- */

static void print_measure(const struct rollout_run *run, const struct measure *measure)
{
    double first = value_of(&run->model[0], measure);
    double last = value_of(&run->model[run->n_models - 1], measure);
    if (isnan(first) && isnan(last))
        return;
    printf("  %-36s", measure->what);
    for (size_t k = 0; k < run->n_models; k++)
        if (isnan(value_of(&run->model[k], measure)))
            printf(" %13s", "-");
        else
            printf(" %13.4g", value_of(&run->model[k], measure));
    putchar('\n');
}

void rollout_print(const struct rollout_run *run)
{
    const struct hnn_rollout_settings *s = &run->settings;
    size_t starts = run->options->starts;
    printf("%s, t = %g to %g", s->integrator->name, s->t[0], s->t[s->n - 1]);
    if (starts != OPTION_NO_COUNT)
        printf(", means of %zu starts", starts);
    printf("\n\n  %-36s", "");
    for (size_t k = 0; k < run->n_models; k++)
        printf(" %13s", rollout_name(&run->model[k]));
    putchar('\n');
    for (size_t k = 0; k < N_MEASURES; k++)
        print_measure(run, &measures[k]);
    printf("  %-36s", "evaluations");
    for (size_t k = 0; k < run->n_models; k++)
        printf(" %13zu", run->model[k].info.evaluations);
    putchar('\n');
    for (size_t k = 0; k < run->n_models; k++)
        if (run->model[k].outside < run->model[k].path.n)
            printf("\n%s: outside its training from t = %.4g on: %s\n", run->model[k].file,
                   run->t[run->model[k].outside], run->model[k].what);
}

/* ---- JSON ---- */

static void json_model(struct json *json, const struct rollout_run *run,
                       const struct rollout_model *m)
{
    bool outside = m->outside < m->path.n;
    json_text(json, "file", m->file);
    json_text(json, "model", rollout_name(m));
    for (size_t k = 0; k < N_MEASURES; k++)
        json_number(json, measures[k].key, value_of(m, &measures[k]));
    json_count(json, "evaluations", m->info.evaluations);
    json_number(json, "seconds", m->info.seconds);
    json_number(json, "outside_from", outside ? run->t[m->outside] : (double)NAN);
    json_text(json, "outside", outside ? m->what : NULL);
}

void rollout_print_json(const struct rollout_run *run)
{
    const struct hnn_rollout_settings *s = &run->settings;
    size_t starts = run->options->starts;
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "integrator", s->integrator->name);
    json_text(&json, "truth", run->options->truth);
    json_count(&json, "starts", option_count_or(starts, 1));
    json_count(&json, "points", s->n);
    json_number(&json, "time", s->t[s->n - 1] - s->t[0]);
    json_model(&json, run, &run->model[0]);
    if (run->n_models > 1) {
        json_object(&json, "against");
        json_model(&json, run, &run->model[1]);
        json_end_object(&json);
    }
    json_close(&json);
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
        fprintf(out, isnan(energy[k]) ? "," : ",%.17g", energy[k]);
}

void rollout_write_csv(const struct rollout_run *run, FILE *out)
{
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
                       phys_runfile *file)
{
    static const char *const kind[] = {"H", "energy"};
    size_t n = c->path->n;
    char name[32];
    snprintf(name, sizeof name, "%sstate", c->prefix);
    phys_runfile_write(file, name, AD_F64, 2, (size_t[]){n, c->path->states}, c->path->x);
    phys_runfile_text(file, name, "axes", "output, component: coordinates, then momenta");
    for (size_t i = 0; i < n; i++) {
        double energy[2];
        energies(run, c, i, energy);
        values[i] = energy[0];
        values[n + i] = energy[1];
    }
    for (size_t k = 0; k < 2; k++) {
        snprintf(name, sizeof name, "%s%s", c->prefix, kind[k]);
        if (!isnan(values[k * n]))
            phys_runfile_write(file, name, AD_F64, 1, &n, values + k * n);
    }
}

enum ad_status rollout_file(const struct rollout_run *run, phys_runfile *file,
                            struct ad_error *error)
{
    struct rollout_curve curve[ROLLOUT_MODELS + 1];
    size_t n = rollout_curves(run, curve);
    double *values = malloc(2 * run->settings.n * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_runfile_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_runfile_text(file, "/", "command", run->options->common.command);
    phys_runfile_text(file, "/", "integrator", run->settings.integrator->name);
    for (size_t k = 0; k < N_MEASURES; k++)
        phys_runfile_number(file, "/", measures[k].key, value_of(&run->model[0], &measures[k]),
                            NULL);
    phys_runfile_write(file, "time", AD_F64, 1, &run->settings.n, run->t);
    for (size_t c = 0; c < n; c++)
        file_curve(run, &curve[c], values, file);
    free(values);
    return AD_OK;
}
