/* The models of an ensemble of trainings (train --seeds, --sweep), each followed as by a rollout of
   its own, and what they have in common: mean and spread of the motion and of its errors. */
#include "autodiff/free.h"
#include "apps/file_names.h"
#include "apps/output/figure.h"
#include "apps/output/report.h"
#include "physics/io/checksum.h"
#include "physics/io/fields.h"
#include "rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMBERS_MOST = 1000, PANELS = 4 };

struct ensemble {
    const struct rollout_options *options;
    size_t n, missed; /* models followed; models that could not be */
    size_t files, hashes;
    char **name, **hash;     /* beside the table, and their checksums; empty: none */
    struct rollout_run *run; /* [n] */
    char why[300];           /* of the first that missed */
};

/* ---- the table ---- */

static char *read_lines(const char *file, const char *name, struct ad_error *error)
{
    phys_hdf5 *table = NULL;
    char *text = NULL;
    if (phys_hdf5_open(file, &table, error) == AD_OK)
        phys_hdf5_get_text(table, "/", name, &text, error);
    phys_hdf5_close(table);
    return text;
}

bool rollout_is_ensemble(const char *file)
{
    struct ad_error none = {0};
    char *text = read_lines(file, "members", &none);
    free(text);
    return text != NULL;
}

static enum ad_status find_members(struct ensemble *e, struct ad_error *error)
{
    const char *table = e->options->common.argument[0];
    const struct phys_separator line = {.text = '\n'};
    char *text = read_lines(table, "members", error);
    char *sums = text ? read_lines(table, "checksums", error) : NULL;
    if (sums && !(phys_fields_split(text, text + strlen(text), line, &e->name, &e->files) &&
                  phys_fields_split(sums, sums + strlen(sums), line, &e->hash, &e->hashes)))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (error->status == AD_OK && e->hashes != e->files)
        ad_fail(error, AD_E_INPUT, "%s: %zu models and %zu checksums", table, e->files, e->hashes);
    if (error->status == AD_OK && e->files > MEMBERS_MOST)
        ad_fail(error, AD_E_INPUT, "%s: %zu models; expected at most %d", table, e->files,
                MEMBERS_MOST);
    for (size_t k = 0; k < e->files && error->status == AD_OK; k++)
        if (e->name[k] && strchr(e->name[k], '/'))
            ad_fail(error, AD_E_INPUT, "%s: '%s' is not a file beside it", table, e->name[k]);
    AD_FREE(text, sums);
    return error->status;
}

/* A file in the folder of the table, to be freed. */
static char *beside(const char *table, const char *name)
{
    const char *slash = strrchr(table, '/');
    const size_t folder = slash ? (size_t)(slash - table) + 1 : 0;
    char *file = malloc(folder + strlen(name) + 1);
    if (file) {
        memcpy(file, table, folder);
        strcpy(file + folder, name);
    }
    return file;
}

/* Models that the table names are inputs, too. */
static enum ad_status check_outputs(const struct ensemble *e, struct ad_error *error)
{
    const struct common *c = &e->options->common;
    const struct file_name outputs[] = {{"--", "out", c->out, true},
                                        {"--", "csv", c->csv, true},
                                        {"--", "plot", c->plot, true},
                                        {"--", "log", c->log, true}};
    for (size_t k = 0; k < e->files && error->status == AD_OK; k++) {
        char *file = e->name[k] && *e->name[k] ? beside(c->argument[0], e->name[k]) : NULL;
        for (size_t i = 0; i < sizeof outputs / sizeof *outputs && file; i++)
            file_names_check(
                2, (struct file_name[]){{"", "a model of the table", file, false}, outputs[i]},
                error);
        free(file);
    }
    return error->status;
}

/* ---- the motions ---- */

/* Whether a file is that which the table was written about. */
static enum ad_status check_file(const char *file, const char *known, struct ad_error *error)
{
    char hash[PHYS_CHECKSUM_DIGITS + 1];
    phys_checksum_read(file, hash);
    return known && strcmp(hash, known) == 0
               ? AD_OK
               : ad_fail(error, AD_E_INPUT,
                         "%s: not the model of the table: it was replaced; expected the file of "
                         "that training, or a table of its own",
                         file);
}

static enum ad_status follow(struct ensemble *e, size_t k, const char *file, struct ad_error *error)
{
    struct rollout_run *run = &e->run[e->n];
    struct ad_error missed = {0};
    struct rollout_options *options = malloc(sizeof *options);
    hnn_model *model = NULL;
    if (!options)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *options = *e->options;
    options->common.argument[0] = file;
    if (hnn_model_load(file, &model, error) == AD_OK && hnn_model_settings(model)->pixels)
        ad_fail(error, AD_E_ARGUMENT, "%s: expected models of states, got one of pixels", file);
    if (error->status != AD_OK || check_file(file, e->hash[k], error) != AD_OK) {
        hnn_model_free(model);
        free(options);
        return error->status;
    }
    rollout_setup(options, model, run, error);
    if (error->status == AD_OK && e->n && run->model[0].ode.n != e->run[0].model[0].ode.n)
        ad_fail(error, AD_E_INPUT, "%s: has %zu components, the models before it %zu", file,
                run->model[0].ode.n, e->run[0].model[0].ode.n);
    if (error->status == AD_OK && rollout_run(run, &missed) == AD_OK) {
        e->n++;
    } else {
        rollout_free(run);
        if (missed.status != AD_OK && e->missed++ == 0)
            memcpy(e->why, missed.message, sizeof e->why - 1);
    }
    free(options);
    return error->status;
}

