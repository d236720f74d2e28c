/* What the residuals at a minimum tell: noise of the data, covariance of the unknowns. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Standard deviations of the noise of each component, from its residuals: their sum of squares over
   their number less the unknowns they determine, the sum of their leverages. True if none changed
   by a thousandth. */
static bool estimate_noise(struct phys_fitting *s, const struct phys_squares *q, const double *J)
{
    struct phys_fit *fit = s->fit;
    const size_t d = s->d, N = fit->n_unknown;
    bool still = true;
    for (size_t i = 0; i < d; i++) {
        double sum = 0, n = 0;
        size_t entry = 0;
        for (size_t k = 0; k < s->data->n; k++)
            for (size_t c = 0; c < d; c++) {
                const double x = s->data->x[k * d + c];
                if (fit->held[k] || !isfinite(x))
                    continue;
                const double *row = J + entry++ * N;
                if (c != i)
                    continue;
                double leverage = 0;
                for (size_t m = 0; m < N && q->s[m] > PHYS_FIT_INDISTINCT * q->s[0]; m++) {
                    double along = 0;
                    for (size_t j = 0; j < N; j++)
                        along += row[j] / q->scale[j] * q->V[m * N + j];
                    leverage += along / q->s[m] * (along / q->s[m]);
                }
                sum += (x - fit->model[k * d + i]) * (x - fit->model[k * d + i]);
                n += 1 - leverage;
            }
        if (!isfinite(fit->noise[i]) || (s->settings->noise && s->settings->noise[i] > 0))
            continue;
        const double least = 1e-10 * phys_fit_spread(s->data, d, i),
                     found = fmax(sqrt(sum / fmax(n, 1e-3)), least);
        still = still && fabs(found - fit->noise[i]) <= 1e-3 * found;
        fit->noise[i] = found;
    }
    return still;
}

static void find_covariance(struct phys_fit *fit, const struct phys_squares *q)
{
    const size_t N = fit->n_unknown;
    const bool distinct = q->s[N - 1] > PHYS_FIT_INDISTINCT * q->s[0];
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++) {
            double sum = 0;
            for (size_t m = 0; m < N; m++)
                sum += q->V[m * N + i] * q->V[m * N + j] / (q->s[m] * q->s[m]);
            fit->covariance[i * N + j] =
                distinct ? sum / (q->scale[i] * q->scale[j]) : (double)INFINITY;
        }
    for (size_t i = 0; i < N; i++)
        fit->deviation[i] = sqrt(fit->covariance[i * N + i]);
    memcpy(fit->singular, q->s, N * sizeof *q->s);
    memcpy(fit->weakest, q->V + (N - 1) * N, N * sizeof *q->V);
}

enum ad_status phys_fitting_estimate(struct phys_fitting *s, bool *still, struct ad_error *error)
{
    const size_t bytes = s->fit->measured * s->fit->n_unknown * sizeof *s->J;
    double *J = malloc(bytes);
    struct phys_squares q = {0};
    if (!J)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(J, s->J, bytes);
    if (phys_squares_new(s->fit->measured, s->fit->n_unknown, s->J, s->r, &q, error) == AD_OK) {
        find_covariance(s->fit, &q);
        *still = estimate_noise(s, &q, J);
    }
    phys_squares_free(&q);
    free(J);
    return error->status;
}

void phys_fitting_rms(const struct phys_fitting *s)
{
    const size_t d = s->d;
    for (size_t i = 0; i < d; i++) {
        double sum[2] = {0}, n[2] = {0};
        for (size_t k = 0; k < s->data->n; k++) {
            const double off = s->data->x[k * d + i] - s->fit->model[k * d + i];
            if (isfinite(off)) {
                sum[s->fit->held[k]] += off * off;
                n[s->fit->held[k]]++;
            }
        }
        s->fit->rms[i] = sqrt(sum[0] / n[0]);
        s->fit->held_rms[i] = sqrt(sum[1] / n[1]);
    }
}
