/* Taylor steps of many motions at once, each of its own order and length: AD_SERIES_POINTS places
   for steppers of phys_taylor. The bits of each motion are those of its own stepper.

       phys_taylor_points_put(points, p, &stepper, tol);      a place is taken
       for (;;) {
           for each p with a motion: stepper.h = phys_taylor_points_longest(points, p, tol), or
               less; not the first time, when points->order[p] is 0
           phys_taylor_points_step(points, errors);           stepper->next
           for each p: phys_taylor_points_norm(points, p, tol), and accept[p] if it is small
           phys_taylor_points_accept(points, accept);
       } */
#ifndef PHYSICS_INTEGRATORS_TAYLOR_POINTS_H
#define PHYSICS_INTEGRATORS_TAYLOR_POINTS_H

#include "stepper.h"
#include "autodiff/series.h"

struct phys_taylor_points {
    ad_points *code;
    size_t n;
    struct phys_stepper *stepper[AD_SERIES_POINTS]; /* NULL: a free place */
    /* Of the series about the steps' starts, 0: there is none yet; and about their ends. */
    size_t order[AD_SERIES_POINTS], next_order[AD_SERIES_POINTS];
    double *memory, *start, *end; /* [PHYS_SERIES_MOST + 1][n] vectors */
    double *sum, *slope, *orders, *h, *work;
};

/* For motions of odes as the model, which must outlive this and whose series was evaluated. build:
   else only by code that was compiled before. NULL: there is no machine code for it. */
struct phys_taylor_points *phys_taylor_points_new(const struct phys_ode *model, bool build);
void phys_taylor_points_free(struct phys_taylor_points *points); /* takes NULL */
/* False if its ode differs from the model by more than parameters. */
bool phys_taylor_points_put(struct phys_taylor_points *points, size_t p, struct phys_stepper *s,
                            const struct phys_tolerance *tolerance);
double phys_taylor_points_longest(struct phys_taylor_points *points, size_t p,
                                  const struct phys_tolerance *tolerance);
/* Steps of stepper->h, and the series about their ends; from places whose order is 0 no step, but
   the series about where they are. errors: of each place. */
void phys_taylor_points_step(struct phys_taylor_points *points, struct ad_error *errors);
double phys_taylor_points_norm(struct phys_taylor_points *points, size_t p,
                               const struct phys_tolerance *tolerance);
/* Makes the series of the step available to phys_stepper_at. */
void phys_taylor_points_fetch(const struct phys_taylor_points *points, size_t p);
void phys_taylor_points_accept(struct phys_taylor_points *points, const bool *accepted);

#endif
