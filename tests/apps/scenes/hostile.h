/* A well whose strings are macros defined by the including source. */
#include "autodiff/autodiff.h"
#include "physics/physics.h"

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.25;
    v[0] = 0.5;
    return AD_OK;
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_square(ad_row(v, 0)), ad_square(ad_row(q, 0))));
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = HOSTILE_NAME,
    .what = HOSTILE_WHAT,
    .dof = 1,
    .dims = 1,
    .unit = HOSTILE_UNIT,
    .time_unit = HOSTILE_TIME,
    .energy_unit = HOSTILE_ENERGY,
    .lagrangian = lagrangian,
    .slices = 12,
    .dt = 0.125,
    .start = start,
};
