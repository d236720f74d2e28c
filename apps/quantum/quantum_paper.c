/* leastaction quantum --preset paper: a packet in a box as published, and done right
   (quantum/published.h). */
#include "apps/command.h"
#include "apps/interrupt.h"
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

/* A number of the scene done right, and the published one on the same line. */
static void pair(struct report *report, const char *key, const char *label, double right,
                 const char *published_key, double published)
{
    report_number(report, key, label, NULL, right);
    report->object = "published";
    report_number(report, published_key, label, NULL, published);
    report->object = NULL;
}

static void fill_report(const struct qm_published *p, const struct quantum_run *run,
                        const struct quantum_result *result, struct report *report)
{
    const struct qm_moments *m = &result->moments[result->n - 1];
    double start = result->moments[0].norm; /* the part of the packet in the box */
    report_line(report, "hbar = %g\n\n  %-24s %14s %14s", p->hbar, "", "done right",
                "as published");
    report_text(report, "preset", NULL, "paper");
    report_number(report, "hbar", NULL, NULL, p->hbar);
    pair(report, "points", "points", (double)run->slice.grid.n, "points", (double)p->grid.n);
    pair(report, "dt", "dt", run->slice.dt, "dt", p->dt);
    pair(report, "phases", "phases of neighbours", M_PI * run->aliasing.ratio, "phases", p->phases);
    pair(report, "ghost", "ghosts at a distance of", run->aliasing.ghost, "ghost", p->ghost);
    pair(report, "norm_after_a_slice", "norm after a slice", result->moments[1].norm / start,
         "norm_after_a_slice", p->norm);
    report_number(report, "norm", "norm at the end", NULL, m->norm / start);
    pair(report, "mean_x", "mean at the end", m->mean_x, "mean_x", p->mean[p->frames - 1]);
    report_number(report, "std_x", "width at the end", NULL, m->std_x);
    report_number(report, "classical_x", "a particle would be at", NULL,
                  result->classical[result->n - 1]);
    report_number(report, "error", "mean from particle, rms", NULL, classical_error(result));
    report_text(report, "error_against", NULL, "the particle's path, rms");
    report_number(report, "aliasing", NULL, NULL, run->aliasing.ratio);
    report->object = "published";
    report_number(report, "effect_of_a_potential", NULL, NULL, p->kick);
    report->object = NULL;
    report_line(report, "\n  a potential changes the published |psi| by %.3g of its maximum",
                p->kick);
    report->passing = true;
    report_number(report, "seconds", NULL, "s", result->setup_seconds + result->seconds);
    report->passing = false;
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
    struct qm_published old;
    struct quantum_result result = {0};
    struct report report = {0};
    if (qm_published_new(run->options->scale, &old, error) == AD_OK) {
        while (!interrupted() && qm_published_advance(&old))
            ;
        if (quantum_run(run, &result, error) == AD_OK) {
            fill_report(&old, run, &result, &report);
            write_results(&old, run, &result, &report, outputs, error);
        }
        report_show(&report, &run->options->common, error);
    }
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
