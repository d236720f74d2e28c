/* The method of Dormand and Prince of order 5 with an estimate of order 4; its last stage is the
   first of the next step. Dense output of order 4 (Hairer, Norsett, Wanner, Solving Ordinary
   Differential Equations I, 2nd edition, table II.5.2 and section II.6). */
#include "stepper.h"

/* clang-format off */
static const double a[] = {
    1.0 / 5,
    3.0 / 40, 9.0 / 40,
    44.0 / 45, -56.0 / 15, 32.0 / 9,
    19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729,
    9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656,
};
static const double b[] = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84};
static const double c[] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1};
static const double error[] = {
    71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40,
};
static const double dense[] = {
    -12715105075.0 / 11282082432, 0, 87487479700.0 / 32700410799, -10690763975.0 / 1880347072,
    701980252875.0 / 199316789632, -1453857185.0 / 822651844, 69997945.0 / 29380423,
};
/* clang-format on */

static const struct phys_butcher table = {
    .stages = 6, .a = a, .b = b, .c = c, .error = error, .n_dense = 1, .dense = dense};

const struct phys_integrator phys_dopri5 = {
    .name = "dopri5",
    .what = "Dormand-Prince 5(4), chooses its steps",
    .order = 5,
    .adaptive = true,
    .scheme = &phys_runge_kutta,
    .coefficients = &table,
};
