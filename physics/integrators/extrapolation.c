/* Extrapolation of the explicit midpoint rule (Gragg, Bulirsch, Stoer; Hairer, Norsett, Wanner,
   Solving Ordinary Differential Equations I, section II.9): 2, 4, 6 and 8 substeps, whose errors
   are series in h^2, give order 8. It shares no coefficients with the other methods, so references
   are computed with it. More columns would amplify rounding: the weights of four sum to 6 in
   magnitude, those of six to 27. */
#include "stepper.h"

enum { COLUMNS = 4 };

/* Work: increments over the step [COLUMNS][n]; two substeps back [n]; a rate [n]. */
static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return (COLUMNS + 2) * n;
}

/* Increment [n] over h by m steps of the midpoint rule and Gragg's smoothing step, (y_m-1 + 2 y_m +
   y_m+1) / 4, which looks at the force at the end: else a pulse centred there would be passed
   over by half. */
static enum ad_status midpoint(struct phys_stepper *s, double h, size_t m, double *increment,
                               struct ad_error *error)
{
    size_t n = s->n;
    double *before = s->work + COLUMNS * n, *rate = before + n, step = h / (double)m;
    for (size_t k = 0; k < n; k++) {
        before[k] = 0;
        increment[k] = step * s->rate[k];
    }
    for (size_t i = 1; i <= m; i++) {
        for (size_t k = 0; k < n; k++)
            s->next[k] = s->y[k] + (s->cut[k] + increment[k]);
        if (phys_stepper_rate(s, s->t + (double)i * step, s->next, rate, error) != AD_OK)
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
    size_t n = s->n;
    if (phys_stepper_need_rate(s, error) != AD_OK)
        return error->status;
    for (size_t i = 0; i < COLUMNS; i++) {
        if (midpoint(s, h, 2 * (i + 1), s->work + i * n, error) != AD_OK)
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
