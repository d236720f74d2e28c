/* Equilibria and modes: the report, a row a mode, and the picture of one mode. */
#include "physics/linear/vectors.h"
#include "apps/output/coordinates.h"
#include "apps/output/report.h"
#include "modes.h"
#include "physics/stability/diagnostics.h"

#include <math.h>
#include <stdlib.h>

enum { SHOWN = 6, FRAMES = 60, SAMPLES = 240 };

static const double swing = 0.15; /* of a picture's amplitude, in sizes of the place */

static void report_modes(const struct modes_run *run, struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const size_t dof = run->system.dof;
    double *shape = malloc(dof * sizeof *shape);
    char name[64], unit[64] = "";
    char per[64] = "";
    if (*unit_shown(scene->time_unit)) {
        snprintf(unit, sizeof unit, "rad/%s", scene->time_unit);
        snprintf(per, sizeof per, "1/%s", scene->time_unit);
    }
    report->failed = report->failed || !shape;
    for (size_t k = 0; shape && k < run->found.n; k++)
        for (size_t m = 0; m < run->found.one[k].n_modes; m++) {
            const struct phys_mode *mode = &run->found.one[k].mode[m];
            report_item(report, "modes");
            report_count(report, "equilibrium", "equilibrium", k + 1);
            report_count(report, "mode", "mode", m + 1);
            report_number(report, "frequency", "frequency", unit,
                          phys_known_digits(mode->frequency, 0.1 * mode->uncertainty));
            report_number(
                report, "period", "period", scene->time_unit,
                mode->frequency > 0
                    ? phys_known_digits(2 * M_PI / mode->frequency,
                                        0.6 * mode->uncertainty / mode->frequency / mode->frequency)
                    : NAN);
            report_number(report, "growth", "growth", per,
                          phys_known_digits(mode->growth, 0.1 * mode->uncertainty));
            report_number(report, "uncertainty", "+-", NULL,
                          phys_known_digits(mode->uncertainty, 0.01 * mode->uncertainty));
            phys_coordinate_name(&run->system, mode->coordinate, name, sizeof name);
            report_text(report, "mostly", "mostly", name);
            for (int part = 0; part < 2; part++) {
                for (size_t i = 0; i < dof; i++)
                    shape[i] = mode->shape[2 * i + (size_t)part];
                report_list(report, part ? "shape_imaginary" : "shape", NULL, NULL, dof, shape);
            }
        }
    free(shape);
    report_item(report, NULL);
}

static void report_place(const struct modes_run *run, const double *q, struct report *report)
{
    char text[256] = "", name[64];
    size_t used = 0;
    for (size_t i = 0; i < run->system.dof && used < sizeof text - 80; i++) {
        if (i == SHOWN) {
            snprintf(text + used, sizeof text - used, ", ...");
            break;
        }
        phys_coordinate_name(&run->system, i, name, sizeof name);
        used += (size_t)snprintf(text + used, sizeof text - used, "%s%s %.9g", i ? ", " : "", name,
                                 q[i]);
    }
    report_text(report, "place", "place", text);
}

static void report_search(const struct modes_run *run, struct report *report)
{
    const struct phys_equilibria *found = &run->found;
    const size_t dof = run->system.dof;
    char box[256] = "", name[64];
    size_t used = 0;
    for (size_t i = 0; i < dof && i < SHOWN && used < sizeof box - 100; i++) {
        phys_coordinate_name(&run->system, i, name, sizeof name);
        used += (size_t)snprintf(box + used, sizeof box - used, "%s%s %.3g to %.3g", i ? ", " : "",
                                 name, found->low[i], found->high[i]);
    }
    report_text(report, "box", "starts drawn in", box);
    report_list(report, "low", NULL, NULL, dof, found->low);
    report_list(report, "high", NULL, NULL, dof, found->high);
    report_number(report, "unseen", NULL, NULL, found->unseen);
    report_number(report, "unseen_limit", NULL, NULL, found->unseen_limit);
    report_line(
        report,
        "  Another such start finds an equilibrium not listed with a chance under %.0f%% (95%% "
        "confidence).",
        ceil(100 * found->unseen_limit));
}

