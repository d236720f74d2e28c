/* A body thrown upwards under constant gravity. Its path of least action is a parabola. */
#include "common.h"

struct freebody {
    struct phys_particle at;
    double g;
};

static const struct phys_param params[] = {
    {"m", "kg", "mass", 1, offsetof(struct freebody, at.m)},
    {"g", "m/s^2", "gravity, downwards", 1, offsetof(struct freebody, g)},
    {"x0", "m", "height at the start", 0, offsetof(struct freebody, at.start[0])},
    {"v0", "m/s", "velocity at the start", 8, offsetof(struct freebody, at.start[1])},
};

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct freebody *s = p;
    (void)v, (void)t;
    return ad_mul(ad_mul(PHYS_PARAM(s, at.m), PHYS_PARAM(s, g)), q);
}

static const struct phys_preset paper = {
    .slices = 60,
    .dt = 0.25,
    .steps = 500,
    .learning_rate = 1,
    .damping = 1,
    .euler_start = true,
    .noise = {.sigma = 1.5, .clip = 1, .around_zero = true},
};

const struct phys_scene phys_scene_freebody = {
    PHYS_SCENE_OF(struct freebody),
    .name = "freebody",
    .what = "a body in constant gravity",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"x"},
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .kinetic = phys_particle_kinetic,
    .potential = potential,
    .slices = 60,
    .dt = 0.25,
    .start = phys_start_1,
    .picture = PHYS_PICTURE_TIME,
    .paper = &paper,
};
