/* What a fit gives: the report, rows of data and model, the picture. */
#include "apps/output/figure.h"
#include "fit.h"
#include "physics/stability/diagnostics.h"

#include <math.h>
#include <stdlib.h>

static const char *unit_of(const struct fit_run *run, size_t k)
{
    const struct phys_scene *scene = run->system.scene;
    for (size_t p = 0; k < run->fit.n_free && p < scene->n_params; p++)
        if (strcmp(scene->params[p].name, run->settings.free[k]) == 0)
            return scene->params[p].unit;
    return NULL;
}

static void report_unknowns(const struct fit_run *run, struct report *report)
{
    const struct phys_fit *fit = &run->fit;
    char name[80];
    for (size_t k = 0; k < fit->n_unknown; k++) {
        report_item(report, "unknowns");
        phys_fit_name(&run->system, &run->settings, fit, k, name, sizeof name);
        report_text(report, "name", "unknown", name);
        report_number(report, "value", "value", NULL,
                      phys_known_digits(fit->value[k], 0.01 * fit->deviation[k]));
        report_number(report, "deviation", "deviation", NULL,
                      phys_known_digits(fit->deviation[k], 0.05 * fit->deviation[k]));
        report_text(report, "unit", "unit", unit_of(run, k));
    }
    report_item(report, NULL);
}

/* Of the residuals of component i in neighbouring rows; 0 for independent noise. */
static double autocorrelation(const struct fit_run *run, size_t i)
{
    const size_t d = 2 * run->system.dof;
    const struct phys_fit_data *data = &run->data;
    double sum = 0, square = 0, last = NAN;
    for (size_t k = 0; k < data->n; k++) {
        const double off = data->x[k * d + i] - run->fit.model[k * d + i];
        const bool follows = k > 0 && data->trial[k] == data->trial[k - 1] && isfinite(last);
        if (run->fit.held[k] || !isfinite(off))
            continue;
        sum += follows ? off * last : 0;
        square += off * off;
        last = off;
    }
    return sum / square;
}

static void report_residuals(const struct fit_run *run, struct report *report)
{
    const struct phys_fit *fit = &run->fit;
    char name[64];
    double most = 0;
    for (size_t i = 0; i < 2 * run->system.dof; i++) {
        if (isnan(fit->noise[i]))
            continue;
        report_item(report, "residuals");
        fit_quantity(&run->system, i, name, sizeof name);
        report_text(report, "quantity", "residuals of", name);
        report_number(report, "noise", "noise", NULL,
                      phys_known_digits(fit->noise[i], fit->noise[i] / 100));
        report_number(report, "rms", "rms", NULL,
                      phys_known_digits(fit->rms[i], fit->rms[i] / 100));
        report_number(report, "held_rms", "rms held out", NULL,
                      phys_known_digits(fit->held_rms[i], fit->held_rms[i] / 100));
        report_number(report, "autocorrelation", "neighbours", NULL,
                      phys_known_digits(autocorrelation(run, i), 0.001));
        most = fmax(most, autocorrelation(run, i));
    }
    report_item(report, NULL);
    if (most > 0.4)
        report_line(report,
                    "  residuals of neighbouring rows are correlated (%.2f): the motion is not all "
                    "of the data, and deviations are too small",
                    most);
}

/* Pairs that the data hardly tell apart. */
static void report_correlation(const struct fit_run *run, const double *correlation,
                               struct report *report)
{
    const size_t N = run->fit.n_unknown;
    char a[80], b[80];
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < i; j++)
            if (fabs(correlation[i * N + j]) > 0.95) {
                phys_fit_name(&run->system, &run->settings, &run->fit, j, a, sizeof a);
                phys_fit_name(&run->system, &run->settings, &run->fit, i, b, sizeof b);
                report_line(report, "  %s and %s are correlated: %.4f", a, b,
                            correlation[i * N + j]);
            }
}

void fit_report(const void *context, struct report *report)
{
    const struct fit_run *run = context;
    const struct phys_fit *fit = &run->fit;
    const size_t N = fit->n_unknown;
    double *correlation = calloc(N * N + 1, sizeof *correlation);
    report_line(report, "%s: %zu numbers in %zu trial%s, %zu unknowns\n", run->system.scene->name,
                fit->measured, fit->n_trials, fit->n_trials == 1 ? "" : "s", N);
    report_text(report, "scene", NULL, run->system.scene->name);
    report_count(report, "measured", NULL, fit->measured);
    report_count(report, "trials", NULL, fit->n_trials);
    report_unknowns(run, report);
    report_residuals(run, report);
    report_number(report, "chi_square", "chi square", NULL, fit->chi_square);
    report_number(report, "freedom", "degrees of freedom", NULL, fit->freedom);
    report_count(report, "iterations", "iterations", fit->iterations);
    report_count(report, "tries", "tries", fit->tries);
    report_count(report, "agreeing", "  that came to this minimum", fit->agreeing);
    if (correlation && N) {
        for (size_t k = 0; k < N * N; k++)
            correlation[k] = fit->covariance[k] / (fit->deviation[k / N] * fit->deviation[k % N]);
        report_correlation(run, correlation, report);
        report_list(report, "covariance", NULL, NULL, N * N, fit->covariance);
        report_list(report, "correlation", NULL, NULL, N * N, correlation);
        report_list(report, "singular_values", NULL, NULL, N, fit->singular);
    }
    free(correlation);
}

