/* Whether the motion has the same stationary path as the grid. */
#ifndef PHYSICS_PATH_VERIFY_GRID_INDEPENDENCE_H
#define PHYSICS_PATH_VERIFY_GRID_INDEPENDENCE_H

#include "physics/path/internal.h"

/* path [s*dof x slices] is stationary. */
enum ad_status phys_path_grid_independent(const struct phys_system *system,
                                          const struct phys_path_settings *settings,
                                          const double *path, bool *confirmed,
                                          struct ad_error *error);
/* Whether a motion between two neighbouring slices meets a singularity, as at a collision. */
enum ad_status phys_path_is_singular(const struct phys_system *system,
                                     const struct phys_path_settings *settings, const double *path,
                                     bool *singular, struct ad_error *error);

#endif
