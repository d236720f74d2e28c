/* Checks of a user's Lagrangian: finite, gradients against differences, slice by slice. */
#ifndef PHYSICS_CHECK_H
#define PHYSICS_CHECK_H

#include "physics/system/system.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* Where a Lagrangian is looked at: n slices of coordinates, velocities and time. */
struct phys_points {
    size_t n;
    const double *q, *v; /* [dof x n] */
    const double *t;     /* [1 x n] */
};

/* L and its gradient are finite there; AD_E_NONFINITE names the first operation that is not. */
enum ad_status phys_check_finite(const struct phys_system *system, const struct phys_points *at,
                                 struct ad_error *error);
/* Where the scene has kinetic and potential energy: V does not depend on v, T - V is L, and T + V
   is the energy v L_v - L, to 1e-9 of the larger. AD_E_ARGUMENT says which is not so. */
enum ad_status phys_check_energies(const struct phys_system *system, const struct phys_points *at,
                                   struct ad_error *error);
/* The gradient of the sum of L over the slices (order 1), or its second derivatives (order 2),
   against differences; report->input is 0 for q, 1 for v, 2 for t, row and col are coordinate and
   slice. `entries` and `tolerance` are those of ad_check_gradient. AD_E_ARGUMENT for other orders.
 */
enum ad_status phys_check_gradient(const struct phys_system *system, const struct phys_points *at,
                                   int order, double tolerance, size_t entries,
                                   struct ad_check *report, struct ad_error *error);

/* Whether slice i of L depends on slice i of q, v and t alone. */
struct phys_locality {
    bool passed;
    size_t slice, moved; /* L of `slice` reacts to slice `moved` ... */
    size_t row;          /* ... of q (row < dof), v (< 2 dof) or t (2 dof); SIZE_MAX: several */
};
/* Moves one slice after the other and compares the bits of L at the rest: at 2 slices or more. */
enum ad_status phys_check_locality(const struct phys_system *system, const struct phys_points *at,
                                   struct phys_locality *report, struct ad_error *error);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
