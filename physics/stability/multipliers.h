/* For physics/stability/ only: the multipliers and the kind of a periodic motion, given x and its
   period; sizes [2 dof] of coordinates and velocities. */
#ifndef PHYSICS_STABILITY_MULTIPLIERS_H
#define PHYSICS_STABILITY_MULTIPLIERS_H

#include "periodic.h"

enum ad_status phys_multipliers(const struct phys_system *system, const double *size,
                                struct phys_periodic *found,
                                const struct phys_periodic_settings *settings,
                                struct ad_error *error);

#endif
