/* Relativistic corrections to Newton's law at first order (1/c^2). */
#ifndef PHYSICS_SCENES_POST_NEWTONIAN_H
#define PHYSICS_SCENES_POST_NEWTONIAN_H

#include "physics/system/system.h"

/* The part of the Lagrangian of point masses m [bodies] that goes with 1/c^2 (SI units), velocities
   about the common centre of mass [1 x n]:
       L_1 = sum_a m_a v_a^4 / 8
           + sum_{a<b} G m_a m_b / 2r (3 v_a^2 + 3 v_b^2 - 7 v_a.v_b - (v_a.n)(v_b.n))
           - 1/2 sum_a m_a U_a^2,  U_a = sum_{b != a} G m_b / r
   (Einstein, Infeld, Hoffmann; Landau and Lifshitz, The Classical Theory of Fields, section 106).
   q, v: [bodies*dims x n]. */
ad_var phys_post_newtonian(ad_var q, ad_var v, size_t bodies, size_t dims, ad_var m[], ad_var G);

#endif
