/* Results of a wave packet's run (quantum.h): report, CSV and run file. */
#include "quantum.h"
#include "apps/output/report.h"

#include <math.h>
#include <stdlib.h>

static const char *const wall_names[] = {
    [QM_OPEN] = "open", [QM_REFLECT] = "reflecting", [QM_RING] = "a ring"};

static const struct qm_moments *last(const struct quantum_run *run, size_t packet)
{
    const struct qm_run_result *result = &run->result;
    return &result->moments[(result->n - 1) * run->settings.packets + packet];
}

static void report_run(const struct quantum_run *run, struct report *report)
{
    const struct qm_run_result *result = &run->result;
    const struct phys_scene *scene = run->system.scene;
    const struct qm_slice *slice = &run->slice;
    double t = result->t[result->n - 1];
    report_line(report,
                "%s by %s (rule %s): %zu points from %g to %g, walls %s, to t = %g%s%s in %.3g s, "
                "set up in %.3g s\n",
                run->name, run->settings.method->name, slice->rule->name, slice->grid.n,
                slice->grid.low, slice->grid.high, wall_names[slice->walls], t,
                unit_blank(scene->time_unit), unit_shown(scene->time_unit),
                result->setup_seconds + result->seconds, result->setup_seconds);
    report_text(report, "scene", NULL, run->name);
    report_text(report, "method", NULL, run->settings.method->name);
    report_text(report, "rule", NULL, slice->rule->name);
    report_text(report, "walls", NULL, wall_names[slice->walls]);
    report_number(report, "low", NULL, scene->unit, slice->grid.low);
    report_number(report, "high", NULL, scene->unit, slice->grid.high);
    report_count(report, "points", NULL, slice->grid.n);
    report_number(report, "dt", NULL, scene->time_unit, slice->dt);
    report_number(report, "hbar", NULL, NULL, slice->hbar);
    report_number(report, "time", NULL, scene->time_unit, t);
}

static void report_packet(const struct quantum_run *run, const struct qm_moments *m,
                          struct report *report)
{
    const char *unit = run->system.scene->unit;
    report_number(report, "norm", run->options->normalise ? "norm, forced to be" : "norm", NULL,
                  m->norm);
    report_number(report, "norm_lost", "norm lost", NULL, 1 - m->norm);
    report_number(report, "mean_x", "mean", unit, m->mean_x);
    report_number(report, "std_x", "width", unit, m->std_x);
}

/* Where the error is not known, the reason. */
static void report_error(const struct quantum_run *run, struct report *report)
{
    const struct qm_run_result *result = &run->result;
    bool known = isfinite(result->error);
    report_number(report, "error", "error", NULL, known ? result->error : (double)NAN);
    report_text(report, "error_against", known ? "error against" : NULL, result->truth);
    if (!known)
        report_line(report, "  %-24s not measured: %s", "error",
                    run->options->no_reference ? "--no-reference"
                    : result->stopped          ? "interrupted"
                                               : "the reference takes too many steps");
}

static void report_packets(const void *context, struct report *report)
{
    const struct quantum_run *run = context;
    const struct qm_run_result *result = &run->result;
    report_run(run, report);
    report_packet(run, last(run, 0), report);
    report_number(report, "classical_x", "a particle would be at", run->system.scene->unit,
                  result->classical[result->n - 1]);
    report_number(report, "aliasing", "phases alias above 1", NULL, run->aliasing.ratio);
    report_error(run, report);
    report_flag(report, "normalised", NULL, run->options->normalise);
    report->passing = true;
    report_number(report, "setup_seconds", NULL, "s", result->setup_seconds);
    report_number(report, "seconds", NULL, "s", result->setup_seconds + result->seconds);
    report->passing = false;
    for (size_t p = 0; p < run->settings.packets && run->settings.packets > 1; p++) {
        report_item(report, "packets");
        report_packet(run, last(run, p), report);
    }
    report_item(report, NULL);
}

void quantum_write_csv(const void *context, FILE *out)
{
    const struct quantum_run *run = context;
    const struct qm_run_result *result = &run->result;
    fputs("t,packet,norm,mean_x,std_x,classical_x\n", out);
    for (size_t k = 0; k < result->n; k++)
        for (size_t p = 0; p < run->settings.packets; p++) {
            const struct qm_moments *m = &result->moments[k * run->settings.packets + p];
            fprintf(out, "%.17g,%zu,%.17g,%.17g,%.17g", result->t[k], p + 1, m->norm, m->mean_x,
                    m->std_x);
            csv_number(out, 17, p == 0 ? result->classical[k] : (double)NAN);
            fputc('\n', out);
        }
}

enum ad_status quantum_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct quantum_run *run = context;
    const struct qm_run_result *result = &run->result;
    const struct phys_scene *scene = run->system.scene;
    size_t n = run->slice.grid.n;
    double *x = malloc(n * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_hdf5_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_hdf5_number(file, "parameters", scene->params[k].name,
                         phys_system_get(&run->system, scene->params[k].name),
                         scene->params[k].unit);
    phys_hdf5_write(file, "time", AD_F64, 1, &result->n, result->t);
    phys_hdf5_text(file, "time", "unit", scene->time_unit);
    for (size_t i = 0; i < n; i++)
        x[i] = qm_x(&run->slice.grid, i);
    phys_hdf5_write(file, "x", AD_F64, 1, &n, x);
    phys_hdf5_text(file, "x", "unit", scene->unit);
    free(x);
    phys_hdf5_write(file, "density", AD_F64, 2, (size_t[]){result->n, n}, result->density);
    phys_hdf5_text(file, "density", "axes", "sample, point: |psi|^2 of the first packet");
    phys_hdf5_write(file, "moments", AD_F64, 3, (size_t[]){result->n, run->settings.packets, 3},
                    result->moments);
    phys_hdf5_text(file, "moments", "axes", "sample, packet, (norm, mean, width)");
    phys_hdf5_write(file, "psi", AD_F64, 3, (size_t[]){n, run->settings.packets, 2}, result->psi);
    phys_hdf5_text(file, "psi", "axes", "point, packet, (real, imaginary): at the end");
    return error->status;
}

const struct output_kind quantum_outputs = {report_packets, quantum_file, quantum_write_csv,
                                            quantum_picture, NULL};
