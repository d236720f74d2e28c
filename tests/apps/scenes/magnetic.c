/* A charge in a plane and in a magnetic field, whose potential depends on the velocity (F6). */
#include "physics/physics.h"

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    q[0] = 0.3;
    q[1] = -0.2;
    v[0] = 0.7;
    v[1] = 0.4;
    return AD_OK;
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q;
    (void)t;
    (void)params;
    return ad_mul(0.5, ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    (void)params;
    return ad_neg(ad_mul(ad_row(q, 0), ad_row(v, 1)));
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "magnetic",
    .what = "a charge in a magnetic field",
    .dof = 2,
    .dims = 2,
    .unit = "1",
    .time_unit = "1",
    .energy_unit = "1",
    .kinetic = kinetic,
    .potential = potential,
    .slices = 41,
    .dt = 0.05,
    .start = start,
};
