/* The Legendre transformation: momenta and energy of a Lagrangian.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_LAGRANGIAN_LEGENDRE_H
#define PHYSICS_LAGRANGIAN_LEGENDRE_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

typedef struct phys_legendre phys_legendre;
/* Momenta and energy of a system, which must outlive it. AD_E_SHAPE for a mistake of its callbacks.
 */
enum ad_status phys_legendre_new(const struct phys_system *system, phys_legendre **legendre,
                                 struct ad_error *error);
void phys_legendre_free(phys_legendre *legendre); /* takes NULL */
/* The energy v . L_v - L of any Lagrangian; q, v [dof]. */
double phys_legendre_energy(phys_legendre *legendre, const double *q, const double *v, double t);
/* p [dof] = L_v, and its rate, force [dof] = L_q + Q - D_v; either may be NULL. */
void phys_legendre_momentum(phys_legendre *legendre, const double *q, const double *v, double t,
                            double *p, double *force);
/* v [dof] that solves L_v(q, v, t) = p. AD_E_NONFINITE names the coordinate where there is no
   solution. */
enum ad_status phys_legendre_velocity(phys_legendre *legendre, const double *q, const double *p,
                                      double t, double *v, struct ad_error *error);

/* A lower bound of the condition number of the mass matrix L_vv at q, v [dof]; its decimal digits
   are lost from the accelerations. Beyond 1e12 L is refused as degenerate. */
double phys_legendre_condition(phys_legendre *legendre, const double *q, const double *v, double t);
/* How many eigenvalues of L_vv at q, v [dof] are negative: 0 where it is positive definite.
   SIZE_MAX where memory is exhausted, an argument is NULL, or L_vv is singular or not finite. */
size_t phys_legendre_negative(phys_legendre *legendre, const double *q, const double *v, double t);

/* Totals of a system of bodies; zero for scenes without bodies (not drawn in the plane). */
struct phys_totals {
    double energy;
    double momentum[3], angular[3], centre[3];
    double mass; /* 0: the scene has no bodies */
};
/* At q, v [dof]; angular momentum about the origin, from momenta L_v; centre of mass from the
 * masses L_vv. */
void phys_totals(phys_legendre *legendre, const double *q, const double *v, double t,
                 struct phys_totals *totals);

AD_HEADER_END
#endif
