/* Results of a wave packet's run (quantum.h): table, JSON, CSV and run file. */
#include "apps/command.h"
#include "quantum.h"
#include "apps/output/unit.h"

#include <complex.h>
#include <math.h>

static const char *const wall_names[] = {
    [QM_OPEN] = "open", [QM_REFLECT] = "reflecting", [QM_RING] = "a ring"};

static const struct qm_moments *last(const struct quantum_run *run,
                                     const struct quantum_result *result, size_t packet)
{
    return &result->moments[(result->n - 1) * run->n_packets + packet];
}

static void row(const char *name, double value, const char *unit)
{
    if (!isnan(value))
        printf("  %-24s %13.6g  %s\n", name, value, unit_shown(unit));
}

void quantum_print(const struct quantum_run *run, const struct quantum_result *result)
{
    const struct phys_scene *scene = run->system.scene;
    const struct qm_slice *slice = &run->slice;
    printf("%s by %s (rule %s): %zu points from %g to %g, walls %s, to t = %g %s in %.3g s\n\n",
           run->name, run->method->name, slice->rule->name, slice->grid.n, slice->grid.low,
           slice->grid.high, wall_names[slice->walls], result->t[result->n - 1],
           unit_shown(scene->time_unit), result->setup_seconds + result->seconds);
    for (size_t p = 0; p < run->n_packets; p++) {
        const struct qm_moments *m = last(run, result, p);
        if (run->n_packets > 1)
            printf("packet %g,%g,%g\n", run->packet[p].x, run->packet[p].sigma, run->packet[p].p);
        row(run->options->normalise ? "norm, forced to be" : "norm", m->norm, NULL);
        row("norm lost", 1 - m->norm, NULL);
        row("mean", m->mean_x, scene->unit);
        row("width", m->std_x, scene->unit);
    }
    row("a particle would be at", result->classical[result->n - 1], scene->unit);
    row("phases alias above 1", run->aliasing.ratio, NULL);
    row("error", result->error, result->truth);
    row("building what moves it", result->setup_seconds, "s");
}

void quantum_print_json(const struct quantum_run *run, const struct quantum_result *result)
{
    const struct qm_moments *m = last(run, result, 0);
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "scene", run->name);
    json_text(&json, "method", run->method->name);
    json_text(&json, "rule", run->slice.rule->name);
    json_count(&json, "points", run->slice.grid.n);
    json_number(&json, "dt", run->slice.dt);
    json_number(&json, "time", result->t[result->n - 1]);
    json_number(&json, "norm", m->norm);
    json_number(&json, "mean_x", m->mean_x);
    json_number(&json, "std_x", m->std_x);
    json_number(&json, "classical_x", result->classical[result->n - 1]);
    json_number(&json, "error", result->error);
    json_text(&json, "error_against", result->truth);
    json_number(&json, "aliasing", run->aliasing.ratio);
    json_bool(&json, "normalised", run->options->normalise);
    json_number(&json, "setup_seconds", result->setup_seconds);
    json_number(&json, "seconds", result->setup_seconds + result->seconds);
    if (run->n_packets > 1) {
        json_array(&json, "packets");
        for (size_t p = 0; p < run->n_packets; p++) {
            m = last(run, result, p);
            json_object(&json, NULL);
            json_number(&json, "norm", m->norm);
            json_number(&json, "mean_x", m->mean_x);
            json_number(&json, "std_x", m->std_x);
            json_end_object(&json);
        }
        json_end_array(&json);
    }
    json_close(&json);
}

void quantum_write_csv(const struct quantum_run *run, const struct quantum_result *result,
                       FILE *out)
{
    fputs("t,packet,norm,mean_x,std_x,classical_x\n", out);
    for (size_t k = 0; k < result->n; k++)
        for (size_t p = 0; p < run->n_packets; p++) {
            const struct qm_moments *m = &result->moments[k * run->n_packets + p];
            fprintf(out, "%.17g,%zu,%.17g,%.17g,%.17g,", result->t[k], p + 1, m->norm, m->mean_x,
                    m->std_x);
            if (p == 0 && !isnan(result->classical[k]))
                fprintf(out, "%.17g", result->classical[k]);
            fputc('\n', out);
        }
}

void quantum_file(const struct quantum_run *run, const struct quantum_result *result,
                  phys_runfile *file)
{
    const struct phys_scene *scene = run->system.scene;
    const struct qm_slice *slice = &run->slice;
    size_t n = slice->grid.n;
    phys_runfile_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_runfile_text(file, "/", "command", run->options->common.command);
    phys_runfile_text(file, "/", "scene", run->name);
    phys_runfile_text(file, "/", "method", run->method->name);
    phys_runfile_text(file, "/", "rule", slice->rule->name);
    phys_runfile_text(file, "/", "walls", wall_names[slice->walls]);
    phys_runfile_number(file, "/", "dt", slice->dt, scene->time_unit);
    phys_runfile_number(file, "/", "hbar", slice->hbar, NULL);
    phys_runfile_number(file, "/", "low", slice->grid.low, scene->unit);
    phys_runfile_number(file, "/", "high", slice->grid.high, scene->unit);
    phys_runfile_number(file, "/", "aliasing", run->aliasing.ratio, NULL);
    phys_runfile_number(file, "/", "norm", last(run, result, 0)->norm, NULL);
    phys_runfile_number(file, "/", "error", result->error, NULL);
    phys_runfile_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_runfile_number(file, "parameters", scene->params[k].name,
                            phys_system_get(&run->system, scene->params[k].name),
                            scene->params[k].unit);
    phys_runfile_write(file, "time", AD_F64, 1, &result->n, result->t);
    phys_runfile_text(file, "time", "unit", scene->time_unit);
    phys_runfile_write(file, "density", AD_F64, 2, (size_t[]){result->n, n}, result->density);
    phys_runfile_text(file, "density", "axes", "sample, point: |psi|^2 of the first packet");
    phys_runfile_write(file, "moments", AD_F64, 3, (size_t[]){result->n, run->n_packets, 3},
                       result->moments);
    phys_runfile_text(file, "moments", "axes", "sample, packet, (norm, mean, width)");
    phys_runfile_write(file, "psi", AD_F64, 3, (size_t[]){n, run->n_packets, 2}, result->psi);
    phys_runfile_text(file, "psi", "axes", "point, packet, (real, imaginary): at the end");
}
