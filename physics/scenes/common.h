/* Callbacks that several scenes share. Their parameters begin alike. */
#ifndef PHYSICS_SCENES_COMMON_H
#define PHYSICS_SCENES_COMMON_H

#include "scenes.h"

/* The start given by the first parameters: the coordinates, one to three, then their velocities. */
enum ad_status phys_start_1(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error);
enum ad_status phys_start_2(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error);
enum ad_status phys_start_3(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error);

/* A mass on a line; the first member of its scene's parameters. */
struct phys_particle {
    double start[2], m;
};
phys_lagrangian phys_particle_kinetic; /* m v^2 / 2 */

/* L in which the velocity is damped at the rate c: exp(c t) L (Caldirola and Kanai), from which
   p' = ... - c p. L itself where c is the constant 0. */
ad_var phys_damped(ad_var L, ad_var c, ad_var t);

/* A body around a fixed centre, per unit of its mass; the first parameter is gm. */
phys_lagrangian phys_centre_kinetic, phys_centre_potential; /* v^2 / 2, -gm / r */

#endif
