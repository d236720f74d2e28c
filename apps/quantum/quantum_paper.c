/* leastaction quantum --preset paper: a packet in a box as published, and done right
   (quantum/published.h). */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/json.h"
#include "quantum_paper.h"

#include <math.h>
#include <stdlib.h>

static double classical_error(const struct quantum_result *result)
{
    double sum = 0;
    for (size_t k = 0; k < result->n; k++)
        sum += pow(result->moments[k].mean_x - result->classical[k], 2);
    return sqrt(sum / (double)result->n);
}

/* ---- results ---- */

static void print(const struct qm_published *p, const struct quantum_run *run,
                  const struct quantum_result *result)
{
    const struct qm_moments *m = &result->moments[result->n - 1];
    double start = result->moments[0].norm; /* of what the box does not cut off */
    printf("scale %g: hbar = %g\n\n%-34s%-22s%s\n", 1 / p->hbar, p->hbar, "", "as published",
           "done right");
    const struct {
        const char *name;
        double published, right;
    } rows[] = {
        {"points", (double)p->grid.n, (double)run->slice.grid.n},
        {"dt", p->dt, run->slice.dt},
        {"phases of neighbours, rad", p->phases, M_PI * run->aliasing.ratio},
        {"ghosts at a distance of", p->ghost, run->aliasing.ghost},
        {"norm after a slice", p->norm, result->moments[1].norm / start},
        {"norm at the end", (double)NAN, m->norm / start},
        {"mean at the end", p->mean[p->frames - 1], m->mean_x},
        {"a particle would be at", (double)NAN, result->classical[result->n - 1]},
        {"mean from particle, rms", (double)NAN, classical_error(result)},
        {"what a potential does to |psi|", p->kick, (double)NAN},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        printf("  %-32s", rows[k].name);
        if (isnan(rows[k].published))
            printf("%-22s", "");
        else
            printf("%-22.6g", rows[k].published);
        if (!isnan(rows[k].right))
            printf("%.6g", rows[k].right);
        putchar('\n');
    }
}

static void print_json(const struct qm_published *p, const struct quantum_run *run,
                       const struct quantum_result *result)
{
    const struct qm_moments *m = &result->moments[result->n - 1];
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "preset", "paper");
    json_number(&json, "hbar", p->hbar);
    json_object(&json, "published");
    json_count(&json, "points", p->grid.n);
    json_number(&json, "dt", p->dt);
    json_number(&json, "phases", p->phases);
    json_number(&json, "ghost", p->ghost);
    json_number(&json, "norm_after_a_slice", p->norm);
    json_number(&json, "mean_x", p->mean[p->frames - 1]);
    json_number(&json, "effect_of_a_potential", p->kick);
    json_end_object(&json);
    json_number(&json, "norm", m->norm / result->moments[0].norm);
    json_number(&json, "mean_x", m->mean_x);
    json_number(&json, "std_x", m->std_x);
    json_number(&json, "classical_x", result->classical[result->n - 1]);
    json_number(&json, "error", classical_error(result));
    json_text(&json, "error_against", "the particle's path, rms");
    json_number(&json, "aliasing", run->aliasing.ratio);
    json_number(&json, "seconds", result->setup_seconds + result->seconds);
    json_close(&json);
}

static enum ad_status write_results(const struct qm_published *p, const struct quantum_run *run,
                                    const struct quantum_result *result,
                                    const struct report *report, struct outputs *outputs,
                                    struct ad_error *error)
{
    size_t n = run->slice.grid.n;
    if (outputs->csv.out)
        quantum_write_csv(run, result, outputs->csv.out);
    if (outputs->file) {
        quantum_file(run, result, report, outputs->file, error);
        phys_runfile_write(outputs->file, "published/density", AD_F64, 2,
                           (size_t[]){p->frames, p->grid.n}, p->density);
        phys_runfile_write(outputs->file, "published/time", AD_F64, 1, &p->frames, p->time);
    }
    qm_complex *K = outputs->plot.script ? malloc(n * n * sizeof *K) : NULL;
    if (outputs->plot.script && !K)
        ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    else if (K && qm_kernel(&run->slice, K, error) == AD_OK)
        paper_picture(p, run, result, K, &outputs->plot);
    free(K);
    if (error->status == AD_OK)
        outputs_commit(outputs, error);
    return error->status;
}

static enum ad_status both(const struct quantum_run *run, struct outputs *outputs,
                           struct ad_error *error)
{
    const struct common *common = &run->options->common;
    struct qm_published old;
    struct quantum_result result = {0};
    struct report report = {0};
    if (qm_published_new(run->options->scale, &old, error) == AD_OK) {
        while (!interrupted() && qm_published_advance(&old))
            ;
        if (quantum_run(run, &result, error) == AD_OK) {
            quantum_report(run, &result, &report);
            write_results(&old, run, &result, &report, outputs, error);
        }
        if (error->status == AD_OK && common->json)
            print_json(&old, run, &result);
        else if (error->status == AD_OK && !common->quiet)
            print(&old, run, &result);
    }
    report_free(&report);
    qm_published_free(&old);
    quantum_result_free(&result);
    return error->status;
}

int quantum_paper(const struct quantum_options *options, struct ad_error *error)
{
    struct quantum_options right = *options;
    struct qm_gaussian packet;
    struct quantum_run run = {.options = &right,
                              .name = "free",
                              .method = &qm_method_kernel,
                              .every = 1,
                              .n_packets = 1,
                              .packet = &packet};
    struct outputs outputs = {0};
    right.power = OPTION_NO_COUNT;
    right.no_reference = true;
    right.normalise = false;
    interrupt_catch();
    if (qm_published_right(options->scale, &run.system, &run.slice, &packet, &run.steps, error) ==
            AD_OK &&
        qm_aliasing(&run.slice, &run.aliasing, error) == AD_OK &&
        outputs_begin(&options->common, &outputs, error) == AD_OK) {
        run.slice.threads = options->common.threads;
        both(&run, &outputs, error);
    }
    outputs_abandon(&outputs);
    phys_system_close(&run.system);
    return command_status(error);
}
