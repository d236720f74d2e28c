/* The Taylor series of the motion, as far as the tolerance asks: its order grows with the digits
   wanted, its step with the radius of convergence, both after Jorba and Zou (Experimental
   Mathematics 14 (2005) 99). The series is the dense output. */
#include "autodiff/exact.h"
#include "taylor.h"

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return HEADER + (POINTS * ROWS + 2) * n;
}

static bool is_about(const struct phys_stepper *s, bool end, double t, const double *y)
{
    const struct about *about = &memory_of(s)->about[memory_of(s)->here ^ (size_t)end];
    return about->order > 0 && about->t == t &&
           memcmp(coefficients(s, end), y, s->n * sizeof *y) == 0;
}

static enum ad_status expand(struct phys_stepper *s, bool end, size_t order, double t,
                             const double *y, struct ad_error *error)
{
    struct about *about = &memory_of(s)->about[memory_of(s)->here ^ (size_t)end];
    double *c = coefficients(s, end);
    about->order = 0;
    memcpy(c, y, s->n * sizeof *y);
    const double *cut = end ? s->next_cut : s->cut;
    s->evaluations += order;
    if (s->ode->series(s->ode->context, order, t, c, cut, error) != AD_OK)
        return error->status;
    if (memory_of(s)->fine)
        s->ode->rest(s->ode->context, t, y, cut, rests(s, end));
    *about = (struct about){order, t};
    return AD_OK;
}

/* The same of the usual order, or of a lower one where coefficients overflow: next to a singularity
   they grow as powers of the inverse of its distance. */
static enum ad_status expand_finite(struct phys_stepper *s, bool end, double t, const double *y,
                                    struct ad_error *error)
{
    size_t order = memory_of(s)->usual;
    while (expand(s, end, order, t, y, error) == AD_E_NONFINITE && order / 2 >= LEAST) {
        order /= 2;
        error->status = AD_OK;
    }
    return error->status;
}

/* Coefficients about the step's start, which often was the end of the step before. */
static enum ad_status expand_start(struct phys_stepper *s, struct ad_error *error)
{
    struct memory *m = memory_of(s);
    if (!is_about(s, false, s->t, s->y)) {
        if (is_about(s, true, s->t, s->y))
            m->here ^= 1;
        else if (expand_finite(s, false, s->t, s->y, error) != AD_OK)
            return error->status;
    }
    m->order = m->about[m->here].order;
    memcpy(s->rate, coefficients(s, false) + s->n, s->n * sizeof *s->rate);
    s->has_rate = true;
    return AD_OK;
}

static enum ad_status longest(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                              double *h, struct ad_error *error)
{
    phys_taylor_tune(s, tolerance);
    if (expand_start(s, error) != AD_OK)
        return error->status;
    weigh(s, tolerance);
    *h = phys_taylor_length(s, coefficients(s, false));
    return AD_OK;
}

struct factor {
    double value, slope; /* h^k, k h^k */
};
struct orders {
    size_t first, last;
};
typedef double pair __attribute__((vector_size(16)));

static inline pair pair_at(const double *x)
{
    pair y;
    memcpy(&y, x, sizeof y);
    return y;
}

static void raise(double h, size_t order, struct factor *to)
{
    to[1] = (struct factor){h, h};
    for (size_t k = 2; k <= order; k++) {
        to[k].value = to[k / 2].value * to[k - k / 2].value;
        to[k].slope = (double)k * to[k].value;
    }
}

/* For the components from i on, as many as registers hold. */
static inline void sum_block(const double *c, size_t n, struct orders orders, size_t i,
                             size_t pairs, const struct factor *by, double *sum, double *slope)
{
    pair y[PAIRS] = {{0}}, dy[PAIRS] = {{0}};
    for (size_t k = orders.last; k >= orders.first; k--)
        for (size_t j = 0; j < pairs; j++) {
            pair x = pair_at(c + k * n + i + 2 * j);
            y[j] += x * by[k].value;
            if (slope)
                dy[j] += x * by[k].slope;
        }
    memcpy(sum + i, y, pairs * sizeof *y);
    if (slope)
        memcpy(slope + i, dy, pairs * sizeof *dy);
}

