/* Explicit Runge-Kutta methods from their coefficient tables: steps, error norms, dense output. */
#include "stepper.h"

#include <math.h>

static const struct phys_butcher *table_of(const struct phys_integrator *integrator)
{
    return integrator->coefficients;
}

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    const struct phys_butcher *table = table_of(integrator);
    return (table->stages + table->extra + 2) * n;
}

static size_t extra(const struct phys_integrator *integrator)
{
    return table_of(integrator)->n_dense;
}

/* Slope j: the first and the one after the last stage are the rates at the ends. */
static double *slope(const struct phys_stepper *s, size_t j)
{
    size_t stages = table_of(s->integrator)->stages;
    if (j == 0)
        return s->rate;
    if (j == stages)
        return s->next_rate;
    return s->work + (j < stages ? j + 1 : j) * s->n;
}

/* Where stages are evaluated, and sums are formed: the first two rows of work. */
static double *stage_point(const struct phys_stepper *s) { return s->work; }

/* sum [n] = sum over j < count of w_j slope_j. */
static void combine(const struct phys_stepper *s, size_t count, const double *w, double *sum)
{
    size_t n = s->n;
    for (size_t k = 0; k < n; k++)
        sum[k] = 0;
    for (size_t j = 0; j < count; j++) {
        const double *K = slope(s, j), a = w[j];
        for (size_t k = 0; k < n && a != 0; k++)
            sum[k] += a * K[k];
    }
}

/* to = y + h * to. */
static void go(const struct phys_stepper *s, double h, double *to)
{
    for (size_t k = 0; k < s->n; k++)
        to[k] = s->y[k] + h * to[k];
}

static enum ad_status stage(struct phys_stepper *s, double h, size_t i, double c, const double *row,
                            struct ad_error *error)
{
    double *at = stage_point(s);
    combine(s, i, row, at);
    go(s, h, at);
    return phys_stepper_rate(s, s->t + c * h, at, slope(s, i), error);
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const struct phys_butcher *table = table_of(s->integrator);
    const double *row = table->a;
    if (phys_stepper_need_rate(s, error) != AD_OK)
        return error->status;
    for (size_t i = 1; i < table->stages; i++) {
        row += i - 1;
        if (stage(s, h, i, table->c[i], row, error) != AD_OK)
            return error->status;
    }
    combine(s, table->stages, table->b, s->next);
    for (size_t k = 0; k < s->n; k++)
        phys_stepper_sum(s, k, h * s->next[k]);
    return AD_OK;
}

/* Mean square of the scaled error with these weights. */
static double mean_square(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                          const double *weights)
{
    double *e = stage_point(s);
    combine(s, table_of(s->integrator)->stages + 1, weights, e);
    for (size_t k = 0; k < s->n; k++)
        e[k] *= s->h;
    return phys_stepper_mean_square(s, tolerance, e);
}

/* With two estimates, e5 sqrt(e5 / (e5 + e3 / 100)), of order 8 where e3 dominates (ibid., section
   II.10). */
static enum ad_status error_norm(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error)
{
    const struct phys_butcher *table = table_of(s->integrator);
    if (table->error[table->stages] != 0 && phys_stepper_need_next_rate(s, error) != AD_OK)
        return error->status;
    double low = table->error_3 ? mean_square(s, tolerance, table->error_3) : 0;
    double e = mean_square(s, tolerance, table->error);
    *norm = low == 0 ? sqrt(e) : e / sqrt(e + 0.01 * low);
    return AD_OK;
}

static enum ad_status dense(struct phys_stepper *s, double *rows, struct ad_error *error)
{
    const struct phys_butcher *table = table_of(s->integrator);
    size_t stages = table->stages, all = stages + 1 + table->extra;
    const double *row = table->a + stages * (stages - 1) / 2;
    for (size_t i = stages + 1; i < all; i++) {
        if (stage(s, s->h, i, table->c[i - 1], row, error) != AD_OK)
            return error->status;
        row += i;
    }
    for (size_t r = 0; r < table->n_dense; r++) {
        combine(s, all, table->dense + r * all, rows + r * s->n);
        for (size_t k = 0; k < s->n; k++)
            rows[r * s->n + k] *= s->h;
    }
    return AD_OK;
}

const struct phys_scheme phys_runge_kutta = {.uses_rate = true,
                                             .work = work,
                                             .extra = extra,
                                             .step = step,
                                             .error_norm = error_norm,
                                             .dense = dense};
