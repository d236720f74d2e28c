/* For physics/path/ only: the solvers listed in solvers.def. */
#ifndef PHYSICS_PATH_INTERNAL_H
#define PHYSICS_PATH_INTERNAL_H

#include "path.h"
#include "physics/action/internal.h"

#define SOLVER(name) extern const struct phys_solver phys_solver_##name;
#include "solvers.def"
#undef SOLVER

/* Whether a coordinate is free at an end. */
bool phys_free_ends(const struct phys_path_settings *settings);

/* Slices 2 on of a path [degree dof x slices], and inner nodes, from its first two slices by the
   discrete equations of the rule. */
enum ad_status phys_path_march(const struct phys_system *system,
                               const struct phys_path_settings *settings, double *path,
                               struct ad_error *error);

#endif
