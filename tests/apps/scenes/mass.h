/* A mass on a line, for the test scenes, each of which adds its Lagrangian. */
#include "autodiff/autodiff.h"
#include "physics/physics.h"

struct mass {
    double m;
};

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    q[0] = 0.25;
    v[0] = 0.5;
    return AD_OK;
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params);

static const struct phys_param mass_params[] = {
    {"m", "kg", "mass", 2, offsetof(struct mass, m)},
};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "mass",
    .what = "a mass on a line",
    .dof = 1,
    .dims = 1,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = mass_params,
    .n_params = 1,
    .params_bytes = sizeof(struct mass),
    .lagrangian = lagrangian,
    .slices = 12,
    .dt = 0.125,
    .start = start,
};

static inline ad_var kinetic(ad_var v, const struct mass *mass)
{
    return ad_mul(0.5 * mass->m, ad_square(ad_row(v, 0)));
}
