/* Distances of paths whose coordinates have different units: one of 1e-9 beside one of 1 counts in
   the common unit, that of the largest, as if it were of its size. */
#ifndef PHYSICS_PATH_PATH_UNITS_H
#define PHYSICS_PATH_PATH_UNITS_H

#include "path.h"
#include "physics/action/hessian.h"

/* The coordinates' units as shares of the common one, [dof], by the masses along a path [s*dof x
   slices] and its size (physics/action/units.h); for the caller to free. `of` NULL: recorded for
   this. NULL: no memory. */
double *phys_path_units(const struct phys_system *system, const struct phys_path_settings *settings,
                        struct phys_derivatives *of, const double *path, struct ad_error *error);
/* The same by the masses of a Hessian that is filled at the path. */
double *phys_hessian_units(const struct phys_hessian *h, const double *path,
                           struct ad_error *error);
/* The largest difference of a coordinate at a slice of two paths, in the common unit, or NaN. */
double phys_path_apart(const double *unit, const double *a, const double *b, size_t dof,
                       size_t slices);
/* The largest distance of a slice's coordinate from the first slice's, in the common unit. */
double phys_path_extent(const double *unit, const double *path, size_t dof, size_t slices);

#endif