/* The sums of the terms, smallest first, and their slopes, or NULL. n is even: coordinates and
   velocities. */
static inline void sum_terms(const double *c, size_t n, struct orders orders,
                             const struct factor *by, double *sum, double *slope)
{
    size_t i = 0;
    for (; i + 2 * PAIRS <= n; i += 2 * PAIRS)
        sum_block(c, n, orders, i, PAIRS, by, sum, slope);
    for (; i < n; i += 2)
        sum_block(c, n, orders, i, 1, by, sum, slope);
}

/* The point at h of the step's series, next, and what rounding cuts off it. */
static void follow(const struct phys_stepper *s, double h, const struct factor *factors,
                   double *next, double *next_cut, double *slope)
{
    const double *c = coefficients(s, false), *rates = c + s->n, *rest = rests(s, false);
    sum_terms(c, s->n, (struct orders){2, memory_of(s)->order}, factors, next, slope);
    for (size_t i = 0; i < s->n; i++) {
        const double first = h * rates[i], low = ad_off_product(h, rates[i], first) + h * rest[i],
                     sum = s->y[i] + first,
                     more = next[i] + ((isfinite(low) ? low : 0) + s->cut[i]) +
                            ad_off_sum(s->y[i], first, sum);
        next[i] = sum + more;
        next_cut[i] = ad_off_sum(sum, more, next[i]);
        if (slope)
            slope[i] += first;
    }
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct memory *m = memory_of(s);
    struct factor factors[ORDER + 1];
    if (expand_start(s, error) != AD_OK)
        return error->status;
    raise(h, m->order, factors);
    m->h = h;
    m->last_term = m->last * fabs(factors[m->order].value);
    if (m->fine) {
        follow(s, h, factors, s->next, s->next_cut, slopes(s));
        return AD_OK;
    }
    sum_terms(coefficients(s, false), s->n, (struct orders){1, m->order}, factors, s->next,
              slopes(s));
    for (size_t i = 0; i < s->n; i++)
        phys_stepper_sum(s, i, s->next[i]);
    return AD_OK;
}

enum ad_status phys_taylor_expand_end(struct phys_stepper *s, struct ad_error *error)
{
    return expand_finite(s, true, s->end, s->next, error);
}

/* f at the end is the first coefficient of the series about it, with which the next step begins. */
static enum ad_status error_norm(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error)
{
    if (!is_about(s, true, s->end, s->next) &&
        expand_finite(s, true, s->end, s->next, error) != AD_OK)
        return error->status;
    memcpy(s->next_rate, coefficients(s, true) + s->n, s->n * sizeof *s->next_rate);
    s->has_next_rate = true;
    *norm = phys_taylor_norm(s, tolerance, slopes(s), s->next_rate);
    return AD_OK;
}

static void at(const struct phys_stepper *s, double theta, double *y)
{
    struct factor factors[ORDER + 1];
    const size_t order = memory_of(s)->order;
    raise(theta * memory_of(s)->h, order, factors);
    sum_terms(coefficients(s, false), s->n, (struct orders){1, order}, factors, y, NULL);
    for (size_t i = 0; i < s->n; i++)
        y[i] += s->y[i];
}

const struct phys_scheme phys_power_series = {.uses_rate = true,
                                              .work = work,
                                              .longest = longest,
                                              .step = step,
                                              .error_norm = error_norm,
                                              .at = at};

const struct phys_integrator phys_taylor = {
    .name = "taylor",
    .what = "Taylor series of the motion, chooses order and steps",
    .adaptive = true,
    .scheme = &phys_power_series,
};
