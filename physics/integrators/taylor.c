/* The Taylor series of the motion, as far as the tolerance asks: its order grows with the digits
   wanted, its step with the radius of convergence, both after Jorba and Zou (Experimental
   Mathematics 14 (2005) 99). The series is the dense output. */
#include "stepper.h"

#include <float.h>
#include <string.h>

enum { ORDER = PHYS_SERIES_MOST, LEAST = 5, LOOKS = 4, HERMITE = 3, POINTS = 2, PAIRS = 2 };

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
    size_t here;          /* which is of the step's start */
    size_t order;         /* for the tolerance `tol`: see longest */
    double tol, log2_tol; /* the latter over the order */
    double last;          /* size of the last coefficients, and that times |h|^order */
    double last_term;
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

static size_t extra(const struct phys_integrator *integrator)
{
    (void)integrator;
    return ORDER - HERMITE;
}

static bool is_about(const struct phys_stepper *s, bool end, size_t order, double t,
                     const double *y)
{
    const struct about *about = &memory_of(s)->about[memory_of(s)->here ^ (size_t)end];
    return about->order == order && about->t == t &&
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

/* Coefficients about the step's start, which often was the end of the step before. */
static enum ad_status expand_start(struct phys_stepper *s, size_t order, struct ad_error *error)
{
    if (!is_about(s, false, order, s->t, s->y)) {
        if (is_about(s, true, order, s->t, s->y))
            memory_of(s)->here ^= 1;
        else if (expand(s, false, order, s->t, s->y, error) != AD_OK)
            return error->status;
    }
    memcpy(s->rate, coefficients(s, false) + s->n, s->n * sizeof *s->rate);
    s->has_rate = true;
    s->n_dense = order;
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
        m->order = (size_t)fmin(fmax(ceil(-log(tol) / 2 + 2), LEAST), ORDER);
        m->log2_tol = log2(tol) / (double)m->order;
    }
    const size_t order = m->order;
    double radius = INFINITY; /* its logarithm */
    if (expand_start(s, order, error) != AD_OK)
        return error->status;
    weigh(s, tolerance);
    for (size_t k = order - LOOKS + 1; k <= order; k++) {
        double size = tol * (m->last = size_of(s, k)), x = -about_log2(size) / (double)k;
        radius = size > 0 && x < radius ? x : radius;
    }
    double x = safety * exp2(radius + m->log2_tol);
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

/* The sums of the terms, smallest first, and of k times term k, for the components from i on: as
   many as registers hold. n is even: coordinates and velocities. */
static inline void sum_terms(const double *c, size_t n, size_t order, size_t i, size_t pairs,
                             const struct factor *at, double *sum, double *slope)
{
    pair y[PAIRS] = {{0}}, dy[PAIRS] = {{0}};
    for (size_t k = order; k > 0; k--)
        for (size_t j = 0; j < pairs; j++) {
            pair x = pair_at(c + k * n + i + 2 * j);
            y[j] += x * at[k].value;
            dy[j] += x * at[k].slope;
        }
    memcpy(sum + i, y, pairs * sizeof *y);
    memcpy(slope + i, dy, pairs * sizeof *dy);
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const size_t n = s->n, known = memory_of(s)->order, order = known ? known : ORDER;
    struct factor at[ORDER + 1];
    if (expand_start(s, order, error) != AD_OK)
        return error->status;
    at[1] = (struct factor){h, h};
    for (size_t k = 2; k <= order; k++) {
        at[k].value = at[k / 2].value * at[k - k / 2].value;
        at[k].slope = (double)k * at[k].value;
    }
    memory_of(s)->last_term = memory_of(s)->last * fabs(at[order].value);
    const double *c = coefficients(s, false);
    size_t i = 0;
    for (; i + 2 * PAIRS <= n; i += 2 * PAIRS)
        sum_terms(c, n, order, i, PAIRS, at, s->next, slopes(s));
    for (; i < n; i += 2)
        sum_terms(c, n, order, i, 1, at, s->next, slopes(s));
    for (i = 0; i < n; i++)
        phys_stepper_sum(s, i, s->next[i]);
    return AD_OK;
}

/* The last term; and the defect at the step's end, y' - f, where it is not rounding: there the
   series of this point knows nothing of what comes. f is the first coefficient of the series about
   the end, with which the next step begins. */
static enum ad_status error_norm(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error)
{
    const size_t order = s->n_dense;
    const double slack = 1e3, rounding = 1e3 * DBL_EPSILON, end = s->t + s->h;
    const double *slope = slopes(s);
    double most = memory_of(s)->last_term;
    if (!is_about(s, true, order, end, s->next) &&
        expand(s, true, order, end, s->next, error) != AD_OK)
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

/* Rows for phys_stepper_at: the series divided by theta; what it is at theta = 1; the difference
   divided by 1 - theta. */
static enum ad_status dense(struct phys_stepper *s, double *rows, struct ad_error *error)
{
    const double *c = coefficients(s, false);
    const size_t n = s->n, order = s->n_dense;
    (void)error;
    double power = 1;
    for (size_t k = 0; k < order; k++) {
        power *= s->h;
        for (size_t i = 0; i < n; i++)
            rows[k * n + i] = power * c[(k + 1) * n + i];
    }
    for (size_t i = 0; i < n; i++) {
        double above = 0;
        for (size_t k = order; k-- > 1;) {
            double x = rows[k * n + i];
            above += x;
            rows[k * n + i] = -above;
        }
        rows[i] += above;
    }
    return AD_OK;
}

const struct phys_scheme phys_power_series = {.uses_rate = true,
                                              .work = work,
                                              .extra = extra,
                                              .longest = longest,
                                              .step = step,
                                              .error_norm = error_norm,
                                              .dense = dense,
                                              .whole = true};

const struct phys_integrator phys_taylor = {
    .name = "taylor",
    .what = "Taylor series of the motion, chooses order and steps",
    .adaptive = true,
    .scheme = &phys_power_series,
};