/* At rest at the equilibria. */
static void report_model(const struct modes_run *run, struct report *report)
{
    const size_t dof = run->system.dof, n = run->found.n;
    double *x = calloc(2 * dof * n + 1, sizeof *x);
    report->failed = report->failed || !x;
    for (size_t k = 0; k < n && x; k++)
        memcpy(x + 2 * k * dof, run->found.one[k].q, dof * sizeof *x);
    if (x)
        report_learnt(&run->system, n, NULL, x, report);
    free(x);
}

void modes_report(const void *context, struct report *report)
{
    const struct modes_run *run = context;
    const struct phys_equilibria *found = &run->found;
    const struct phys_scene *scene = run->system.scene;
    report_line(report, "%s: %zu equilibri%s from %zu starts\n", scene->name, found->n,
                found->n == 1 ? "um" : "a", found->starts);
    report_text(report, "scene", NULL, scene->name);
    report_count(report, "starts", NULL, found->starts);
    report_count(report, "lost", "starts that led nowhere", found->lost);
    report_search(run, report);
    for (size_t k = 0; k < found->n; k++) {
        const struct phys_equilibrium *one = &found->one[k];
        report_item(report, "equilibria");
        report_count(report, "number", "equilibrium", k + 1);
        report_place(run, one->q, report);
        report_list(report, "q", NULL, NULL, run->system.dof, one->q);
        report_number(report, "energy", "energy", scene->energy_unit, one->energy);
        report_number(report, "uncertainty", NULL, NULL, one->uncertainty);
        report_count(report, "reached", "starts", one->reached);
        report_flag(report, "family", NULL, one->family);
        report_text(report, "kind", "", phys_equilibrium_word(one->kind));
    }
    report_item(report, NULL);
    report_model(run, report);
    report_modes(run, report);
    for (size_t k = 0; k < found->n; k++)
        if (found->one[k].family)
            report_line(report,
                        "  equilibrium %zu stands for a family: others differ from it by motions "
                        "of frequency 0",
                        k + 1);
}

void modes_write_csv(const void *context, FILE *out)
{
    const struct modes_run *run = context;
    const size_t dof = run->system.dof;
    char name[64];
    fputs("equilibrium,mode,frequency,growth,uncertainty", out);
    for (size_t i = 0; i < dof; i++) {
        phys_coordinate_name(&run->system, i, name, sizeof name);
        fprintf(out, ",%s,shape_%s,shape_imaginary_%s", name, name, name);
    }
    fputc('\n', out);
    for (size_t k = 0; k < run->found.n; k++)
        for (size_t m = 0; m < run->found.one[k].n_modes; m++) {
            const struct phys_mode *mode = &run->found.one[k].mode[m];
            fprintf(out, "%zu,%zu,%.17g,%.17g,%.3g", k + 1, m + 1, mode->frequency, mode->growth,
                    mode->uncertainty);
            for (size_t i = 0; i < dof; i++)
                fprintf(out, ",%.17g,%.17g,%.17g", run->found.one[k].q[i], mode->shape[2 * i],
                        mode->shape[2 * i + 1]);
            fputc('\n', out);
        }
}

/* Places, frequencies and shapes are datasets of the report. */
enum ad_status modes_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    (void)context, (void)file;
    return error->status;
}

/* ---- the picture ---- */

/* A mode in time: one period of it; for one that grows, until it is e^3 times as large. */
static double span(const struct phys_mode *mode)
{
    return mode->growth > 0      ? 3 / mode->growth
           : mode->frequency > 0 ? 2 * M_PI / mode->frequency
                                 : 1;
}

static void place(const struct modes_run *run, const struct phys_mode *mode, double t, double *x)
{
    const size_t dof = run->system.dof;
    const double *q = run->found.one[run->drawn].q;
    const double size = phys_largest(dof, q);
    const double amplitude = swing * (size > 0 ? size : 1);
    const bool free = mode->growth == 0 && mode->frequency == 0;
    const double grown = mode->growth > 0 ? exp(mode->growth * t - 3) : free ? t : 1;
    for (size_t i = 0; i < dof; i++)
        x[i] = q[i] + amplitude * grown *
                          (mode->shape[2 * i] * cos(mode->frequency * t) -
                           mode->shape[2 * i + 1] * sin(mode->frequency * t));
}