static enum ad_status follow_all(void *context, struct ad_error *error)
{
    struct ensemble *e = context;
    e->run = calloc(e->files, sizeof *e->run);
    if (!e->run)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < e->files && error->status == AD_OK; k++) {
        if (!e->name[k] || !*e->name[k]) {
            e->missed++;
            continue;
        }
        char *file = beside(e->options->common.argument[0], e->name[k]);
        if (file)
            follow(e, k, file, error);
        else
            ad_fail(error, AD_E_MEMORY, "out of memory");
        free(file);
    }
    return error->status == AD_OK && e->n == 0
               ? ad_fail(error, AD_E_ACCURACY, "none of %zu models can be followed: %.250s",
                         e->files, e->why)
               : error->status;
}

/* ---- what they have in common ---- */

static const struct rollout_run *first(const struct ensemble *e) { return &e->run[0]; }

static bool knows_energy(const struct ensemble *e) { return first(e)->energy.n > 0; }

/* Of component k at output i; k = states: of the true energy. */
static struct spread spread_at(const struct ensemble *e, size_t k, size_t i, double *values)
{
    const size_t states = first(e)->model[0].ode.n;
    for (size_t m = 0; m < e->n; m++) {
        const struct hnn_path *path = &e->run[m].model[0].path;
        values[m] =
            k < states ? path->x[i * states + k] : hnn_path_energy(&first(e)->energy, path, i);
    }
    return spread_of(e->n, values, 1);
}

static double truth_at(const struct ensemble *e, size_t k, size_t i)
{
    const struct hnn_path *truth = &first(e)->truth;
    return truth->n == 0       ? (double)NAN
           : k < truth->states ? truth->x[i * truth->states + k]
                               : hnn_path_energy(&first(e)->energy, truth, i);
}

static size_t quantities(const struct ensemble *e)
{
    return first(e)->model[0].ode.n + knows_energy(e);
}

static void name_quantity(const struct ensemble *e, size_t k, char *name, size_t size)
{
    if (k < first(e)->model[0].ode.n)
        phys_ode_component(&first(e)->model[0].ode, k, name, size);
    else
        snprintf(name, size, "energy");
}

/* ---- outputs ---- */

static void report_ensemble(const void *context, struct report *report)
{
    const struct ensemble *e = context;
    const struct hnn_rollout_settings *s = &first(e)->settings;
    const struct rollout_row *rows;
    const size_t n = rollout_numbers(&rows);
    report_line(report, "%s, %zu outputs over a time of %g, %zu models", rollout_method(first(e)),
                s->n, s->t[s->n - 1] - s->t[0], e->n);
    report_text(report, "integrator", NULL, rollout_method(first(e)));
    report_text(report, "truth", NULL, e->options->truth);
    report_count(report, "members", NULL, e->n);
    report_count(report, "missed", e->missed ? "models that fail" : NULL, e->missed);
    report_text(report, "missed_because", NULL, *e->why ? e->why : NULL);
    if (*e->why)
        report_line(report, "  %s", e->why);
    for (size_t r = 0; r < n; r++) {
        double *values = malloc((e->n + 1) * sizeof *values);
        for (size_t m = 0; m < e->n && values; m++)
            memcpy(&values[m], (const char *)&e->run[m].model[0] + rows[r].offset, sizeof *values);
        const struct spread spread = spread_of(values ? e->n : 0, values, 1);
        report->failed = report->failed || !values;
        free(values);
        if (spread.n == 0)
            continue;
        report_item(report, "spread");
        report_text(report, "number", "over models", rows[r].key);
        report_spread(report, "models", NULL, &spread);
    }
    report_item(report, NULL);
}

static void write_csv(const void *context, FILE *out)
{
    const struct ensemble *e = context;
    double *values = malloc(e->n * sizeof *values);
    char name[32];
    fputc('t', out);
    for (size_t k = 0; k < quantities(e) && values; k++) {
        name_quantity(e, k, name, sizeof name);
        fprintf(out, ",%s_mean,%s_deviation,%s_least,%s_most,truth_%s", name, name, name, name,
                name);
    }
    for (size_t i = 0; i < first(e)->settings.n && values; i++) {
        fprintf(out, "\n%.17g", first(e)->t[i]);
        for (size_t k = 0; k < quantities(e); k++) {
            const struct spread s = spread_at(e, k, i, values);
            const double cell[] = {s.mean, s.deviation, s.least, s.most, truth_at(e, k, i)};
            for (size_t c = 0; c < sizeof cell / sizeof *cell; c++)
                csv_number(out, 17, cell[c]);
        }
    }
    fputc('\n', out);
    free(values);
}

