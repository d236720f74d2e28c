/* Stoermer-Verlet in the form kick, drift, kick: positions and velocities at the same times, as in
   most programs of molecular dynamics. The force at the end of a step is that at the start of the
   next. */
#include "stepper.h"

static const double drift[] = {0, 1}, kick[] = {0.5, 0.5};
static const struct phys_kicks kicks = {2, drift, kick};

const struct phys_integrator phys_velocity_verlet = {
    .name = "velocity-verlet",
    .what = "Stoermer-Verlet, kick first",
    .order = 2,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .scheme = &phys_splitting,
    .coefficients = &kicks,
};
