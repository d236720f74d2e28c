/* Checks of a Lagrangian: finite values, gradients against differences, independence of slices.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_LAGRANGIAN_CHECK_H
#define PHYSICS_LAGRANGIAN_CHECK_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

/* The points of a check: n slices of coordinates, velocities and time. */
struct phys_points {
    size_t size; /* sizeof(struct phys_points) */
    size_t n;
    const double *q, *v; /* [dof x n] */
    const double *t;     /* [1 x n] */
};

/* Checks that L and its gradient are finite; AD_E_NONFINITE names the first operation that is not.
 */
enum ad_status phys_check_finite(const struct phys_system *system, const struct phys_points *at,
                                 struct ad_error *error);
/* For scenes with kinetic and potential energy: checks that V does not depend on v, that T - V is
   L, and that T + V is the energy v L_v - L, to 1e-9 of the larger. AD_E_ARGUMENT names the one
   that fails. */
enum ad_status phys_check_energies(const struct phys_system *system, const struct phys_points *at,
                                   struct ad_error *error);
/* The gradient of the sum of L over the slices (order 1), or its second derivatives (order 2),
   against differences; report->input is 0 for q, 1 for v, 2 for t, row and col are coordinate and
   slice. `entries` and `tolerance` are those of ad_check_gradient. AD_E_ARGUMENT for other orders.
 */
enum ad_status phys_check_gradient(const struct phys_system *system, const struct phys_points *at,
                                   int order, double tolerance, size_t entries,
                                   struct ad_check *report, struct ad_error *error);

/* Result of phys_check_locality: slice i of L must depend on slice i of q, v and t only. */
struct phys_locality {
    bool passed;
    size_t slice, moved; /* L at `slice` changed with slice `moved` ... */
    size_t row;          /* ... of q (row < dof), v (< 2 dof) or t (2 dof); SIZE_MAX: several */
};
/* Changes one slice after the other and compares L at the others bit by bit. Needs 2 slices. */
enum ad_status phys_check_locality(const struct phys_system *system, const struct phys_points *at,
                                   struct phys_locality *report, struct ad_error *error);
/* What kinks L has, in words, such as "a root of a square"; NULL: none, or over 64 coordinates.
   Derivatives and methods assume that L is smooth; differences far from a kink do not show it. */
const char *phys_check_kinks(const struct phys_system *system);
/* Whether the forces jump between neighbouring points, by evaluating them in between: a kink of L
   by any name, or a change over less than 1e-4 of the distance of two points. */
bool phys_check_jumps(const struct phys_system *system, const struct phys_points *at);

AD_HEADER_END
#endif
