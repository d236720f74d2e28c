/* Point masses under 1/r attraction, without softening. */
#ifndef PHYSICS_SCENES_ATTRACTION_H
#define PHYSICS_SCENES_ATTRACTION_H

#include "physics/system/system.h"

/* n scalars or rows [1 x columns] as a column [n x 1] or rows of one width. */
ad_var phys_stacked(size_t n, ad_var values[]);

/* Sum of m_b v_b^2 / 2 over bodies [1 x n]. v: [bodies*dims x n]. */
ad_var phys_attraction_kinetic(ad_var v, size_t bodies, size_t dims, const ad_var m[]);
/* -G sum over pairs of m_i m_j / r [1 x n]. */
ad_var phys_attraction_potential(ad_var q, size_t bodies, size_t dims, const ad_var m[], ad_var G);

/* L [1 x n] of a body near two on circles about each other, at x = -mu and 1 - mu in the frame that
   turns with them, in the plane or in space: terms linear in the velocity,
       L = ((x' - y)^2 + (y' + x)^2 + z'^2) / 2 + (1 - mu)/r1 + mu/r2. */
ad_var phys_turning_frame(ad_var q, ad_var v, ad_var mu);

#endif
