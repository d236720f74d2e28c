/* Extrapolation of the explicit midpoint rule (Gragg, Bulirsch, Stoer; Hairer, Norsett, Wanner,
   Solving Ordinary Differential Equations I, section II.9): 2, 4, 6 and 8 substeps, whose errors
   are series in h^2, give order 8. It shares no coefficients with the other methods, so references
   are computed with it. More columns would amplify rounding: the weights of four sum to 6 in
   magnitude, those of six to 27.

   In close encounters forces see what rounding cuts off places, of which differences are much
   smaller. There the part that was cut off is carried into the rates, by a difference of two: other
   methods do that by their own means (autodiff/series.h). */
#include "stepper.h"

#include <float.h>
#include <string.h>

enum { COLUMNS = 4 };

/* Work: increments over the step [COLUMNS][n]; two substeps back, a rate, what is cut off a point,
   another point, and its rate [n]. */
static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return (COLUMNS + 5) * n;
}

/* The rate at s->next + cut, of which s->next is rounded; *share: by how much cut changes that of
   the second half, of its size. Next to the end of what the forces are defined for, cut is left
   out. */
static enum ad_status carried_rate(struct phys_stepper *s, double t, const double *cut,
                                   double *rate, double *share, struct ad_error *error)
{
    const double scale = 0x1p20;
    double *point = s->work + (COLUMNS + 3) * s->n, *other = point + s->n, change = 0, size = 0;
    struct ad_error outside = {0};
    *share = 0;
    if (phys_stepper_rate(s, t, s->next, rate, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < s->n; k++)
        point[k] = s->next[k] + scale * cut[k];
    if (phys_stepper_rate(s, t, point, other, &outside) == AD_E_NONFINITE)
        return AD_OK;
    if (outside.status != AD_OK)
        return ad_fail(error, outside.status, "%s", outside.message);
    for (size_t k = 0; k < s->n; k++) {
        const double more = (other[k] - rate[k]) / scale;
        change = k < s->n / 2 ? 0 : fmax(change, fabs(more));
        size = k < s->n / 2 ? 0 : fmax(size, fabs(rate[k]));
        rate[k] += more;
    }
    *share = size > 0 ? change / size : 0;
    return AD_OK;
}

/* Increment [n] over h by m steps of the midpoint rule and Gragg's smoothing step, (y_m-1 + 2 y_m +
   y_m+1) / 4, which looks at the force at the end: else a pulse centred there would be passed
   over by half. */
static enum ad_status midpoint(struct phys_stepper *s, double h, size_t m, bool carries,
                               double *increment, struct ad_error *error)
{
    size_t n = s->n;
    double *before = s->work + COLUMNS * n, *rate = before + n, *cut = rate + n;
    double step = h / (double)m, share;
    for (size_t k = 0; k < n; k++) {
        before[k] = 0;
        increment[k] = step * s->rate[k];
    }
    for (size_t i = 1; i <= m; i++) {
        const double t = s->t + (double)i * step;
        for (size_t k = 0; k < n; k++)
            phys_add_with_cut(s->y[k], increment[k], s->cut[k], &s->next[k], &cut[k]);
        if ((carries ? carried_rate(s, t, cut, rate, &share, error)
                     : phys_stepper_rate(s, t, s->next, rate, error)) != AD_OK)
            return error->status;
        for (size_t k = 0; k < n; k++) {
            double last = before[k], now = increment[k], next = last + 2 * step * rate[k];
            before[k] = now;
            increment[k] = i < m ? next : 0.25 * (last + 2 * now + next);
        }
    }
    return AD_OK;
}

/* Aitken and Neville: column j of row i replaces column j - 1 of row i - 1. */
static void extrapolate(size_t n, size_t i, double *T)
{
    for (size_t j = i; j-- > 0;) {
        double ratio = (double)(i + 1) / (double)(j + 1);
        double weight = 1 / (ratio * ratio - 1);
        for (size_t k = 0; k < n; k++)
            T[j * n + k] = T[(j + 1) * n + k] + weight * (T[(j + 1) * n + k] - T[j * n + k]);
    }
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const double rounding = 8 * DBL_EPSILON; /* of the rates */
    size_t n = s->n;
    double share;
    memcpy(s->next, s->y, n * sizeof *s->y);
    if (carried_rate(s, s->t, s->cut, s->rate, &share, error) != AD_OK)
        return error->status;
    s->has_rate = true;
    s->interpolations += share > 8 * rounding; /* of which there are no others */
    for (size_t i = 0; i < COLUMNS; i++) {
        if (midpoint(s, h, 2 * (i + 1), share > rounding, s->work + i * n, error) != AD_OK)
            return error->status;
        extrapolate(n, i, s->work);
    }
    for (size_t k = 0; k < n; k++)
        phys_stepper_sum(s, k, s->work[k]);
    return AD_OK;
}

/* The last two numbers of the last row: orders 8 and 6. */
static enum ad_status error_norm(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error)
{
    double *T = s->work;
    (void)error;
    for (size_t k = 0; k < s->n; k++)
        T[k] -= T[s->n + k];
    *norm = sqrt(phys_stepper_mean_square(s, tolerance, T));
    return AD_OK;
}

static const struct phys_scheme scheme = {
    .uses_rate = true, .work = work, .step = step, .error_norm = error_norm};

const struct phys_integrator phys_extrapolation = {
    .name = "extrapolation",
    .what = "Gragg-Bulirsch-Stoer of order 8, chooses its steps",
    .order = 8,
    .adaptive = true,
    .scheme = &scheme,
};
