/* Stoermer-Verlet in the form kick, drift, kick: positions and velocities of the same times, as
   most programs of molecular dynamics have it. Each step asks for the force at both of its ends. */
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
