/* The Taylor series of the motion, as far as the tolerance asks: its order grows with the digits
   wanted, its step with the radius of convergence, both after Jorba and Zou (Experimental
   Mathematics 14 (2005) 99). The series is the dense output. */
#include "stepper.h"

#include <float.h>
#include <string.h>

enum { ORDER = PHYS_SERIES_MOST, LEAST = 5, LOOKS = 4, POINTS = 2, PAIRS = 2 };

/* The series about a point: about the step's start, and about its end, which is the next one's
   start. work: both; [n] slopes at the end of the step's series, times h; [n] what each component
   may err, inverse. A step of a few coordinates takes half a microsecond: sums stay in registers,
   and there are no divisions, calls or branches that could be spared. */
struct about {
    size_t order; /* 0: the coefficients are of no point yet */
    double t;
};
struct memory {
    struct about about[POINTS];
    size_t here;  /* which is of the step's start */
    size_t order; /* of this step */
    size_t usual; /* order for the tolerance `tol`: see longest */
    double tol, log2_tol;
    double last; /* size of the last coefficients, and that times |h|^order */
    double last_term;
    double h; /* of the step taken */
};
enum { HEADER = (sizeof(struct memory) + sizeof(double) - 1) / sizeof(double) };

static struct memory *memory_of(const struct phys_stepper *s)
{
    return (struct memory *)(void *)s->work;
}

/* Coefficients [ORDER + 1][n] about the step's start or end; the first row is the point. */
static double *coefficients(const struct phys_stepper *s, bool end)
{
    size_t which = memory_of(s)->here ^ (size_t)end;
    return s->work + HEADER + which * (ORDER + 1) * s->n;
}

static double *slopes(const struct phys_stepper *s)
{
    return s->work + HEADER + POINTS * (ORDER + 1) * s->n;
}

static double *weights(const struct phys_stepper *s) { return slopes(s) + s->n; }

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return HEADER + (POINTS * (ORDER + 1) + 2) * n;
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
    s->evaluations += order;
    if (s->ode->series(s->ode->context, order, t, c, error) == AD_OK)
        *about = (struct about){order, t};
    return error->status;
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

/* Largest of the coefficients of order k in units of what is allowed; s->worst is its component. */
static double size_of(struct phys_stepper *s, size_t k)
{
    const double *c = coefficients(s, false) + k * s->n, *weight = weights(s);
    double most = 0;
    size_t worst = s->worst;
    for (size_t i = 0; i < s->n; i++) {
        double x = fabs(c[i]) * weight[i];
        worst = x > most ? i : worst;
        most = x > most ? x : most;
    }
    s->worst = worst;
    return most;
}

static void weigh(const struct phys_stepper *s, const struct phys_tolerance *tolerance)
{
    double *weight = weights(s);
    for (size_t i = 0; i < s->n; i++) {
        double x = 1 / phys_allowed(tolerance, i, s->y[i]);
        weight[i] = x < DBL_MAX ? x : DBL_MAX; /* no error allowed: 0 has none */
    }
}

/* The logarithm of x > 0 to base 2, to 0.09, of a radius to 2 %: exponent and mantissa as they lie
   in the number. */
static double about_log2(double x)
{
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (double)(bits - (INT64_C(1023) << 52)) * 0x1p-52;
}

/* The radius of convergence as the last coefficients show it, of which some may be small by chance,
   times what makes the last term that is kept as small as allowed, and a little less. */
static enum ad_status longest(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                              double *h, struct ad_error *error)
{
    const double safety = 0.8, tol = fmax(fmax(tolerance->rtol, tolerance->atol), DBL_EPSILON);
    struct memory *m = memory_of(s);
    if (m->tol != tol) {
        m->tol = tol;
        m->usual = (size_t)fmin(fmax(ceil(-log(tol) / 2 + 7), LEAST), ORDER);
        m->log2_tol = log2(tol);
    }
    double radius = INFINITY; /* its logarithm */
    if (expand_start(s, error) != AD_OK)
        return error->status;
    const size_t order = m->order;
    weigh(s, tolerance);
    for (size_t k = order - LOOKS + 1; k <= order; k++) {
        double size = tol * (m->last = size_of(s, k)), x = -about_log2(size) / (double)k;
        radius = size > 0 && x < radius ? x : radius;
    }
    double x = safety * exp2(radius + m->log2_tol / (double)order);
    *h = x < DBL_MAX ? x : DBL_MAX;
    return AD_OK;
}

struct factor {
    double value, slope; /* h^k, k h^k */
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
static inline void sum_block(const double *c, size_t n, size_t order, size_t i, size_t pairs,
                             const struct factor *by, double *sum, double *slope)
{
    pair y[PAIRS] = {{0}}, dy[PAIRS] = {{0}};
    for (size_t k = order; k > 0; k--)
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
static inline void sum_terms(const double *c, size_t n, size_t order, const struct factor *by,
                             double *sum, double *slope)
{
    size_t i = 0;
    for (; i + 2 * PAIRS <= n; i += 2 * PAIRS)
        sum_block(c, n, order, i, PAIRS, by, sum, slope);
    for (; i < n; i += 2)
        sum_block(c, n, order, i, 1, by, sum, slope);
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
    sum_terms(coefficients(s, false), s->n, m->order, factors, s->next, slopes(s));
    for (size_t i = 0; i < s->n; i++)
        phys_stepper_sum(s, i, s->next[i]);
    return AD_OK;
}

/* The last term; and the defect at the step's end, y' - f, where it is not rounding: there the
   series of this point knows nothing of what comes. f is the first coefficient of the series about
   the end, with which the next step begins. */
static enum ad_status error_norm(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error)
{
    const double slack = 1e3, rounding = 1e3 * DBL_EPSILON, end = s->t + s->h;
    const double *slope = slopes(s);
    double most = memory_of(s)->last_term;
    if (!is_about(s, true, end, s->next) && expand_finite(s, true, end, s->next, error) != AD_OK)
        return error->status;
    memcpy(s->next_rate, coefficients(s, true) + s->n, s->n * sizeof *s->next_rate);
    s->has_next_rate = true;
    for (size_t i = 0; i < s->n; i++) {
        double rate = s->h * s->next_rate[i], before = fabs(s->y[i]), after = fabs(s->next[i]);
        double y = before > after ? before : after, miss = fabs(slope[i] - rate);
        double allowed = slack * phys_allowed(tolerance, i, y) + rounding * (y + fabs(rate));
        if (!(miss <= most * allowed) && miss != 0) {
            most = miss / allowed;
            s->worst = i;
        }
    }
    *norm = most;
    return AD_OK;
}

static void at(const struct phys_stepper *s, double theta, double *y)
{
    struct factor factors[ORDER + 1];
    const size_t order = memory_of(s)->order;
    raise(theta * memory_of(s)->h, order, factors);
    sum_terms(coefficients(s, false), s->n, order, factors, y, NULL);
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
