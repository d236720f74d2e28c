/* For physics/path/ only: the solvers listed in solvers.def. */
#ifndef PHYSICS_PATH_INTERNAL_H
#define PHYSICS_PATH_INTERNAL_H

#include "autodiff/sized.h"
#include "path.h"
#include "physics/action/internal.h"

#define SOLVER(name) extern const struct phys_solver phys_solver_##name;
#include "solvers.def"
#undef SOLVER

/* AD_OWN of settings. Their ends are only looked at. */
#define PHYS_OWN_PATH(settings, error)                                                             \
    AD_OWN(phys_path_settings, settings, mesh, error);                                             \
    struct phys_ends settings##_ends;                                                              \
    if (settings->ends && !AD_TAKE(&settings##_ends, settings->ends, energy, error))               \
    return (error)->status

/* Whether a coordinate is free at an end. */
bool phys_free_ends(const struct phys_path_settings *settings);

/* Slices 2 on of a path [degree dof x slices], and inner nodes, from its first two slices by the
   discrete equations of the rule. */
enum ad_status phys_path_march(const struct phys_system *system,
                               const struct phys_path_settings *settings, double *path,
                               struct ad_error *error);

#endif
