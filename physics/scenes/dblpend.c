/* The double pendulum, chaotic at this energy. Angles are from the vertical. */
#include "common.h"

#include <math.h>

struct double_pendulum {
    double start[4], m1, m2, l1, l2, g;
};

static const struct phys_param params[] = {
    {"m1", "kg", "mass of the upper bob", 1, offsetof(struct double_pendulum, m1)},
    {"m2", "kg", "mass of the lower bob", 1, offsetof(struct double_pendulum, m2)},
    {"l1", "m", "length of the upper rod", 1, offsetof(struct double_pendulum, l1)},
    {"l2", "m", "length of the lower rod", 1, offsetof(struct double_pendulum, l2)},
    {"g", "m/s^2", "gravity", 1, offsetof(struct double_pendulum, g)},
    {"a0", "rad", "upper angle at the start", 3 * M_PI / 7,
     offsetof(struct double_pendulum, start[0])},
    {"b0", "rad", "lower angle at the start", 3 * M_PI / 4,
     offsetof(struct double_pendulum, start[1])},
    {"a_rate0", "rad/s", "its angular velocity", 0, offsetof(struct double_pendulum, start[2])},
    {"b_rate0", "rad/s", "its angular velocity", 0, offsetof(struct double_pendulum, start[3])},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params_)
{
    const struct double_pendulum *p = params_;
    (void)t;
    ad_var a = ad_row(q, 0), b = ad_row(q, 1), va = ad_row(v, 0), vb = ad_row(v, 1);
    ad_var m2 = PHYS_PARAM(p, m2), l1 = PHYS_PARAM(p, l1), l2 = PHYS_PARAM(p, l2);
    ad_var both = ad_add(PHYS_PARAM(p, m1), m2);
    /* cos(a - b), of the sines and cosines that potential and forces want, too */
    ad_var cosine = ad_add(ad_mul(ad_cos(a), ad_cos(b)), ad_mul(ad_sin(a), ad_sin(b)));
    ad_var cross = ad_mul(ad_mul(va, vb), cosine);
    ad_var upper = ad_mul(ad_mul(ad_mul(ad_mul(0.5, both), l1), l1), ad_square(va));
    ad_var lower = ad_mul(ad_mul(ad_mul(ad_mul(0.5, m2), l2), l2), ad_square(vb));
    return ad_add(upper, ad_add(lower, ad_mul(ad_mul(ad_mul(m2, l1), l2), cross)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params_)
{
    const struct double_pendulum *p = params_;
    (void)v, (void)t;
    ad_var a = ad_row(q, 0), b = ad_row(q, 1);
    ad_var m2 = PHYS_PARAM(p, m2), g = PHYS_PARAM(p, g), both = ad_add(PHYS_PARAM(p, m1), m2);
    ad_var upper = ad_mul(ad_mul(ad_mul(both, g), PHYS_PARAM(p, l1)), ad_cos(a));
    ad_var lower = ad_mul(ad_mul(ad_mul(m2, g), PHYS_PARAM(p, l2)), ad_cos(b));
    return ad_neg(ad_add(upper, lower));
}

static const struct phys_preset paper = {
    .slices = 200,
    .dt = 0.06,
    .steps = 500,
    .learning_rate = 1e-2,
    .damping = 1,
    .euler_start = true,
    .noise = {.sigma = 0.6, .clip = 1},
};

const struct phys_scene phys_scene_dblpend = {
    PHYS_SCENE_OF(struct double_pendulum),
    .name = "dblpend",
    .what = "a double pendulum",
    .dof = 2,
    .dims = 2,
    .coordinates = (const char *const[]){"a", "b"},
    .unit = "rad",
    .time_unit = "s",
    .energy_unit = "J",
    .kinetic = kinetic,
    .potential = potential,
    .slices = 200,
    .dt = 0.06,
    .start = phys_start_2,
    .picture = PHYS_PICTURE_ANGLES,
    .paper = &paper,
};
