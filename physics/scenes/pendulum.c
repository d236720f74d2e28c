/* A pendulum of any amplitude. Over a whole swing the true path is a saddle of the action. */
#include "common.h"

#include <math.h>

struct pendulum {
    double start[2], m, l, g, damping;
};

static const struct phys_param params[] = {
    {"m", "kg", "mass", 1, offsetof(struct pendulum, m)},
    {"l", "m", "length", 180, offsetof(struct pendulum, l)},
    {"g", "m/s^2", "gravity", 1, offsetof(struct pendulum, g)},
    {"theta0", "rad", "angle at the start, 0 hangs down", M_PI / 2,
     offsetof(struct pendulum, start[0])},
    {"rate0", "rad/s", "angular velocity at the start", 0, offsetof(struct pendulum, start[1])},
    {"damping", "1/s", "the angular velocity falls by this share in a unit of time", 0,
     offsetof(struct pendulum, damping)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct pendulum *s = p;
    (void)q, (void)t;
    ad_var l = PHYS_PARAM(s, l);
    return ad_mul(ad_mul(ad_mul(ad_mul(0.5, PHYS_PARAM(s, m)), l), l), ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct pendulum *s = p;
    (void)v, (void)t;
    ad_var weight = ad_mul(PHYS_PARAM(s, m), PHYS_PARAM(s, g));
    return ad_mul(ad_mul(weight, PHYS_PARAM(s, l)), ad_sub(1.0, ad_cos(q)));
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct pendulum *s = p;
    ad_var L = ad_sub(kinetic(q, v, t, p), potential(q, v, t, p));
    return phys_damped(L, PHYS_PARAM(s, damping), t);
}

static const struct phys_preset paper = {
    .slices = 100,
    .dt = 1,
    .steps = 500,
    .learning_rate = 5e-2,
    .energy_weight = 100,
    .damping = 1,
    .euler_start = true,
    .noise = {.sigma = 0.2, .clip = 1, .margin = 2, .scale = 0.7},
};

const struct phys_scene phys_scene_pendulum = {
    PHYS_SCENE_OF(struct pendulum),
    .name = "pendulum",
    .what = "a pendulum of any amplitude",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"theta"},
    .unit = "rad",
    .time_unit = "s",
    .energy_unit = "J",
    .lagrangian = lagrangian,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 1,
    .start = phys_start_1,
    .picture = PHYS_PICTURE_ANGLES,
    .paper = &paper,
};
