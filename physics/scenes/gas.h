/* Parameters and energy of the gas scene, for physics/gas/. */
#ifndef PHYSICS_SCENES_GAS_H
#define PHYSICS_SCENES_GAS_H

#include "physics/system/system.h"

enum { PHYS_GAS_DIMS = 2, PHYS_GAS_MOST = 20000 };

struct gas {
    double bodies, m, strength, sigma, softening;
    double cutoff, friction, walls;
    double spacing, jitter, speed, random_start, box;
    double clamp, cap_radius, cap_slope;
};

/* Energies of pairs from the squares of their distances, in the same shape. */
ad_var phys_gas_interaction(ad_var square, const struct gas *gas);
/* The energy of the bodies q [2 bodies x n] in the walls [1 x n]; only with walls. */
ad_var phys_gas_walls(ad_var q, const struct gas *gas);
/* Its motion: phys_ode_gas with PHYS_GAS_AUTO (gas/gas_motion.c). */
enum ad_status phys_gas_ode(const struct phys_system *system, struct phys_ode *ode,
                            struct ad_error *error);

#endif
