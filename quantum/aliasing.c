/* Phase differences of neighbouring paths (quantum.h). The kinetic phase is largest from one end of
   the box to the other, the potential's where it is steepest: paths from all points to a few points
   across the grid show both. */
#include "internal.h"
#include "autodiff/sized.h"

#include <math.h>
#include <string.h>
#include <stdlib.h>

enum { SAMPLES = 33, ROUNDS = 40 };

/* All paths to the sampled end points: S and D [samples x n]. */
struct sample {
    size_t n;
    double *xa, *xb, *action, *mixed;
};

static enum ad_status sample_new(const struct qm_grid *grid, struct sample *sample,
                                 struct ad_error *error)
{
    size_t n = grid->n;
    sample->n = n;
    sample->xa = n <= SIZE_MAX / (4 * SAMPLES * sizeof(double))
                     ? malloc(4 * SAMPLES * n * sizeof *sample->xa)
                     : NULL;
    if (!sample->xa)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    sample->xb = sample->xa + SAMPLES * n;
    sample->action = sample->xb + SAMPLES * n;
    sample->mixed = sample->action + SAMPLES * n;
    for (size_t k = 0; k < SAMPLES * n; k++) {
        sample->xa[k] = qm_x(grid, k / n * (n - 1) / (SAMPLES - 1));
        sample->xb[k] = qm_x(grid, k % n);
    }
    return AD_OK;
}

static enum ad_status evaluate(const struct qm_slice *slice, struct sample *sample,
                               struct ad_error *error)
{
    return qm_actions(slice, SAMPLES * sample->n, sample->xa, sample->xb, sample->action,
                      sample->mixed, error);
}

/* The path with the least D, which has no amplitude, sqrt(D), where that is not positive; else
   SAMPLES * n. */
static size_t without_amplitude(const struct sample *sample)
{
    size_t least = 0;
    for (size_t k = 1; k < SAMPLES * sample->n; k++)
        if (!(sample->mixed[k] >= sample->mixed[least]))
            least = k;
    return sample->mixed[least] > 0 ? SAMPLES * sample->n : least;
}

static bool has_amplitudes(const struct sample *sample)
{
    return without_amplitude(sample) == SAMPLES * sample->n;
}

static double ratio_of(const struct sample *sample, double hbar)
{
    double largest = 0;
    for (size_t k = 0; k < SAMPLES * sample->n; k++)
        if (k % sample->n)
            largest = fmax(largest, fabs(sample->action[k] - sample->action[k - 1]));
    return largest / (M_PI * hbar);
}

/* The ratio falls as 1/dt where kinetic energy rules: dt times the ratio, until that is 1. */
static double least_dt(const struct qm_slice *slice, double ratio, struct sample *sample)
{
    struct qm_slice longer = *slice;
    struct ad_error error = {0};
    for (int k = 0; k < ROUNDS; k++) {
        longer.dt *= ratio;
        if (evaluate(&longer, sample, &error) != AD_OK || !has_amplitudes(sample))
            return (double)NAN;
        ratio = ratio_of(sample, slice->hbar);
        if (fabs(ratio - 1) < 1e-9)
            return longer.dt;
    }
    return (double)NAN;
}

/* D from x_b to x_a of two slices of half the length, joined at y where S(y) = S_1(x_a, y) + S_2(y,
   x_b) is stationary: D_1 D_2 / S''. S' and S'' are differences. NaN if there is no such y. */
static double mixed_of_halves(const struct qm_slice *slice, double x_a, double x_b)
{
    struct qm_slice half = *slice;
    struct ad_error error = {0};
    double y = 0.5 * (x_a + x_b), h = 1e-3 * (slice->grid.high - slice->grid.low), bend = 0;
    double S[6], D[6];
    half.dt = 0.5 * slice->dt;
    for (int k = 0; k < ROUNDS; k++) {
        const double end[] = {x_a, x_a, x_a, y - h, y, y + h};
        const double begin[] = {y - h, y, y + h, x_b, x_b, x_b};
        if (qm_actions(&half, 6, end, begin, S, D, &error) != AD_OK)
            return (double)NAN;
        double below = S[0] + S[3], here = S[1] + S[4], above = S[2] + S[5];
        double step = 0.5 * h * (above - below) / (above - 2 * here + below);
        bend = (above - 2 * here + below) / (h * h);
        if (!(fabs(step) > 1e-9 * h))
            break;
        y -= step;
    }
    return D[1] * D[4] / bend;
}

static enum ad_status refuse(const struct qm_slice *slice, const struct sample *sample, size_t k,
                             struct ad_error *error)
{
    double x_a = sample->xa[k], x_b = sample->xb[k];
    double halves = mixed_of_halves(slice, x_a, x_b);
    if (halves <= 0)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "dt %g: from %.4g to %.4g a slice has -d2S/dx_a dx_b = %.3g, two of half the "
            "length %.3g, and more than 0 is needed; expected an L with a positive mass "
            "L_vv, or a much shorter dt",
            slice->dt, x_b, x_a, sample->mixed[k], halves);
    return ad_fail(
        error, AD_E_ARGUMENT,
        "dt: straight paths are too crude for %g: from %.4g to %.4g a slice has "
        "-d2S/dx_a dx_b = %.3g, two of half the length %.3g, and more than 0 is needed; "
        "expected a shorter dt%s",
        slice->dt, x_b, x_a, sample->mixed[k], halves,
        !slice->rule || strcmp(slice->rule->name, "trapezoid") == 0 ? "" : ", or rule trapezoid");
}

enum ad_status qm_aliasing(const struct qm_slice *slice, struct qm_aliasing *aliasing,
                           struct ad_error *error)
{
    struct sample sample = {0};
    if (AD_LACKS_RESULT(error, aliasing) || qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    if (sample_new(&slice->grid, &sample, error) != AD_OK)
        return error->status;
    if (evaluate(slice, &sample, error) == AD_OK) {
        double dx = qm_dx(&slice->grid), ratio = ratio_of(&sample, slice->hbar);
        /* the longest difference of neighbours is two cells short of the box, whatever the grid */
        double shorter = 1 - 2 / (double)slice->grid.n;
        if (!has_amplitudes(&sample))
            refuse(slice, &sample, without_amplitude(&sample), error);
        *aliasing = (struct qm_aliasing){
            .ratio = ratio,
            .ghost = 2 * M_PI * slice->hbar / (sample.mixed[0] * dx),
            .dx_most = dx * shorter / ratio,
            .box_most = dx * (double)slice->grid.n / ratio,
            .dt_least = error->status == AD_OK ? least_dt(slice, ratio, &sample) : (double)NAN,
        };
    }
    free(sample.xa);
    return error->status;
}
