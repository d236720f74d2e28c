/* Solution of the stage equations of collocation, F_i = f(t + c_i h, y + h sum_j a_ij F_j). */
#ifndef PHYSICS_INTEGRATORS_STAGES_H
#define PHYSICS_INTEGRATORS_STAGES_H

#include "stepper.h"

enum { PHYS_STAGES_MOST = 5, PHYS_STAGES_ITERATIONS = 60 };

static const double phys_stages_rounding = 1e-10; /* a change that no longer shrinks below this */

struct phys_stages {
    size_t s;
    double c[PHYS_STAGES_MOST], b[PHYS_STAGES_MOST], a[PHYS_STAGES_MOST][PHYS_STAGES_MOST];
    double carry[PHYS_STAGES_MOST][PHYS_STAGES_MOST]; /* slopes of the last step, carried on */
    double last_h;                                    /* 0: no last step */
    double *F, *G, *point, *size; /* slopes [s][n] and the next ones; a point [n]; sizes [n] */
    /* Of Newton's method, NULL until needed: Jacobians of the stages [s][n x n], by columns; the
       matrix [s n x s n]; slopes of a shorter step [s][n]; a rate [n]. */
    double *memory, *J, *matrix, *shorter, *base;
    int *pivots; /* [s n] */
};

/* Values at x of the polynomials that are 1 at one of the points c and 0 at the others. */
void phys_stages_lagrange(size_t s, const double *c, double x, double *value);
/* to [n] = base + h sum_j w_j F_j. */
void phys_stages_combine(size_t n, size_t stages, const double *base, double h, const double *w,
                         const double *F, double *to);
/* G = f at the stages that F gives, less F. */
enum ad_status phys_stages_residual(struct phys_stepper *s, struct phys_stages *g, double h,
                                    struct ad_error *error);
/* F += G; the largest change h |G| in units of the components' sizes. */
double phys_stages_add(struct phys_stepper *s, struct phys_stages *g, double h);
/* A change that is nothing, or rounding. */
bool phys_stages_settled(double now, double last);
/* Newton's method. AD_E_ACCURACY where there are no such stages. */
enum ad_status phys_stages_newton(struct phys_stepper *s, struct phys_stages *g, double h,
                                  struct ad_error *error);

#endif
