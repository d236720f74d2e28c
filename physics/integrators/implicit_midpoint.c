/* The implicit midpoint rule: the Gauss method of one stage. */
#include "stepper.h"

static const size_t stages = 1;

const struct phys_integrator phys_implicit_midpoint = {
    .name = "implicit-midpoint",
    .what = "implicit midpoint rule",
    .order = 2,
    .symplectic = true,
    .symmetric = true,
    .scheme = &phys_collocation,
    .coefficients = &stages,
};
