/* The Taylor series of the motion, as far as the tolerance asks: its order grows with the digits
   wanted, its step with the radius of convergence, both after Jorba and Zou (Experimental
   Mathematics 14 (2005) 99). The series is the dense output. */
#include "stepper.h"

#include <float.h>
#include <string.h>

enum { ORDER = PHYS_SERIES_MOST, LEAST = 5, LOOKS = 4, HERMITE = 3, POINTS = 2 };

/* The series about a point: about the step's start, and about its end, which is the next one's
   start. work: both; [n] slopes at the end of the step's series, times h; [n] what each component
   may err, inverse. */
struct about {
    size_t order; /* 0: the coefficients are of no point yet */
    double t;
};
struct memory {
    struct about about[POINTS];
    size_t here;          /* which is of the step's start */
    size_t order;         /* for the tolerance `tol`: see longest */
    double tol, log2_tol; /* the latter over the order */
    double power;         /* |h|^order of the step taken */
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

/* Largest of the coefficients of order k in units of what is allowed. */
static double size_of(struct phys_stepper *s, size_t k)
{
    const double *c = coefficients(s, false) + k * s->n, *weight = weights(s);
    double most = 0;
    for (size_t i = 0; i < s->n; i++) {
        double x = fabs(c[i]) * weight[i];
        if (!(x <= most) && c[i] != 0) {
            most = x;
            s->worst = i;
        }
    }
    return most;
}

static void weigh(const struct phys_stepper *s, const struct phys_tolerance *tolerance)
{
    double *weight = weights(s);
    for (size_t i = 0; i < s->n; i++)
        weight[i] = 1 / phys_allowed(tolerance, i, s->y[i]);
}

/* The logarithm of x > 0 to base 2, to 0.09: of a radius, to 2 %. */
static double about_log2(double x)
{
    int exponent;
    double m = frexp(x, &exponent);
    return (double)exponent + 2 * m - 2;
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
        double size = tol * size_of(s, k);
        if (size > 0)
            radius = fmin(radius, -about_log2(size) / (double)k);
    }
    *h = fmin(safety * exp2(radius + m->log2_tol), DBL_MAX);
    return AD_OK;
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const size_t n = s->n, known = memory_of(s)->order, order = known ? known : ORDER;
    double *slope = slopes(s), *next = s->next, power[ORDER + 1];
    if (expand_start(s, order, error) != AD_OK)
        return error->status;
    power[0] = 1;
    for (size_t k = 1; k <= order; k++)
        power[k] = power[k - 1] * h;
    memory_of(s)->power = fabs(power[order]);
    const double *c = coefficients(s, false);
    memset(next, 0, n * sizeof *next);
    memset(slope, 0, n * sizeof *slope);
    for (size_t k = order; k > 0; k--)
        for (size_t i = 0; i < n; i++) {
            double term = c[k * n + i] * power[k];
            next[i] += term;
            slope[i] += (double)k * term;
        }
    for (size_t i = 0; i < n; i++)
        phys_stepper_sum(s, i, next[i]);
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
    weigh(s, tolerance);
    *norm = size_of(s, order) * memory_of(s)->power;
    if (!is_about(s, true, order, end, s->next) &&
        expand(s, true, order, end, s->next, error) != AD_OK)
        return error->status;
    memcpy(s->next_rate, coefficients(s, true) + s->n, s->n * sizeof *s->next_rate);
    s->has_next_rate = true;
    for (size_t i = 0; i < s->n; i++) {
        double rate = s->h * s->next_rate[i], y = fmax(fabs(s->y[i]), fabs(s->next[i]));
        double allowed = slack * phys_allowed(tolerance, i, y) + rounding * (y + fabs(rate));
        double x = fabs(slope[i] - rate) / allowed;
        if (!(x <= *norm) && slope[i] != rate) {
            *norm = x;
            s->worst = i;
        }
    }
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
