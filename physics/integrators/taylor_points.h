/* Taylor steps of many motions at once, each of its own order and length: AD_SERIES_POINTS places
   for steppers of phys_taylor. The bits of each motion are those of its own stepper.

       phys_taylor_points_put(points, p, &stepper, tol);      a place is taken
       for (;;) {
           phys_taylor_points_look(points);
           for each p with a motion: stepper.h = phys_taylor_points_longest(points, p), or less; not
               the first time, when points->order[p] is 0
           phys_taylor_points_step(points, errors);
           for each p: points->at.norm[p], and accept[p] if it is small; stepper->next
           phys_taylor_points_accept(points, accept);
       }
       phys_taylor_points_take(points, p);                    its motion has ended */
#ifndef PHYSICS_INTEGRATORS_TAYLOR_POINTS_H
#define PHYSICS_INTEGRATORS_TAYLOR_POINTS_H

#include "stepper.h"
#include "autodiff/series.h"

struct phys_taylor_points {
    ad_points *code;
    struct phys_motion_series *model;
    size_t n;
    struct phys_stepper *stepper[AD_SERIES_POINTS]; /* NULL: a free place */
    const struct phys_tolerance *tolerance[AD_SERIES_POINTS];
    /* Of the series about the steps' starts, 0: there is none yet; and about their ends. */
    size_t order[AD_SERIES_POINTS], next_order[AD_SERIES_POINTS];
    struct ad_points_steps at; /* of vectors, a number of a place each */
    double *memory;            /* of them, and of: */
    double *zero, *within;     /* [n] vectors */
};

/* For motions of odes as the model, which must outlive this and whose series was evaluated. build:
   else only by code that was compiled before. NULL: there is no machine code for it. */
struct phys_taylor_points *phys_taylor_points_new(const struct phys_ode *model, bool build);
void phys_taylor_points_free(struct phys_taylor_points *points); /* takes NULL */
/* False if its ode differs from the model by more than parameters, or its rates are wanted to more
   digits than points have. The tolerance must live as long
   as the motion is there. */
bool phys_taylor_points_put(struct phys_taylor_points *points, size_t p, struct phys_stepper *s,
                            const struct phys_tolerance *tolerance);
/* When the sizes of its tolerance have changed. */
void phys_taylor_points_allow(struct phys_taylor_points *points, size_t p);
void phys_taylor_points_take(struct phys_taylor_points *points, size_t p);
/* Of the series about the starts: how long the steps may be. */
void phys_taylor_points_look(struct phys_taylor_points *points);
double phys_taylor_points_longest(const struct phys_taylor_points *points, size_t p);
/* Steps of stepper->h, their norms, and the series about their ends; from places whose order is 0
   no step, but the series about where they are. errors: of each place. */
void phys_taylor_points_step(struct phys_taylor_points *points, struct ad_error *errors);
/* Makes the series of the step available to phys_stepper_at. */
void phys_taylor_points_fetch(const struct phys_taylor_points *points, size_t p);
/* phys_stepper_at of all places at once, at fractions theta of the steps, [n] vectors that
   last until the next call. */
const double *phys_taylor_points_at(const struct phys_taylor_points *points, const double *theta);
void phys_taylor_points_accept(struct phys_taylor_points *points, const bool *accepted);

#endif