static void write_rows(const struct fit_run *run, const char *separator, FILE *out)
{
    const size_t d = 2 * run->system.dof;
    const struct phys_fit_data *data = &run->data;
    for (size_t k = 0; k < data->n; k++) {
        if (k > 0 && *separator == ' ' && data->trial[k] != data->trial[k - 1])
            fputc('\n', out); /* curves of their own */
        fprintf(out, "%zu%s%.17g%s%d", data->trial[k] + 1, separator, data->t[k], separator,
                run->fit.held[k]);
        for (size_t i = 0; i < d; i++) {
            fprintf(out,
                    isfinite(data->x[k * d + i]) ? "%s%.17g"
                    : *separator == ' '          ? "%sNaN"
                                                 : "%s",
                    separator, data->x[k * d + i]);
            fprintf(out, "%s%.17g", separator, run->fit.model[k * d + i]);
        }
        fputc('\n', out);
    }
}

void fit_write_csv(const void *context, FILE *out)
{
    const struct fit_run *run = context;
    char name[64];
    fprintf(out, "trial,%s,held", phys_time_name(&run->system));
    for (size_t i = 0; i < 2 * run->system.dof; i++) {
        fit_quantity(&run->system, i, name, sizeof name);
        fprintf(out, ",%s,model_%s", name, name);
    }
    fputc('\n', out);
    write_rows(run, ",", out);
}

static void quantity(const void *system, size_t k, char *text, size_t size)
{
    fit_quantity(system, k, text, size);
}

enum ad_status fit_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct fit_run *run = context;
    const size_t shape[] = {run->data.n, 2 * run->system.dof};
    (void)error;
    report_coordinates(file, shape[1], &run->system, quantity, 0);
    phys_hdf5_write(file, "t", AD_F64, 1, shape, run->data.t);
    phys_hdf5_write(file, "data", AD_F64, 2, shape, run->data.x);
    phys_hdf5_write(file, "model", AD_F64, 2, shape, run->fit.model);
    phys_hdf5_text(file, "model", "axes", "row, coordinates and velocities");
    return AD_OK;
}

/* Left the first measured quantity and its model against time, right the residuals of all in units
   of the noise. */
enum ad_status fit_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct fit_run *run = context;
    const size_t d = 2 * run->system.dof;
    struct layout layout = figure_pair;
    const struct axis t = {"t", run->system.scene->time_unit, {0, 0}, 0};
    struct figure figure;
    struct line line = {0};
    char name[64], title[120];
    size_t first = 0;
    while (first + 1 < d && isnan(run->fit.noise[first]))
        first++;
    fputs("# trial, t, held out, then data and model of each quantity\n", plot->data);
    write_rows(run, " ", plot->data);
    snprintf(title, sizeof title, "%.60s: parameters from %zu rows of measured motion",
             run->system.scene->name, run->data.n);
    for (size_t k = 0; k < run->fit.n_free; k++) {
        phys_fit_name(&run->system, &run->settings, &run->fit, k, name, sizeof name);
        line_add(&line, "%.24s = %.6g +- %.1g", name, run->fit.value[k], run->fit.deviation[k]);
    }
    layout.title = title;
    layout.found = line.text;
    figure_begin(&figure, plot, &layout);
    fit_quantity(&run->system, first, name, sizeof name);
    figure_panel(&figure, &(struct panel){.across = t, .y = name, .key = KEY_ABOVE});
    figure_draw(&figure, STYLE("#0072b2", 7, 0, 0.4), "measured", "data using 2:%zu",
                4 + 2 * first);
    figure_draw(&figure, STYLE("#d55e00", 0, 1.2, 0), "model", "data using 2:%zu", 5 + 2 * first);
    figure_panel(&figure, &(struct panel){.across = t, .y = "residual / noise", .key = KEY_ABOVE});
    for (size_t i = 0; i < d; i++)
        if (!isnan(run->fit.noise[i])) {
            fit_quantity(&run->system, i, name, sizeof name);
            figure_draw(&figure, STYLE(figure_colours[i % FIGURE_LEGEND], 7, 0, 0.4), name,
                        "data using 2:(($%zu-$%zu)/%.9g)", 4 + 2 * i, 5 + 2 * i, run->fit.noise[i]);
        }
    figure_end(&figure);
    return error->status;
}
