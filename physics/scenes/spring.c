/* A mass on a spring. Its action is a minimum for less than half a period, a saddle beyond. */
#include "common.h"

struct spring {
    struct phys_particle at;
    double k, rest, damping;
};

static const struct phys_param params[] = {
    {"m", "kg", "mass", 1, offsetof(struct spring, at.m)},
    {"k", "N/m", "stiffness", 1, offsetof(struct spring, k)},
    {"q0", "m", "elongation at the start", 1, offsetof(struct spring, at.start[0])},
    {"v0", "m/s", "velocity at the start", 0, offsetof(struct spring, at.start[1])},
    {"rest", "m", "where no force acts", 0, offsetof(struct spring, rest)},
    {"damping", "1/s", "the velocity falls by this share in a unit of time", 0,
     offsetof(struct spring, damping)},
};

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct spring *s = p;
    (void)v, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, k)), ad_square(ad_sub(q, PHYS_PARAM(s, rest))));
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct spring *s = p;
    ad_var L = ad_sub(phys_particle_kinetic(q, v, t, p), potential(q, v, t, p));
    return phys_damped(L, PHYS_PARAM(s, damping), t);
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
    .lagrangian = lagrangian,
    .kinetic = phys_particle_kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.025,
    .start = phys_start_1,
    .picture = PHYS_PICTURE_TIME,
};
