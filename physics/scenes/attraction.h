/* Point masses under 1/r attraction, without softening, and its relativistic correction. */
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

/* The part of the Lagrangian of point masses m [bodies] that goes with 1/c^2 (SI units), velocities
   about the common centre of mass [1 x n]:
       L_1 = sum_a m_a v_a^4 / 8
           + sum_{a<b} G m_a m_b / 2r (3 v_a^2 + 3 v_b^2 - 7 v_a.v_b - (v_a.n)(v_b.n))
           - 1/2 sum_a m_a U_a^2,  U_a = sum_{b != a} G m_b / r
   (Einstein, Infeld, Hoffmann; Landau and Lifshitz, The Classical Theory of Fields, section 106).
   q, v: [bodies*dims x n]. */
ad_var phys_post_newtonian(ad_var q, ad_var v, size_t bodies, size_t dims, ad_var m[], ad_var G);

#endif
