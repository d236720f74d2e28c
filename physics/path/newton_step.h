/* For path_newton.c only: one step of Newton's method. */
#ifndef PHYSICS_PATH_NEWTON_STEP_H
#define PHYSICS_PATH_NEWTON_STEP_H

#include "newton.h"

/* The Hessian at the path, on the tangent spaces of constraints if there are any. */
void phys_newton_differentiate(struct phys_newton *s);
bool phys_newton_at_rounding(struct phys_newton *s);
/* What damps every step: 0, but where solutions come in families. */
double phys_newton_least_damping(const struct phys_newton *s);
/* One step, damped or shortened as much as it needs. False, and the path where it was, if none
   helps. `slow` counts damped steps in a row that hardly reduce the gradient. */
bool phys_newton_improve(struct phys_newton *s, struct phys_path_step *at, size_t *slow);
/* Whether a step by the matrix of the last is a quarter as long at the most, where by Kantorovich's
   theorem Newton's method converges to the one path nearby (Deuflhard, Newton Methods for Nonlinear
   Problems, 2011, section 2.1). The path of the program stays. */
bool phys_newton_contracts(struct phys_newton *s);

#endif
