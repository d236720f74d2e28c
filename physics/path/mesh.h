/* Placement of the elements of a path by equidistribution (de Boor, Good approximation by splines
   with variable knots II, Lecture Notes in Mathematics 363, 1974). */
#ifndef PHYSICS_PATH_MESH_H
#define PHYSICS_PATH_MESH_H

#include "internal.h"

/* Mesh of `elements` elements, [elements + 1], with equal shares of the error of a path [s*dof x
   slices], of units [dof], on a grid; none is longer than twice the mean. *gain: how many times
   more elements the grid has than such ones with its largest error. mesh may be NULL. AD_E_MEMORY
   else. */
enum ad_status phys_mesh_place(const struct phys_grid *grid, const double *path, const double *unit,
                               size_t dof, size_t elements, double *mesh, double *gain,
                               struct ad_error *error);
/* The mesh of m slices that divides the elements of `from` evenly, for the caller to free. */
double *phys_mesh_divide(const double *from, size_t slices, size_t m, struct ad_error *error);

#endif
