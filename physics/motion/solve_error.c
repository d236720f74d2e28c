/* Measures the error of a motion against its reference (solving.h). */
#include "autodiff/free.h"
#include "solving.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_COMPARED = 4000 };

/* Of many samples only every k-th is compared, and the last, because the reference lands on each.
 */
static size_t sample_of(const struct phys_motion_solution *m, size_t compared, size_t i)
{
    size_t stride = (m->n + MOST_COMPARED - 1) / MOST_COMPARED;
    return i + 1 == compared ? m->n - 1 : i * stride;
}

/* The distance between the true motion, within u / 2 of the reference, and one that is `apart` from
   it: no more than this, and at most u less. */
static double bound_distance(double apart, double u) { return fmax(apart + u / 2, u); }

/* Notes coordinate k if it is the one that errs most beside its own motion. What stays 0 but for
   rounding has none. */
static void find_worst(const struct phys_reference *r, const size_t *samples, size_t k,
                       struct phys_motion_solution *m)
{
    const double rounding = 1e-12;
    double most = 0, error = 0, size = 0;
    for (size_t i = 0; i < r->n && m->t[samples[i]] < r->horizon; i++) {
        double x = r->x[2 * i * r->dof + k];
        for (size_t j = 0; j < r->dof; j++)
            most = fmax(most, fabs(r->x[2 * i * r->dof + j]));
        size = fmax(size, fabs(x));
        error = fmax(error, fabs(m->x[2 * samples[i] * r->dof + k] - x));
    }
    if (size > rounding * most && error > m->worst_error * size) {
        m->worst_error = error / size;
        m->worst = k;
    }
}

/* From the horizon on none are known. */
static void measure_distance(const struct phys_reference *reference, const size_t *samples,
                             const double *sizes, struct phys_motion_solution *m)
{
    size_t dof = m->system->dof;
    double common = 0;
    for (size_t k = 0; k < dof; k++)
        common = fmax(common, sizes[k]);
    for (size_t i = 0; i < m->n; i++)
        m->distance[i] = (double)NAN;
    m->error = m->error_end = m->reference_uncertainty = 0;
    for (size_t k = 0; k < dof; k++)
        find_worst(reference, samples, k, m);
    for (size_t i = 0; i < reference->n; i++) {
        double sum = 0;
        size_t at = samples[i];
        if (m->t[at] >= reference->horizon)
            break;
        for (size_t k = 0; k < dof; k++)
            sum += pow((m->x[2 * at * dof + k] - reference->x[2 * i * dof + k]) * common / sizes[k],
                       2);
        m->reference_uncertainty = fmax(m->reference_uncertainty, reference->uncertainty[i]);
        m->distance[at] = m->error_end = bound_distance(sqrt(sum), reference->uncertainty[i]);
        m->error = fmax(m->error, m->error_end);
    }
    m->known_until = reference->horizon;
    m->reference_tolerance = reference->tolerance;
    m->reference_reversal = reference->reversal;
    m->reference_forward = reference->forward;
    m->seen = reference->seen;
    m->time_resolution = reference->time_resolution;
    m->time_unresolved = reference->time_unresolved;
    m->size = reference->size;
    if (isfinite(reference->horizon))
        m->error = m->error_end = (double)NAN;
}

enum ad_status phys_motion_compare(struct solving *s, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    struct phys_reference reference = {0};
    struct ad_error cause = {0};
    size_t stride = (m->n + MOST_COMPARED - 1) / MOST_COMPARED;
    size_t n = m->n < 2 ? 0 : (m->n - 1 + stride - 1) / stride + 1;
    if (n == 0)
        return AD_OK; /* it did not begin */
    size_t dof = m->system->dof;
    double *times = malloc((n + 4 * dof) * sizeof *times), *sizes = times + n;
    size_t *samples = malloc(n * sizeof *samples);
    for (size_t i = 0; times && samples && i < n; i++)
        times[i] = m->t[samples[i] = sample_of(m, n, i)];
    if (!times || !samples || !(m->distance = malloc(m->n * sizeof *m->distance)))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_reference(m->system, m->start, m->start + m->system->dof, n, times,
                            PHYS_MOTION_LOST, solving_proceed, s, &reference, &cause) == AD_OK &&
             phys_ode_enter(&m->ode, 0, m->start, m->start + dof, sizes + 2 * dof, &cause) ==
                 AD_OK &&
             phys_typical_sizes(&m->ode, 0, sizes + 2 * dof, sizes, &cause) == AD_OK) {
        measure_distance(&reference, samples, sizes, m);
        if (s->settings->n_crossings > 0)
            phys_crossings_measure(s, &reference, samples, error);
    } else if (s->interrupted) {
        m->info.stop = PHYS_SIMULATION_INTERRUPTED;
    } else {
        ad_fail(error, cause.status, "the reference run: %.200s", cause.message);
    }
    if (isnan(m->known_until)) { /* nothing was measured */
        free(m->distance);
        m->distance = NULL;
    }
    phys_reference_free(&reference);
    AD_FREE(samples, times);
    return error->status;
}