static void draw_mode(const struct modes_run *run, struct figure *figure, const double *x, double T)
{
    struct coordinates view;
    coordinates_begin(&view, &run->system, (struct range){0, T}, true);
    coordinates_widen(&view, SAMPLES + 1, x, 1, run->system.dof);
    fprintf(figure->plot->script, "rows = %d\n", SAMPLES + 1);
    coordinates_panel(&view, figure);
    coordinates_draw(&view, figure, "index 0 every ::::n(f)", STYLE(NULL, 0, 1.4, 0), 0);
    if (view.view != VIEW_MAP)
        coordinates_draw(&view, figure, "index 0 every ::n(f)::n(f)", STYLE(NULL, 7, 0, 0.8), 0);
    coordinates_legend(&view, figure);
}

enum ad_status modes_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct modes_run *run = context;
    const struct phys_equilibrium *one = &run->found.one[run->drawn];
    const size_t dof = run->system.dof;
    struct layout layout = figure_pair;
    struct figure figure;
    struct line line = {0};
    char title[120];
    if (one->n_modes == 0)
        return ad_fail(error, AD_E_ARGUMENT, "--plot: equilibrium %zu has no modes: %s",
                       run->drawn + 1, phys_equilibrium_word(one->kind));
    const struct phys_mode *mode = &one->mode[run->drawn_mode];
    const double T = span(mode);
    double *x = malloc((SAMPLES + 1) * dof * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    fputs("# a mode: time, coordinates\n", plot->data);
    for (size_t k = 0; k <= SAMPLES; k++) {
        place(run, mode, T * (double)k / SAMPLES, x + k * dof);
        fprintf(plot->data, "%.12g", T * (double)k / SAMPLES);
        for (size_t i = 0; i < dof; i++)
            fprintf(plot->data, " %.9g", x[k * dof + i]);
        fputc('\n', plot->data);
    }
    fputs("\n\n# modes: number, frequency, growth\n", plot->data);
    for (size_t k = 0; k < one->n_modes; k++)
        fprintf(plot->data, "%zu %.12g %.12g\n", k + 1, one->mode[k].frequency,
                one->mode[k].growth);
    layout.frames = plot->animated ? FRAMES : 1;
    fprintf(plot->script, "n(f) = %d * (f + 1) / %zu\nf = 0\n", SAMPLES, layout.frames);
    snprintf(title, sizeof title, "%.60s: equilibrium %zu, %s", run->system.scene->name,
             run->drawn + 1, phys_equilibrium_word(one->kind));
    line_add(&line, "left: mode %zu of %zu", run->drawn_mode + 1, one->n_modes);
    line_add(&line, "frequency %.6g", mode->frequency);
    line_add(&line, "growth %.6g", mode->growth);
    layout.title = title;
    layout.found = line.text;
    figure_begin(&figure, plot, &layout);
    draw_mode(run, &figure, x, T);
    char modes[64];
    snprintf(modes, sizeof modes, "[0.5:%zu.5]", one->n_modes);
    figure_panel(&figure, &(struct panel){.x = "mode",
                                          .y = "rad per unit of time",
                                          .x_range = modes,
                                          .y_range = "[0:*]",
                                          .x_tics = one->n_modes <= 20 ? "1" : NULL,
                                          .key = KEY_ABOVE});
    figure_draw(&figure, STYLE(figure_colours[0], 7, 0, 0.6), "frequency",
                "data index 1 using 1:2");
    figure_draw(&figure, STYLE(figure_colours[1], 5, 0, 0.6), "growth",
                "data index 1 using 1:($3 > 0 ? $3 : NaN)");
    figure_draw(&figure, STYLE("#333333", 6, 0, 1.2), "shown",
                "data index 1 using 1:2 every ::%zu::%zu", run->drawn_mode, run->drawn_mode);
    figure_end(&figure);
    free(x);
    return error->status;
}
