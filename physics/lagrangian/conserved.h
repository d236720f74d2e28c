/* What a Lagrangian keeps constant: energy where it does not depend on time itself, momentum where
   moving all bodies together does not change it, angular momentum where turning them does not
   (Noether's theorem). */
#ifndef PHYSICS_CONSERVED_H
#define PHYSICS_CONSERVED_H

#include "physics/system/system.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* L does not depend on time itself: its energy is constant, and a change of it is an error. False
   where that cannot be found out, and for a term in t that has a factor of 0. */
bool phys_keeps_energy(const struct phys_system *system);

struct phys_conserved {
    bool bodies;                            /* in the plane or in space; else the rest is not set */
    bool momentum, angular;                 /* constant along any motion near these states */
    double momentum_change, angular_change; /* largest along the states, absolute */
};
/* At n states x [n][2 dof] (q, then v) of a motion at the times t. A total is constant where its
   rate, the sum of the forces or torques L_q, is zero but for rounding: there, and at places beside
   the motion, so that one at rest in an outer field is not taken for free. */
enum ad_status phys_conserved(const struct phys_system *system, size_t n, const double *x,
                              const double *t, struct phys_conserved *conserved,
                              struct ad_error *error);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
