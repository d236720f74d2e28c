/* Accelerations of a Lagrangian, and the published paths that follow them on equal slices.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_LAGRANGIAN_EULER_LAGRANGE_H
#define PHYSICS_LAGRANGIAN_EULER_LAGRANGE_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

/* Accelerations of any Lagrangian from the tape: M(q,v) a = L_q - L_vq v - L_vt + Q - D_v,
   M = L_vv. */
typedef struct phys_motion phys_motion;
/* The system must outlive it. Errors of its callbacks are returned: AD_E_SHAPE, AD_E_MEMORY. */
enum ad_status phys_motion_new(const struct phys_system *system, phys_motion **motion,
                               struct ad_error *error);
void phys_motion_free(phys_motion *motion); /* takes NULL */
/* a [dof] at (q [dof], v [dof], t). AD_E_NONFINITE where it is not finite or M is singular, naming
   the coordinate. */
enum ad_status phys_motion_acceleration(phys_motion *motion, const double *q, const double *v,
                                        double t, double *a, struct ad_error *error);
/* Records them: q and v [dof x n], t [1 x n] or a scalar; column k of the result [dof x n] is of
   state k. One program for many states of up to 32 coordinates, or one state of more; parameters
   may be variables (phys_system_lagrangian_of). The tape has the errors; a state of singular M
   those of ad_solve. */
ad_var phys_record_accelerations(const struct phys_system *system, ad_var q, ad_var v, ad_var t);

/* Columns 0 and 1 of path [dof x slices] from q and v [dof] at t = 0. Column 1 is q + v dt as
   published (`euler`), or the motion at dt. */
enum ad_status phys_first_slices(phys_motion *motion, const double *q, const double *v,
                                 size_t slices, double dt, bool euler, double *path,
                                 struct ad_error *error);
/* The published ODE path: semi-implicit Euler, v += a dt; v *= damping; x += v dt, from the first
   two slices: path [dof x slices], columns 0 and 1 given, the rest written. */
enum ad_status phys_ode_path(phys_motion *motion, size_t slices, double dt, double damping,
                             double *path, struct ad_error *error);
AD_HEADER_END
#endif
