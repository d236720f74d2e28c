/* A double well, V = height ((x/a)^2 - 1)^2. A particle of less energy than the barrier stays in
   its well; a quantum particle tunnels. */
#include "common.h"

struct double_well {
    struct phys_particle at;
    double a, height;
};

static const struct phys_param params[] = {
    {"m", "1", "mass", 1, offsetof(struct double_well, at.m)},
    {"a", "1", "distance of the wells from the middle", 1.5, offsetof(struct double_well, a)},
    {"height", "1", "of the barrier", 2, offsetof(struct double_well, height)},
    {"x0", "1", "place at the start", -1.5, offsetof(struct double_well, at.start[0])},
    {"v0", "1", "velocity at the start", 1.5, offsetof(struct double_well, at.start[1])},
};

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct double_well *s = p;
    (void)v, (void)t;
    ad_var scaled = ad_mul(ad_div(1, PHYS_PARAM(s, a)), q);
    return ad_mul(PHYS_PARAM(s, height), ad_square(ad_sub(ad_square(scaled), 1.0)));
}

const struct phys_scene phys_scene_double_well = {
    PHYS_SCENE_OF(struct double_well),
    .name = "double-well",
    .what = "two wells and the barrier between them",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"x"},
    PHYS_PURE_NUMBERS,
    .kinetic = phys_particle_kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.1,
    .start = phys_start_1,
    .picture = PHYS_PICTURE_TIME,
};
