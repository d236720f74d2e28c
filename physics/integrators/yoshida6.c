/* Composition of order 6: Verlet steps of lengths w_i h that cancel the errors of lower order
   (Yoshida, Phys. Lett. A 150, 1990, solution A). Adjacent half drifts are merged. */
#include "stepper.h"

#define W1 (-1.17767998417887100694641568096431573)
#define W2 0.235573213359358133684793182978534602
#define W3 0.784513610477557263819497633866349876
#define W0 (1 - 2 * (W1 + W2 + W3))

static const double drift[] = {W3 / 2,        (W3 + W2) / 2, (W2 + W1) / 2, (W1 + W0) / 2,
                               (W0 + W1) / 2, (W1 + W2) / 2, (W2 + W3) / 2, W3 / 2};
static const double kick[] = {W3, W2, W1, W0, W1, W2, W3, 0};
static const struct phys_kicks kicks = {8, drift, kick};

const struct phys_integrator phys_yoshida6 = {
    .name = "yoshida6",
    .what = "Yoshida's composition of seven Verlet steps",
    .order = 6,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .scheme = &phys_splitting,
    .coefficients = &kicks,
};
