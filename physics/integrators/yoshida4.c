/* Composition of order 4: Verlet steps of lengths w_i h that cancel the errors of lower order
   (Yoshida, Phys. Lett. A 150, 1990: the triple jump). Adjacent half drifts are merged. */
#include "stepper.h"

/* w1 = 1 / (2 - 2^(1/3)), w0 = 1 - 2 w1 */
#define W1 1.3512071919596576340476878089715
#define W0 (1 - 2 * W1)

static const double drift[] = {W1 / 2, (W1 + W0) / 2, (W0 + W1) / 2, W1 / 2};
static const double kick[] = {W1, W0, W1, 0};
static const struct phys_kicks kicks = {4, drift, kick};

const struct phys_integrator phys_yoshida4 = {
    .name = "yoshida4",
    .what = "Yoshida's composition of three Verlet steps",
    .order = 4,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .scheme = &phys_splitting,
    .coefficients = &kicks,
};
