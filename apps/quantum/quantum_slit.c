/* leastaction quantum --scene double-slit: a packet meets a barrier with two slits; the intensity
   on the screen behind is compared with the closed form (quantum/slit.h). */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/progress.h"
#include "quantum.h"
#include "autodiff/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- options ---- */

static enum ad_status read_settings(const struct settings *set, struct qm_slit_setup *setup,
                                    struct ad_error *error)
{
    static const char *const names[] = {"apart", "sigma", "speed", "flight", "m"};
    enum { N = sizeof names / sizeof *names };
    double *const values[N] = {&setup->apart, &setup->sigma, &setup->speed, &setup->flight,
                               &setup->mass};
    for (size_t s = 0; s < set->n; s++) {
        size_t k = phys_find("parameter of double-slit", set->setting[s].name, N, names, error);
        if (k == N)
            return AD_E_ARGUMENT;
        *values[k] = set->setting[s].value;
    }
    return AD_OK;
}

static enum ad_status refuse_others(const struct quantum_options *options, struct ad_error *error)
{
    if (options_refuse(
            &options->common,
            "box dt walls packet rule power every absorb normalise tol no-reference force",
            "is not for the double slit; see --set", error) != AD_OK)
        return error->status;
    if (strcmp(options->method, "kernel") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--method: expected kernel for the double slit, got '%s'", options->method);
    return AD_OK;
}

static enum ad_status prepare(const struct quantum_options *options, struct qm_slit *slit,
                              struct ad_error *error)
{
    struct qm_slit_setup setup = qm_slit_defaults();
    setup.hbar = options->hbar;
    setup.points = option_count_or(options->points, setup.points);
    setup.steps = option_count_or(options->steps, setup.steps);
    setup.threads = options->common.threads;
    if (refuse_others(options, error) == AD_OK &&
        read_settings(&options->common.set, &setup, error) == AD_OK)
        qm_slit_new(&setup, slit, error);
    return error->status;
}

/* ---- the run ---- */

static enum ad_status follow(void *context, struct ad_error *error)
{
    struct slit_run *run = context;
    struct progress progress;
    struct qm_slit *slit = &run->slit;
    double from = ad_now();
    progress_start(&progress, run->options->common.quiet, run->options->common.log);
    interrupt_catch();
    while (!run->interrupted && qm_slit_advance(slit)) {
        run->interrupted = interrupted();
        if (progress_due(&progress))
            progress_line(&progress, (double)slit->done, (double)slit->setup->steps,
                          "slice %zu of %zu", slit->done, slit->setup->steps);
    }
    progress_end(&progress);
    qm_slit_measure(slit);
    run->seconds = ad_now() - from;
    return error->status;
}

/* ---- results ---- */

static void report_slit(const void *context, struct report *report)
{
    const struct slit_run *run = context;
    const struct qm_slit *s = &run->slit;
    report_line(report,
                "double slit: %zu x %zu points, %zu slices of %.4g in %.3g s, set up in %.3g s\n",
                s->x.n, s->y.n, s->setup->steps, s->dt, run->setup_seconds + run->seconds,
                run->setup_seconds);
    report_text(report, "scene", NULL, "double-slit");
    report_text(report, "method", NULL, "kernel");
    report_count(report, "points", NULL, s->x.n);
    report_count(report, "steps", NULL, s->setup->steps);
    report_number(report, "dt", NULL, NULL, s->dt);
    report_number(report, "norm", "norm at the end", NULL, s->norm);
    report_number(report, "fringe", "fringe", NULL, s->fringe);
    report_number(report, "fringe_expected", "fringe of thin slits", NULL, s->closed);
    report_number(report, "error", "relative error", NULL, fabs(s->fringe / s->closed - 1));
    report_text(report, "error_against", "error against", "the closed form");
    report->passing = true;
    report_number(report, "setup_seconds", NULL, "s", run->setup_seconds);
    report_number(report, "seconds", NULL, "s", run->setup_seconds + run->seconds);
    report->passing = false;
}

static void write_csv(const void *context, FILE *out)
{
    const struct qm_slit *s = &((const struct slit_run *)context)->slit;
    fputs("y,intensity,closed_form\n", out);
    for (size_t b = 0; b < s->y.n; b++)
        fprintf(out, "%.17g,%.17g,%.17g\n", qm_x(&s->y, b), s->screen[b], s->expected[b]);
}

static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct qm_slit *s = &((const struct slit_run *)context)->slit;
    phys_hdf5_write(file, "time", AD_F64, 1, &s->frames, s->time);
    phys_hdf5_write(file, "density", AD_F64, 3, (size_t[]){s->frames, s->x.n, s->y.n}, s->density);
    phys_hdf5_text(file, "density", "axes", "frame, x, y: |psi|^2");
    double *y = malloc(s->y.n * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t b = 0; b < s->y.n; b++)
        y[b] = qm_x(&s->y, b);
    phys_hdf5_write(file, "y", AD_F64, 1, &s->y.n, y);
    phys_hdf5_write(file, "screen", AD_F64, 1, &s->y.n, s->screen);
    phys_hdf5_write(file, "thin_slits", AD_F64, 1, &s->y.n, s->expected);
    free(y);
    return error->status;
}

static const struct output_kind outputs = {report_slit, write_file, write_csv, slit_picture, NULL};

int quantum_slit(const struct quantum_options *options, struct ad_error *error)
{
    struct slit_run run = {.options = options};
    double from = ad_now();
    if (prepare(options, &run.slit, error) == AD_OK) {
        run.setup_seconds = ad_now() - from;
        outputs_run(&outputs, &options->common, &run, follow, error);
        if (error->status == AD_OK && run.interrupted)
            ad_fail(error, AD_E_ACCURACY, "interrupted; results are partial");
    }
    qm_slit_free(&run.slit);
    return command_status(error);
}
