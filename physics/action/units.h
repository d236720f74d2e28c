/* Units of coordinates, by their masses. */
#ifndef PHYSICS_ACTION_UNITS_H
#define PHYSICS_ACTION_UNITS_H

#include "physics/system/system.h"

enum { PHYS_UNITS_MOST = 64 }; /* coordinates */
#define PHYS_ANOTHER_UNIT 0.1  /* of the common size: what is less has a unit of its own */

/* Whether coordinates may have different units: not those of bodies, whose masses differ in one
   unit, nor those of a chain or a field. */
bool phys_may_differ_in_unit(const struct phys_system *system);
/* Coordinates of different units have different masses: sqrt(m_k) x_k are of one unit. unit [dof]:
   what a coordinate of the sizes x [dof] is by that, as a share of the largest; 1, the common unit,
   from a tenth on, and where a mass is not positive. */
void phys_units(size_t dof, const double *mass, const double *x, double *unit);

#endif
