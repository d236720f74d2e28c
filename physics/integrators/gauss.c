/* Gauss-Legendre methods of two to five stages. */
#include "stepper.h"

#define METHOD(s, ORDER)                                                                           \
    static const size_t stages_##s = s;                                                            \
    const struct phys_integrator phys_gauss##s = {                                                 \
        .name = "gauss" #s,                                                                        \
        .what = "Gauss-Legendre collocation, " #s " stages, implicit",                             \
        .order = ORDER,                                                                            \
        .symplectic = true,                                                                        \
        .symmetric = true,                                                                         \
        .scheme = &phys_collocation,                                                               \
        .coefficients = &stages_##s,                                                               \
    };

METHOD(2, 4)
METHOD(3, 6)
METHOD(4, 8)
METHOD(5, 10)
