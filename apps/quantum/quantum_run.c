/* A wave packet's run (quantum.h). */
#include "apps/interrupt.h"
#include "apps/output/progress.h"
#include "quantum.h"
#include "autodiff/clock.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status reserve(const struct quantum_run *run, struct quantum_result *result,
                              struct ad_error *error)
{
    size_t most = run->steps / run->every + 2, n = run->slice.grid.n;
    *result = (struct quantum_result){
        .error = (double)NAN,
        .t = malloc(most * sizeof *result->t),
        .moments = malloc(most * run->n_packets * sizeof *result->moments),
        .density = malloc(most * n * sizeof *result->density),
        .classical = malloc(most * sizeof *result->classical),
        .psi = malloc(n * run->n_packets * sizeof *result->psi),
    };
    if (!result->t || !result->moments || !result->density || !result->classical || !result->psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples of %zu points", most, n);
    return AD_OK;
}

void quantum_result_free(struct quantum_result *result)
{
    free(result->t);
    free(result->moments);
    free(result->density);
    free(result->classical);
    free(result->psi);
}

static void sample(const struct quantum_run *run, double t, struct quantum_result *result)
{
    size_t n = run->slice.grid.n, packets = run->n_packets;
    for (size_t p = 0; p < packets; p++)
        result->moments[result->n * packets + p] =
            qm_moments(&run->slice.grid, packets, result->psi + p);
    for (size_t a = 0; a < n; a++) {
        double size = cabs(result->psi[a * packets]);
        result->density[result->n * n + a] = size * size;
    }
    result->t[result->n++] = t;
}

static void normalise(const struct quantum_run *run, qm_complex *psi)
{
    for (size_t p = 0; p < run->n_packets; p++) {
        double norm = qm_moments(&run->slice.grid, run->n_packets, psi + p).norm;
        for (size_t a = 0; a < run->slice.grid.n; a++)
            psi[a * run->n_packets + p] /= sqrt(norm);
    }
}

static enum ad_status follow(const struct quantum_run *run, qm_propagator *propagator,
                             struct quantum_result *result, struct ad_error *error)
{
    struct progress progress;
    double start = ad_now();
    progress_start(&progress, run->options->common.quiet);
    for (size_t k = 1; k <= run->steps && !result->interrupted; k++) {
        if (qm_propagate(propagator, run->n_packets, result->psi, error) != AD_OK)
            break;
        if (run->options->normalise)
            normalise(run, result->psi);
        result->interrupted = interrupted();
        if (k % run->every == 0 || k == run->steps || result->interrupted)
            sample(run, (double)k * run->slice.dt, result);
        if (progress_due(&progress))
            progress_line(&progress, "slice %zu of %zu", k, run->steps);
    }
    progress_end(&progress);
    result->seconds = ad_now() - start;
    return error->status;
}

/* With --power: one slice is 2^power of them. */
static enum ad_status leap(const struct quantum_run *run, struct quantum_result *result,
                           struct ad_error *error)
{
    size_t n = run->slice.grid.n, packets = run->n_packets;
    double start = ad_now(), t = ldexp(run->slice.dt, (int)run->options->power);
    qm_complex *K = n < SIZE_MAX / n / sizeof *K ? malloc(n * n * sizeof *K) : NULL;
    qm_complex *before = malloc(n * packets * sizeof *before);
    if (!K || !before)
        ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    else if (qm_kernel(&run->slice, K, error) == AD_OK &&
             qm_kernel_square(n, run->options->power, K, error) == AD_OK) {
        result->setup_seconds = ad_now() - start;
        memcpy(before, result->psi, n * packets * sizeof *before);
        qm_kernel_apply(n, K, packets, before, result->psi);
        result->seconds = ad_now() - start - result->setup_seconds;
        sample(run, t, result);
    }
    free(K);
    free(before);
    return error->status;
}

static enum ad_status step_by_step(const struct quantum_run *run, struct quantum_result *result,
                                   struct ad_error *error)
{
    qm_propagator *propagator;
    double start = ad_now();
    if (qm_propagator_new(run->method, &run->slice, &propagator, error) != AD_OK)
        return error->status;
    result->setup_seconds = ad_now() - start;
    follow(run, propagator, result, error);
    qm_propagator_free(propagator);
    return error->status;
}

enum ad_status quantum_run(const struct quantum_run *run, struct quantum_result *result,
                           struct ad_error *error)
{
    bool leaps = run->options->power != OPTION_NO_COUNT;
    if (reserve(run, result, error) != AD_OK)
        return error->status;
    for (size_t p = 0; p < run->n_packets; p++)
        qm_packet(&run->slice.grid, run->slice.hbar, &run->packet[p], run->n_packets, p,
                  result->psi);
    sample(run, 0, result);
    if ((leaps ? leap : step_by_step)(run, result, error) != AD_OK ||
        qm_classical(&run->slice, run->packet, result->n, result->t, result->classical, error) !=
            AD_OK)
        return error->status;
    if (run->options->no_reference || result->interrupted)
        return AD_OK;
    return qm_error(run->method, &run->slice, run->n_packets, run->packet, result->t[result->n - 1],
                    result->psi, &result->error, &result->truth, error);
}
