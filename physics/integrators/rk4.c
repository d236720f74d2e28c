/* The classical Runge-Kutta method. */
#include "stepper.h"

static const double a[] = {0.5, 0, 0.5, 0, 0, 1};
static const double b[] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
static const double c[] = {0, 0.5, 0.5, 1};
static const struct phys_butcher table = {.stages = 4, .a = a, .b = b, .c = c};

const struct phys_integrator phys_rk4 = {
    .name = "rk4",
    .what = "classical Runge-Kutta",
    .order = 4,
    .scheme = &phys_runge_kutta,
    .coefficients = &table,
};
