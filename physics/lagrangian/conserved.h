/* Quantities conserved by a Lagrangian (Noether's theorem): energy if L does not depend on time
   explicitly, momentum if it is invariant under translation of all bodies, angular momentum if
   under rotation.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_LAGRANGIAN_CONSERVED_H
#define PHYSICS_LAGRANGIAN_CONSERVED_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

/* True if L does not depend on time explicitly: the energy is constant, and a change of it is an
   error. False also where that cannot be decided, and for a term in t with a factor of 0; only
   want of memory and NULL are errors. */
bool phys_keeps_energy(const struct phys_system *system, struct ad_error *error);

struct phys_conserved {
    bool bodies;            /* bodies in the plane or in space; otherwise the rest is unset */
    bool momentum, angular; /* constant along any motion near these states */
    double momentum_change, angular_change; /* largest magnitude along the states */
};
/* Evaluates n states x [n][2 dof] (q, then v) of a motion at the times t. A total is constant if
   its rate, the sum of the forces or torques L_q, vanishes to rounding, both at the states and at
   points beside the motion: a system at rest in an external field does not count as free. */
enum ad_status phys_conserved(const struct phys_system *system, size_t n, const double *x,
                              const double *t, struct phys_conserved *conserved,
                              struct ad_error *error);

/* Cyclic coordinates: those that L does not depend on, by L_q = 0 exactly at n states x [n][2 dof]
   of a motion at the times t and beside them. Their momenta L_v are constant: value [dof] at the
   first state, change [dof] the largest from it. */
enum ad_status phys_cyclic(const struct phys_system *system, size_t n, const double *x,
                           const double *t, bool *cyclic, double *value, double *change,
                           struct ad_error *error);

/* The observables of a scene at n states x [n][2 dof] and the times t: value [n_observables][n]. */
enum ad_status phys_observe(const struct phys_system *system, size_t n, const double *x,
                            const double *t, double *value, struct ad_error *error);

AD_HEADER_END
#endif
