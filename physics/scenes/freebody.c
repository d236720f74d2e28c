/* A body thrown upwards under constant gravity. Its path of least action is a parabola. */
#include "scenes.h"

struct freebody {
    double m, g, x0, v0;
};

static const struct phys_param params[] = {
    {"m", "kg", "mass", 1, offsetof(struct freebody, m)},
    {"g", "m/s^2", "gravity, downwards", 1, offsetof(struct freebody, g)},
    {"x0", "m", "height at the start", 0, offsetof(struct freebody, x0)},
    {"v0", "m/s", "velocity at the start", 8, offsetof(struct freebody, v0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct freebody *s = p;
    (void)q, (void)t;
    return ad_mul(0.5 * s->m, ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct freebody *s = p;
    (void)v, (void)t;
    return ad_mul(s->m * s->g, q);
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct freebody *s = p;
    (void)seed, (void)error;
    q[0] = s->x0;
    v[0] = s->v0;
    return AD_OK;
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
    .kinetic = kinetic,
    .potential = potential,
    .slices = 60,
    .dt = 0.25,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
    .paper = &paper,
};
