/* Whether a finer grid has the same stationary path. */
#ifndef PHYSICS_PATH_CONFIRM_H
#define PHYSICS_PATH_CONFIRM_H

#include "physics/internal.h"

/* path [s*dof x slices] is stationary, with that Morse index. */
enum ad_status phys_path_confirm(const struct phys_system *system,
                                 const struct phys_path_settings *settings, const double *path,
                                 size_t index, bool *confirmed, struct ad_error *error);

#endif
