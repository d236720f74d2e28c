/* For physics/modes/ only. */
#ifndef PHYSICS_MODES_INTERNAL_H
#define PHYSICS_MODES_INTERNAL_H

#include "modes.h"
#include "physics/lagrangian/curvature.h"

/* The modes at one->q, where `curvature` can be evaluated; `size` [dof] are sizes of coordinates,
   and off [dof] how far the place may be off, as shares of them. */
enum ad_status phys_modes_at(struct phys_curvature *curvature, const double *size,
                             const double *off, struct phys_equilibrium *one,
                             struct ad_error *error);

#endif
