/* A free particle in proper time, whose coordinates are t and x; it is the motion of the path, too.
 */
#include <physics/physics.h>

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_square(ad_row(v, 1)), ad_square(ad_row(v, 0))));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 3;
    q[1] = 0.5;
    v[0] = 1.25;
    v[1] = 0.75;
    return AD_OK;
}

static const char *const coordinates[] = {"t", "x"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "world_line",
    .what = "a free particle in proper time",
    .dof = 2,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "1",
    .time_unit = "1",
    .energy_unit = "1",
    .lagrangian = lagrangian,
    .slices = 11,
    .dt = 0.1,
    .start = start,
};
