/* Complete runs of wave packets (run.h). */
#include "run.h"
#include "autodiff/sized.h"
#include "autodiff/free.h"
#include "internal.h"
#include "autodiff/clock.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status reserve(const struct qm_run_settings *run, struct qm_run_result *result,
                              struct ad_error *error)
{
    size_t most = run->steps / run->every + 2, n = run->slice->grid.n;
    *result = (struct qm_run_result){
        .error = (double)NAN,
        .t = malloc(most * sizeof *result->t),
        .moments = malloc(most * run->packets * sizeof *result->moments),
        .density = malloc(most * n * sizeof *result->density),
        .classical = malloc(most * sizeof *result->classical),
        .psi = malloc(n * run->packets * sizeof *result->psi),
    };
    if (!result->t || !result->moments || !result->density || !result->classical || !result->psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples of %zu points", most, n);
    return AD_OK;
}

void qm_run_free(struct qm_run_result *result)
{
    if (!result)
        return;
    AD_FREE(result->t, result->moments, result->density, result->classical, result->psi);
    *result = (struct qm_run_result){0};
}

static void sample(const struct qm_run_settings *run, double t, struct qm_run_result *result)
{
    size_t n = run->slice->grid.n, packets = run->packets;
    for (size_t p = 0; p < packets; p++)
        result->moments[result->n * packets + p] =
            qm_moments(&run->slice->grid, packets, result->psi + p);
    for (size_t a = 0; a < n; a++) {
        double size = cabs(result->psi[a * packets]);
        result->density[result->n * n + a] = size * size;
    }
    result->t[result->n++] = t;
}

static void normalise(const struct qm_run_settings *run, qm_complex *psi)
{
    for (size_t p = 0; p < run->packets; p++) {
        double norm = qm_moments(&run->slice->grid, run->packets, psi + p).norm;
        for (size_t a = 0; a < run->slice->grid.n; a++)
            psi[a * run->packets + p] /= sqrt(norm);
    }
}

static enum ad_status step_by_step(const struct qm_run_settings *run, struct qm_run_result *result,
                                   struct ad_error *error)
{
    qm_propagator *propagator;
    double start = ad_now();
    if (qm_propagator_new(run->method, run->slice, &propagator, error) != AD_OK)
        return error->status;
    result->setup_seconds = ad_now() - start;
    for (size_t k = 1; k <= run->steps && !result->stopped; k++) {
        if (qm_propagate(propagator, run->packets, result->psi, error) != AD_OK)
            break;
        if (run->normalise)
            normalise(run, result->psi);
        result->stopped = run->progress && !run->progress(run->context, k);
        if (k % run->every == 0 || k == run->steps || result->stopped)
            sample(run, (double)k * run->slice->dt, result);
    }
    result->seconds = ad_now() - start - result->setup_seconds;
    qm_propagator_free(propagator);
    return error->status;
}

/* One step of 2^power slices. */
static enum ad_status leap(const struct qm_run_settings *run, struct qm_run_result *result,
                           struct ad_error *error)
{
    size_t n = run->slice->grid.n, packets = run->packets;
    double start = ad_now(), t = ldexp(run->slice->dt, (int)run->power);
    qm_complex *K = n < SIZE_MAX / n / sizeof *K ? malloc(n * n * sizeof *K) : NULL;
    qm_complex *before = malloc(n * packets * sizeof *before);
    if (!K || !before)
        ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    else if (qm_kernel(run->slice, K, error) == AD_OK &&
             qm_kernel_square(n, run->power, K, error) == AD_OK) {
        result->setup_seconds = ad_now() - start;
        memcpy(before, result->psi, n * packets * sizeof *before);
        qm_kernel_apply(n, K, packets, before, result->psi);
        result->seconds = ad_now() - start - result->setup_seconds;
        sample(run, t, result);
    }
    AD_FREE(K, before);
    return error->status;
}

static enum ad_status check(const struct qm_run_settings *run, struct ad_error *error)
{
    const size_t most = SIZE_MAX / 64 / run->slice->grid.n;
    if (!run->packets || !run->every)
        return ad_fail(error, AD_E_ARGUMENT, "%s: expected at least 1, got 0",
                       run->packets ? "every" : "packets");
    if (run->packets > most || run->steps / run->every >= most / run->packets - 1)
        return ad_fail(error, AD_E_MEMORY, "out of memory: %zu packets, %zu steps", run->packets,
                       run->steps);
    for (size_t p = 0; p < run->packets; p++) {
        const struct qm_gaussian *g = &run->packet[p];
        if (!(g->sigma > 0 && isfinite(g->sigma) && isfinite(g->x) && isfinite(g->p)))
            return ad_fail(error, AD_E_ARGUMENT,
                           "packet %zu: %g,%g,%g; expected finite numbers, the width above 0",
                           p + 1, g->x, g->sigma, g->p);
    }
    return AD_OK;
}

enum ad_status qm_run(const struct qm_run_settings *run, struct qm_run_result *result,
                      struct ad_error *error)
{
    struct qm_slice slice;
    if (AD_LACKS_RESULT(error, result) || AD_LACKS(error, run))
        return error->status;
    AD_OWN(qm_run_settings, run, context, error);
    if (AD_LACKS(error, run->slice, run->method, run->packet) ||
        !AD_TAKE(&slice, run->slice, threads, error) || qm_slice_check(&slice, error) != AD_OK)
        return error->status;
    run_own.slice = &slice;
    if (check(run, error) != AD_OK || reserve(run, result, error) != AD_OK)
        return error->status;
    for (size_t p = 0; p < run->packets; p++)
        if (qm_packet_wound(run->slice, &run->slice->grid, &run->packet[p], run->packets, p,
                            result->psi, error) != AD_OK)
            return error->status;
    sample(run, 0, result);
    if ((run->leap ? leap : step_by_step)(run, result, error) != AD_OK ||
        qm_classical(run->slice, run->packet, result->n, result->t, result->classical, error) !=
            AD_OK)
        return error->status;
    if (!run->reference || result->stopped)
        return AD_OK;
    return qm_error(run->method, run->slice, run->packets, run->packet, result->t[result->n - 1],
                    result->psi, &result->error, &result->truth, error);
}
