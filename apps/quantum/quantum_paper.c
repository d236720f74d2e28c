/* leastaction quantum --preset paper: a packet in a box as published, and with a correct kernel
   (quantum/published.h). */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "quantum.h"

#include <math.h>

static double classical_error(const struct qm_run_result *result)
{
    double sum = 0;
    for (size_t k = 0; k < result->n; k++)
        sum += pow(result->moments[k].mean_x - result->classical[k], 2);
    return sqrt(sum / (double)result->n);
}

/* ---- results ---- */

/* The correct number and the published one, on one line. */
static void pair(struct report *report, const char *key, const char *label, double right,
                 const char *published_key, double published)
{
    report_number(report, key, label, NULL, right);
    report->object = "published";
    report_number(report, published_key, label, NULL, published);
    report->object = NULL;
}

static void report_paper(const void *context, struct report *report)
{
    const struct paper *paper = context;
    const struct qm_published *p = &paper->old;
    const struct quantum_run *run = &paper->run;
    const struct qm_run_result *result = &run->result;
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

static void write_csv(const void *context, FILE *out)
{
    quantum_write_csv(&((const struct paper *)context)->run, out);
}

static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct paper *paper = context;
    const struct qm_published *p = &paper->old;
    phys_hdf5_write(file, "published/density", AD_F64, 2, (size_t[]){p->frames, p->grid.n},
                    p->density);
    phys_hdf5_write(file, "published/time", AD_F64, 1, &p->frames, p->time);
    return quantum_file(&paper->run, file, error);
}

static const struct output_kind outputs = {report_paper, write_file, write_csv, paper_picture,
                                           NULL};

static enum ad_status both(void *context, struct ad_error *error)
{
    struct paper *paper = context;
    if (qm_published_new(paper->run.options->scale, &paper->old, error) != AD_OK)
        return error->status;
    interrupt_catch();
    while (!interrupted() && qm_published_advance(&paper->old))
        ;
    return quantum_run(&paper->run, error);
}

int quantum_paper(const struct quantum_options *options, struct ad_error *error)
{
    struct qm_gaussian packet;
    struct paper paper = {.run = {.options = options, .name = "free"}};
    struct quantum_run *run = &paper.run;
    run->settings = (struct qm_run_settings){.size = sizeof(struct qm_run_settings),
                                             .slice = &run->slice,
                                             .method = &qm_method_kernel,
                                             .every = 1,
                                             .packets = 1,
                                             .packet = &packet};
    run->slice.size = sizeof run->slice;
    if (qm_published_right(options->scale, &run->system, &run->slice, &packet, &run->settings.steps,
                           error) == AD_OK &&
        qm_aliasing(&run->slice, &run->aliasing, error) == AD_OK) {
        run->slice.threads = options->common.threads;
        outputs_run(&outputs, &options->common, &paper, both, error);
    }
    qm_published_free(&paper.old);
    qm_run_free(&run->result);
    phys_system_close(&run->system);
    return command_status(error);
}
