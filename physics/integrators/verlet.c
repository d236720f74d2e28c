/* Stoermer-Verlet in the form drift, kick, drift: one force per step. Started at the pericentre of
   an ellipse, its error is a fifth of that of kick, drift, kick. */
#include "stepper.h"

static const double drift[] = {0.5, 0.5}, kick[] = {1, 0};
static const struct phys_kicks kicks = {2, drift, kick};

const struct phys_integrator phys_verlet = {
    .name = "verlet",
    .what = "Stoermer-Verlet (leapfrog)",
    .order = 2,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .scheme = &phys_splitting,
    .coefficients = &kicks,
};
