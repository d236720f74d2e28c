/* A mass on a spring. Its action is a minimum for less than half a period, a saddle beyond. */
#include "common.h"

struct spring {
    struct phys_particle at;
    double k;
};

static const struct phys_param params[] = {
    {"m", "kg", "mass", 1, offsetof(struct spring, at.m)},
    {"k", "N/m", "stiffness", 1, offsetof(struct spring, k)},
    {"q0", "m", "elongation at the start", 1, offsetof(struct spring, at.start[0])},
    {"v0", "m/s", "velocity at the start", 0, offsetof(struct spring, at.start[1])},
};

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct spring *s = p;
    (void)v, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, k)), ad_square(q));
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
    .kinetic = phys_particle_kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.025,
    .start = phys_start_1,
    .picture = PHYS_PICTURE_TIME,
};
