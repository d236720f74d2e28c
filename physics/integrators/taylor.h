/* The step of the Taylor series, shared by that of one motion (taylor.c) and that of many at once
   (taylor_points.c), which does the same operations, so to the same bits. */
#ifndef PHYSICS_INTEGRATORS_TAYLOR_H
#define PHYSICS_INTEGRATORS_TAYLOR_H

#include "stepper.h"

#include <float.h>
#include <string.h>

enum {
    ORDER = PHYS_SERIES_MOST,
    ROWS = ORDER + 2,
    LEAST = 5,
    USUAL = 22,
    LOOKS = 4,
    POINTS = 2,
    PAIRS = 2
};

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
    bool fine;   /* rounding is what limits: the first terms are known to more digits */
    double last; /* size of the last coefficients, and that times |h|^order */
    double last_term;
    double h; /* of the step taken */
};
enum { HEADER = (sizeof(struct memory) + sizeof(double) - 1) / sizeof(double) };

static inline struct memory *memory_of(const struct phys_stepper *s)
{
    return (struct memory *)(void *)s->work;
}

/* Coefficients [ROWS][n] about the step's start or end; the first row is the point, the last what
   rounding cut off the second, if `fine`. */
static inline double *coefficients(const struct phys_stepper *s, bool end)
{
    size_t which = memory_of(s)->here ^ (size_t)end;
    return s->work + HEADER + which * ROWS * s->n;
}

static inline double *rests(const struct phys_stepper *s, bool end)
{
    return coefficients(s, end) + (ROWS - 1) * s->n;
}

static inline double *slopes(const struct phys_stepper *s)
{
    return s->work + HEADER + POINTS * ROWS * s->n;
}

static inline double *weights(const struct phys_stepper *s) { return slopes(s) + s->n; }

/* The series about the end of a step, of the usual order or of a lower one (taylor.c). */
enum ad_status phys_taylor_expand_end(struct phys_stepper *s, struct ad_error *error);

/* Largest of the coefficients of order k in units of what is allowed; s->worst is its component. */
static inline double size_of(struct phys_stepper *s, const double *c, size_t k)
{
    const double *weight = weights(s);
    double most = 0;
    size_t worst = s->worst;
    for (size_t i = 0; i < s->n; i++) {
        double x = fabs(c[k * s->n + i]) * weight[i];
        worst = x > most ? i : worst;
        most = x > most ? x : most;
    }
    s->worst = worst;
    return most;
}

static inline void weigh(const struct phys_stepper *s, const struct phys_tolerance *tolerance)
{
    double *weight = weights(s);
    for (size_t i = 0; i < s->n; i++) {
        double x = 1 / phys_allowed(tolerance, i, s->y[i]);
        weight[i] = x < DBL_MAX ? x : DBL_MAX; /* no error allowed: 0 has none */
    }
}

/* The logarithm of x > 0 to base 2, to 0.09, of a radius to 2 %: exponent and mantissa as they lie
   in the number. */
static inline double about_log2(double x)
{
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (double)(bits - (INT64_C(1023) << 52)) * 0x1p-52;
}

/* The order for the tolerance: not above USUAL, where longer steps would save little and round
 * more. */
static inline void phys_taylor_tune(struct phys_stepper *s, const struct phys_tolerance *tolerance)
{
    const double tol = fmax(fmax(tolerance->rtol, tolerance->atol), DBL_EPSILON);
    struct memory *m = memory_of(s);
    if (m->tol != tol) {
        m->tol = tol;
        m->usual = (size_t)fmin(fmax(ceil(-log(tol) / 2 + 7), LEAST), USUAL);
        m->fine = s->ode->rest && tol < 16 * DBL_EPSILON;
        m->log2_tol = log2(m->fine ? tol / 4 : tol); /* a step errs less than an ulp */
        m->about[0].order = m->about[1].order = 0;
    }
}

/* The radius of convergence as the last coefficients show it, of which some may be small by chance,
   times what makes the last term that is kept as small as allowed, and a little less. */
static inline double phys_taylor_within(const struct phys_stepper *s, double log2_radius,
                                        size_t order)
{
    const double safety = 0.8;
    const double x = safety * exp2(log2_radius + memory_of(s)->log2_tol / (double)order);
    return x < DBL_MAX ? x : DBL_MAX;
}

static inline double phys_taylor_length(struct phys_stepper *s, const double *c)
{
    struct memory *m = memory_of(s);
    const size_t order = m->order;
    double radius = INFINITY; /* its logarithm */
    for (size_t k = order - LOOKS + 1; k <= order; k++) {
        double size = m->tol * (m->last = size_of(s, c, k));
        double x = -about_log2(size) / (double)k;
        radius = size > 0 && x < radius ? x : radius;
    }
    return phys_taylor_within(s, radius, order);
}

/* The last term; and the defect at the step's end, y' - f, where it is not rounding: there the
   series of this point knows nothing of what comes. */
static inline double phys_taylor_norm(struct phys_stepper *s,
                                      const struct phys_tolerance *tolerance, const double *slope,
                                      const double *rates)
{
    const double slack = 1e3, rounding = 1e3 * DBL_EPSILON;
    double most = memory_of(s)->last_term;
    for (size_t i = 0; i < s->n; i++) {
        double rate = s->h * rates[i], before = fabs(s->y[i]), after = fabs(s->next[i]);
        double y = before > after ? before : after, miss = fabs(slope[i] - rate);
        double allowed = slack * phys_allowed(tolerance, i, y) + rounding * (y + fabs(rate));
        if (!(miss <= most * allowed) && miss != 0) {
            most = miss / allowed;
            s->worst = i;
        }
    }
    return most;
}

#endif
