/* The variational integrator of an action rule: solves its discrete equations element by element,
   in position-momentum form (Marsden, West, Acta Numerica 2001, section 1.5). With the action S of
   one element as a function of its nodes X_0 ... X_s,
       p = -dS/dX_0,   0 = dS/dX_k (0 < k < s),   p' = dS/dX_s
   give the nodes and the final momentum p' from position and momentum at the start. */
#ifndef PHYSICS_ACTION_VARIATIONAL_STEP_H
#define PHYSICS_ACTION_VARIATIONAL_STEP_H

#include "hessian.h"

typedef struct phys_variational_step phys_variational_step;

/* For elements of length dt. The system must live longer. */
enum ad_status phys_variational_step_new(const struct phys_system *system,
                                         const struct phys_rule *rule, double dt,
                                         phys_variational_step **stepper, struct ad_error *error);
void phys_variational_step_free(phys_variational_step *stepper);

/* Momentum p [dof] at the end of the element from q0 to q1 [dof] that begins at t. */
enum ad_status phys_variational_step_start(phys_variational_step *stepper, double t,
                                           const double *q0, const double *q1, double *p,
                                           struct ad_error *error);
/* Sets the length of the elements from here on, and a guess of the next velocity [dof]. */
void phys_variational_step_go(phys_variational_step *stepper, double dt, const double *velocity);
/* Solves one element: q, p [dof] at t become those at t + dt; the first guess is the velocity of
   the last element. AD_E_NONFINITE where the equations have no solution near it, naming the
   coordinate. */
enum ad_status phys_variational_step_next(phys_variational_step *stepper, double t, double *q,
                                          double *p, struct ad_error *error);
/* The last element solved: [degree*dof x 2], laid out as a path of two slices. */
const double *phys_variational_step_element(const phys_variational_step *stepper);
/* Number of element gradients evaluated so far. */
size_t phys_variational_step_evaluations(const phys_variational_step *stepper);

#endif
