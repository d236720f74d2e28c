/* Solution of the stage equations of collocation, F_i = f(t + c_i h, y + h sum_j a_ij F_j). */
#ifndef PHYSICS_INTEGRATORS_STAGES_H
#define PHYSICS_INTEGRATORS_STAGES_H

#include "physics/linear/lu.h"
#include "physics/linear/pattern.h"
#include "stepper.h"

enum { PHYS_STAGES_MOST = 5, PHYS_STAGES_ITERATIONS = 60 };

static const double phys_stages_rounding = 1e-10; /* a change that no longer shrinks below this */

struct phys_stages {
    size_t s;
    double c[PHYS_STAGES_MOST], b[PHYS_STAGES_MOST], a[PHYS_STAGES_MOST][PHYS_STAGES_MOST];
    double carry[PHYS_STAGES_MOST][PHYS_STAGES_MOST]; /* slopes of the last step, carried on */
    double last_h;                                    /* 0: no last step */
    double least;                 /* smaller sizes, 1e-100 of the largest, count as none */
    double *F, *G, *point, *size; /* slopes [s][n] and the next ones; a point [n]; sizes [n] */
    /* Of Newton's method, NULL until needed: J: differences of rates [s][parts][colours][n] over
       shifts [s][n]; slopes of a shorter step [s][n]; room [s][n] twice; a rate [n]. */
    double *memory, *J, *shift, *shorter, *moved, *right, *base;
    struct phys_pattern coupling;
    struct phys_lu matrix; /* [s n] */
};

/* Values at x of the polynomials that are 1 at one of the points c and 0 at the others. */
void phys_stages_lagrange(size_t s, const double *c, double x, double *value);
/* to [n] = base + h sum_j w_j F_j. */
void phys_stages_combine(size_t n, size_t stages, const double *base, double h, const double *w,
                         const double *F, double *to);
/* G = f at the stages that F gives, less F. */
enum ad_status phys_stages_residual(struct phys_stepper *s, struct phys_stages *g, double h,
                                    struct ad_error *error);
/* The size of component k so far, this step among it: a motion from rest at 0 has none before. */
double phys_stages_size(const struct phys_stepper *s, const struct phys_stages *g, double h,
                        size_t k);
/* F += G; the largest change h |G| in units of the components' sizes. */
double phys_stages_add(struct phys_stepper *s, struct phys_stages *g, double h);
/* A change that is nothing, or rounding. */
bool phys_stages_settled(double now, double last);
/* Newton's method. AD_E_ACCURACY where there are no such stages. */
enum ad_status phys_stages_newton(struct phys_stepper *s, struct phys_stages *g, double h,
                                  struct ad_error *error);
/* Its matrix (stages_matrix.c): room, once; factored at F, where sizes of components grow to what
   rounding of the others moves them by; G becomes the correction of F. */
enum ad_status phys_stages_matrix_new(struct phys_stepper *s, struct phys_stages *g,
                                      struct ad_error *error);
void phys_stages_matrix_free(struct phys_stages *g);
enum ad_status phys_stages_linearise(struct phys_stepper *s, struct phys_stages *g, double h,
                                     struct ad_error *error);
void phys_stages_correct(struct phys_stepper *s, struct phys_stages *g);

#endif