/* state [members x n x states], and the truth. */
static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct ensemble *e = context;
    const size_t n = first(e)->settings.n, states = first(e)->model[0].ode.n, one = n * states;
    double *all = malloc(e->n * one * sizeof *all);
    if (!all)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t m = 0; m < e->n; m++)
        memcpy(all + m * one, e->run[m].model[0].path.x, one * sizeof *all);
    phys_hdf5_write(file, "time", AD_F64, 1, &n, first(e)->t);
    phys_hdf5_write(file, "members_state", AD_F64, 3, (size_t[]){e->n, n, states}, all);
    phys_hdf5_text(file, "members_state", "axes", "model, output, component");
    if (first(e)->truth.n)
        phys_hdf5_write(file, "truth_state", AD_F64, 2, (size_t[]){n, states}, first(e)->truth.x);
    free(all);
    return AD_OK;
}

/* Columns of a quantity: mean, mean less and plus the deviation, least, most, truth. */
enum { COLUMNS = 6 };

static void write_data(const struct ensemble *e, FILE *out)
{
    double *values = malloc(e->n * sizeof *values);
    fputs("# t; of each quantity mean, mean -+ deviation, least, most, truth\n", out);
    for (size_t i = 0; i < first(e)->settings.n && values; i++) {
        fprintf(out, "%.9g", first(e)->t[i]);
        for (size_t k = 0; k < quantities(e); k++) {
            const struct spread s = spread_at(e, k, i, values);
            const double half = e->n > 1 ? s.deviation : 0, truth = truth_at(e, k, i);
            fprintf(out, " %.9g %.9g %.9g %.9g %.9g", s.mean, s.mean - half, s.mean + half, s.least,
                    s.most);
            fprintf(out, isnan(truth) ? " NaN" : " %.9g", truth);
        }
        fputc('\n', out);
    }
    free(values);
}

static void draw_quantity(struct figure *figure, const struct ensemble *e, size_t k)
{
    const struct rollout_run *run = first(e);
    const size_t at = 2 + COLUMNS * k;
    char name[32];
    name_quantity(e, k, name, sizeof name);
    figure_panel(figure,
                 &(struct panel){.across = {"t", NULL, {run->t[0], run->t[run->settings.n - 1]}, 0},
                                 .up = {name, NULL, {0, 0}, 0},
                                 .key = KEY_ABOVE});
    figure_element(figure, "data using 1:%zu:%zu with filledcurves fc rgb '#dcebf5' title 'all'",
                   at + 3, at + 4);
    figure_element(figure,
                   "data using 1:%zu:%zu with filledcurves fc rgb '#9cc7e4' title 'deviation'",
                   at + 1, at + 2);
    figure_draw(figure, STYLE(figure_colours[0], 0, 1.6, 0), "mean", "data using 1:%zu", at);
    if (run->truth.n)
        figure_draw(figure, STYLE("#303030", 0, 1, 0), "truth", "data using 1:%zu", at + 5);
}

/* The first coordinates, and the energy. */
static enum ad_status draw(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct ensemble *e = context;
    const size_t states = first(e)->model[0].ode.n, dof = states / 2,
                 most = PANELS - knows_energy(e);
    const size_t shown = dof == 1 ? 2 : dof < most ? dof : most, all = shown + knows_energy(e);
    char title[80];
    struct figure figure;
    struct layout layout = figure_pair;
    layout.columns = all > 1 ? 2 : 1;
    layout.rows = all > 2 ? 2 : 1;
    layout.height = all > 2 ? 760 : 440;
    layout.gap.y = 0.16;
    layout.gap.x = 0.11;
    layout.room.right = 0.98;
    layout.room.top = 0.88;
    layout.title = title;
    snprintf(title, sizeof title, "motion of %zu networks by %s", e->n, rollout_method(first(e)));
    write_data(e, plot->data);
    figure_begin(&figure, plot, &layout);
    for (size_t k = 0; k < shown; k++)
        draw_quantity(&figure, e, k);
    if (knows_energy(e))
        draw_quantity(&figure, e, states);
    figure_end(&figure);
    return error->status;
}

static const struct output_kind ensemble_outputs = {report_ensemble, write_file, write_csv, draw,
                                                    NULL};

enum ad_status rollout_ensemble(const struct rollout_options *options, struct ad_error *error)
{
    struct ensemble e = {.options = options};
    if (options->against)
        ad_fail(error, AD_E_ARGUMENT, "--against: %s is an ensemble; expected one model",
                options->common.argument[0]);
    else if (find_members(&e, error) == AD_OK && check_outputs(&e, error) == AD_OK &&
             outputs_run(&ensemble_outputs, &options->common, &e, follow_all, error) == AD_OK &&
             e.missed)
        ad_fail(error, AD_E_ACCURACY, "%zu of %zu models cannot be followed: %.250s", e.missed,
                e.files, *e.why ? e.why : "they were not trained");
    for (size_t k = 0; k < e.n; k++)
        rollout_free(&e.run[k]);
    free(e.run);
    phys_fields_free(e.name, e.files);
    phys_fields_free(e.hash, e.hashes);
    return error->status;
}
