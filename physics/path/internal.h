/* For physics/path/ only: the solvers listed in solvers.def. */
#ifndef PHYSICS_PATH_INTERNAL_H
#define PHYSICS_PATH_INTERNAL_H

#include "path.h"
#include "physics/action/internal.h"

#define SOLVER(name) extern const struct phys_solver phys_solver_##name;
#include "solvers.def"
#undef SOLVER

#endif
