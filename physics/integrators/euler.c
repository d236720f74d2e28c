/* Explicit Euler, for comparison only: an oscillator gains energy in every step. */
#include "stepper.h"

static const double b[] = {1}, c[] = {0};
static const struct phys_butcher table = {.stages = 1, .a = b, .b = b, .c = c};

const struct phys_integrator phys_euler = {
    .name = "euler",
    .what = "explicit Euler, for comparison",
    .order = 1,
    .scheme = &phys_runge_kutta,
    .coefficients = &table,
};
