/* Semi-implicit Euler as published: v += a dt, then x += v dt. Its positions are the stationary
   path of the action rule `left` for separable L. */
#include "stepper.h"

static const double drift[] = {0, 1}, kick[] = {1, 0};
static const struct phys_kicks kicks = {2, drift, kick};

const struct phys_integrator phys_semi_implicit = {
    .name = "semi-implicit",
    .what = "semi-implicit Euler, as published",
    .order = 1,
    .symplectic = true,
    .scheme = &phys_splitting,
    .coefficients = &kicks,
};
