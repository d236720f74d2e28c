/* A mass on a spring. Its action is a minimum for less than half a period, a saddle beyond. */
#include "scenes.h"

struct spring {
    double m, k, q0, v0;
};

static const struct phys_param params[] = {
    {"m", "kg", "mass", 1, offsetof(struct spring, m)},
    {"k", "N/m", "stiffness", 1, offsetof(struct spring, k)},
    {"q0", "m", "elongation at the start", 1, offsetof(struct spring, q0)},
    {"v0", "m/s", "velocity at the start", 0, offsetof(struct spring, v0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct spring *s = p;
    (void)q, (void)t;
    return ad_mul(0.5 * s->m, ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct spring *s = p;
    (void)v, (void)t;
    return ad_mul(0.5 * s->k, ad_square(q));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct spring *s = p;
    (void)seed, (void)error;
    q[0] = s->q0;
    v[0] = s->v0;
    return AD_OK;
}

const struct phys_scene phys_scene_spring = {
    PHYS_SCENE_OF(struct spring),
    .name = "spring",
    .what = "a mass on a spring",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"q"},
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.025,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
};
