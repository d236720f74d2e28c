/* For physics/ only: further properties of a Lagrangian. */
#ifndef PHYSICS_LAGRANGIAN_INTERNAL_H
#define PHYSICS_LAGRANGIAN_INTERNAL_H

#include "check.h"
#include "conserved.h"
#include "euler_lagrange.h"
#include "legendre.h"
#include "physics/system/internal.h"

/* The system that a motion was made of. */
const struct phys_system *phys_motion_system(const phys_motion *motion);
/* The masses are constant and the accelerations depend on q and t alone. */
bool phys_motion_separates(phys_motion *motion);
/* Why its forces are interpreted (ad_native_note). */
const char *phys_motion_interpreted(const phys_motion *motion);
/* L_vv [dof x dof] at q, v [dof x 1] and t. */
ad_var phys_record_mass(const struct phys_system *system, ad_var q, ad_var v, ad_var t);

/* Whether y depends on none of x[0..n-1], whatever their values: its derivatives, looked at through
   fixed irregular weights, fold to zero when compiled. False where that cannot be found out. */
bool phys_is_independent(ad_tape *tape, ad_var y, size_t n, const ad_var x[]);

#endif
