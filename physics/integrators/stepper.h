/* The state of a method on one problem, shared by the integrators and the driver. */
#ifndef PHYSICS_INTEGRATORS_STEPPER_H
#define PHYSICS_INTEGRATORS_STEPPER_H

#include "integrators.h"

#include <math.h>

struct phys_stepper {
    const struct phys_integrator *integrator;
    const struct phys_ode *ode;
    size_t n;
    double t, h;              /* the step goes from t to t + h */
    double end;               /* t + h on the clock, where the method knows its longest step */
    double *y, *next;         /* [n] at its ends */
    double *cut, *next_cut;   /* [n] what rounding cut off y and next: phys_stepper_sum */
    double *rate, *next_rate; /* f at its ends, where known */
    bool has_rate, has_next_rate;
    double *dense; /* polynomial of the step: [3 + extra][n]; see phys_stepper_at */
    size_t n_dense;
    double *work;                       /* the scheme's own */
    double *memory;                     /* all of the above */
    size_t evaluations, interpolations; /* of the field: for the method, and for its polynomial */
    size_t worst;                       /* component with the largest scaled error */
    void *state;                        /* of schemes that need more than numbers */
};

struct phys_scheme {
    bool constrains; /* keeps constraints by itself */
    bool uses_rate;  /* of the step's start: what the polynomial evaluates is not in vain */
    /* Doubles of work for a problem of length n; extra rows of the dense polynomial, or NULL. */
    size_t (*work)(const struct phys_integrator *integrator, size_t n);
    size_t (*extra)(const struct phys_integrator *integrator);
    enum ad_status (*begin)(struct phys_stepper *s, struct ad_error *error); /* or NULL */
    void (*end)(struct phys_stepper *s);                                     /* or NULL */
    /* The step that meets the tolerance, where the method knows it beforehand, or NULL. */
    enum ad_status (*longest)(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                              double *h, struct ad_error *error);
    /* next, at t + h; next_rate where it comes for free. */
    enum ad_status (*step)(struct phys_stepper *s, double h, struct ad_error *error);
    /* y at the end t of the last step, of a method whose steps do not give it in next: it costs as
       much as several of them. Else NULL. */
    enum ad_status (*observe)(struct phys_stepper *s, double t, double *y, struct ad_error *error);
    /* Error of the step just taken in units of what is allowed: under 1 is good. */
    enum ad_status (*error_norm)(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                 double *norm, struct ad_error *error);
    /* The extra rows of the dense polynomial. */
    enum ad_status (*dense)(struct phys_stepper *s, double *rows, struct ad_error *error);
    /* phys_stepper_at, of a method that has the motion within the step by itself, or NULL. */
    void (*at)(const struct phys_stepper *s, double theta, double *y);
};

enum ad_status phys_stepper_begin(struct phys_stepper *s, const struct phys_integrator *integrator,
                                  const struct phys_ode *ode, const double *y,
                                  struct ad_error *error);
void phys_stepper_end(struct phys_stepper *s);
/* One evaluation of the field, counted. */
enum ad_status phys_stepper_rate(struct phys_stepper *s, double t, const double *y, double *rate,
                                 struct ad_error *error);
/* f(t, y) of the step's start; f(t + h, next) of its end. */
enum ad_status phys_stepper_need_rate(struct phys_stepper *s, struct ad_error *error);
enum ad_status phys_stepper_need_next_rate(struct phys_stepper *s, struct ad_error *error);
/* next = y + increment + cut; *next_cut is what rounding cuts off it (Kahan). */
static inline void phys_add_with_cut(double y, double increment, double cut, double *next,
                                     double *next_cut)
{
    double sum = increment + cut, rounded = y + sum, added = rounded - y;
    *next = rounded;
    *next_cut = (y - (rounded - added)) + (sum - added);
}
/* next[k] = y[k] + increment; what is cut off goes into the next step. */
static inline void phys_stepper_sum(struct phys_stepper *s, size_t k, double increment)
{
    phys_add_with_cut(s->y[k], increment, s->cut[k], &s->next[k], &s->next_cut[k]);
}
/* The step becomes the past. */
void phys_stepper_accept(struct phys_stepper *s, double t);
/* Prepares the polynomial of the step taken; then y at t + theta h. */
enum ad_status phys_stepper_dense(struct phys_stepper *s, struct ad_error *error);
void phys_stepper_at(const struct phys_stepper *s, double theta, double *y);

/* Mean square of the errors e[n] of the step in units of what is allowed; s->worst is the largest.
 */
double phys_stepper_mean_square(struct phys_stepper *s, const struct phys_tolerance *tolerance,
                                const double *e);

/* What component k may err in a step. */
static inline double phys_allowed(const struct phys_tolerance *tolerance, size_t k, double y)
{
    return tolerance->atol * (tolerance->scale ? tolerance->scale[k] : 1) +
           tolerance->rtol * fabs(y);
}

/* ---- families and methods ---- */

extern const struct phys_scheme phys_constrained_splitting, phys_runge_kutta, phys_power_series,
    phys_splitting, phys_collocation;

/* Explicit Runge-Kutta method. Row i of `a` has i entries, packed. Weights of errors and of dense
   output run over the stages and then f(t + h, next); those of dense output then over the extra
   stages, whose rows of `a` follow. */
struct phys_butcher {
    size_t stages, extra;
    const double *a, *b, *c;
    const double *error;   /* NULL: none */
    const double *error_3; /* a second estimate of low order that damps the first, or NULL */
    size_t n_dense;
    const double *dense; /* [n_dense][stages + 1 + extra] */
};

/* Drifts and kicks in turn, drift first, in units of the step; a 0 is left out. */
struct phys_kicks {
    size_t n;
    const double *drift, *kick;
};

#define INTEGRATOR(name) extern const struct phys_integrator phys_##name;
#include "integrators.def"
#undef INTEGRATOR
extern const struct phys_integrator phys_extrapolation; /* of references alone: not in the table */

#endif
