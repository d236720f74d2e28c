/* The Taylor series of the motion, as far as the tolerance asks: its order grows with the digits
   wanted, its step with the radius of convergence, both after Jorba and Zou (Experimental
   Mathematics 14 (2005) 99). The series is the dense output. */
#include "stepper.h"

#include <float.h>
#include <string.h>

/* work: the coefficients [ORDER + 1][n] of `state`'s point, and that point [n]. */
enum { ORDER = PHYS_SERIES_MOST, LEAST = 5, LOOKS = 4, HERMITE = 3 };

struct memory {
    double *c, *y;
};

static struct memory memory_of(const struct phys_stepper *s)
{
    return (struct memory){s->work, s->work + (ORDER + 1) * s->n};
}

struct about {
    size_t order; /* 0: the coefficients are of no point yet */
    double t;
};

static struct about *about_of(const struct phys_stepper *s)
{
    return (struct about *)(void *)(memory_of(s).y + s->n);
}

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return (ORDER + 2) * n + sizeof(struct about) / sizeof(double) + 1;
}

static size_t extra(const struct phys_integrator *integrator)
{
    (void)integrator;
    return ORDER - HERMITE;
}

/* Coefficients about the step's start, unless they are there. */
static enum ad_status expand(struct phys_stepper *s, size_t order, struct ad_error *error)
{
    struct memory m = memory_of(s);
    struct about *about = about_of(s);
    const size_t bytes = s->n * sizeof *m.y;
    if (about->order == order && about->t == s->t && memcmp(m.y, s->y, bytes) == 0)
        return AD_OK;
    about->order = 0;
    memcpy(m.c, s->y, bytes);
    memcpy(m.y, s->y, bytes);
    s->evaluations += order;
    if (s->ode->series(s->ode->context, order, s->t, m.c, error) != AD_OK)
        return error->status;
    *about = (struct about){order, s->t};
    memcpy(s->rate, m.c + s->n, bytes);
    s->has_rate = true;
    s->n_dense = order;
    return AD_OK;
}

/* Largest of the coefficients of order k in units of what is allowed. */
static double size_of(struct phys_stepper *s, const struct phys_tolerance *tolerance, size_t k)
{
    const double *c = memory_of(s).c + k * s->n;
    double most = 0;
    for (size_t i = 0; i < s->n; i++) {
        double x = fabs(c[i]) / phys_allowed(tolerance, i, s->y[i]);
        if (c[i] != 0 && !(x <= most)) {
            most = x;
            s->worst = i;
        }
    }
    return most;
}

/* The radius of convergence as the last coefficients show it, of which some may be small by chance,
   times what makes the last term that is kept as small as allowed, and a little less. */
static enum ad_status longest(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                              double *h, struct ad_error *error)
{
    const double safety = 0.8, tol = fmax(fmax(tolerance->rtol, tolerance->atol), DBL_EPSILON);
    const size_t order = (size_t)fmin(fmax(ceil(-log(tol) / 2 + 2), LEAST), ORDER);
    double radius = INFINITY;
    if (expand(s, order, error) != AD_OK)
        return error->status;
    for (size_t k = order - LOOKS + 1; k <= order; k++) {
        double size = tol * size_of(s, tolerance, k);
        if (size > 0)
            radius = fmin(radius, pow(size, -1 / (double)k));
    }
    *h = fmin(safety * radius * pow(tol, 1 / (double)order), DBL_MAX);
    return AD_OK;
}

/* Sum of factor_k c_k h^k over 1 <= k <= order, with factor k for the derivative times h. */
static void sum(const struct phys_stepper *s, double h, bool derivative, double *to)
{
    const struct memory m = memory_of(s);
    memset(to, 0, s->n * sizeof *to);
    for (size_t k = about_of(s)->order; k > 0; k--)
        for (size_t i = 0; i < s->n; i++)
            to[i] = (to[i] + (derivative ? (double)k : 1) * m.c[k * s->n + i]) * h;
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    if (expand(s, about_of(s)->order ? about_of(s)->order : ORDER, error) != AD_OK)
        return error->status;
    sum(s, h, false, s->next);
    for (size_t i = 0; i < s->n; i++)
        phys_stepper_sum(s, i, s->next[i]);
    return AD_OK;
}

/* The last term; and the defect at the step's end, y' - f, where it is not rounding: there the
   series of this point knows nothing of what comes. */
static enum ad_status error_norm(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error)
{
    const size_t order = about_of(s)->order;
    const double slack = 1e3, rounding = 1e3 * DBL_EPSILON;
    double *defect = s->dense; /* not in use yet */
    *norm = size_of(s, tolerance, order) * pow(fabs(s->h), (double)order);
    if (phys_stepper_need_next_rate(s, error) != AD_OK)
        return error->status;
    sum(s, s->h, true, defect);
    for (size_t i = 0; i < s->n; i++) {
        double rate = s->h * s->next_rate[i], y = fmax(fabs(s->y[i]), fabs(s->next[i]));
        double allowed = slack * phys_allowed(tolerance, i, y) + rounding * (y + fabs(rate));
        double x = fabs(defect[i] - rate) / allowed;
        if (!(x <= *norm) && defect[i] != rate) {
            *norm = x;
            s->worst = i;
        }
    }
    return AD_OK;
}

/* Rows for phys_stepper_at, factors theta and 1 - theta in turn: the series divided by theta, what
   remains at theta = 1 taken off, and so on. */
static enum ad_status dense(struct phys_stepper *s, double *rows, struct ad_error *error)
{
    const struct memory m = memory_of(s);
    const size_t order = about_of(s)->order;
    (void)error;
    double power = 1;
    for (size_t k = 0; k < order; k++) {
        power *= s->h;
        for (size_t i = 0; i < s->n; i++)
            rows[k * s->n + i] = power * m.c[(k + 1) * s->n + i];
    }
    /* row r: p_r(theta) = sum of the rows from r on times powers of theta. Odd steps divide p -
       p(1) by 1 - theta, even ones p - p(0) by theta. */
    for (size_t r = 0; r + 1 < order; r++)
        if (r % 2 == 0)
            for (size_t i = 0; i < s->n; i++) {
                double *p = rows + r * s->n + i, above = 0;
                for (size_t k = order - r; k-- > 1;) {
                    double x = p[k * s->n];
                    above += x; /* coefficient k - 1 of (p - p(1)) / (theta - 1) */
                    p[k * s->n] = -above;
                }
                p[0] += above;
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
