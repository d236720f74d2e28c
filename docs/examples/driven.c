/* A pendulum whose pivot oscillates vertically by a cos(w t), so that L depends on time. The
   inverted pendulum is stable for a w > sqrt(2 g l) (Kapitza 1951). */
#include <physics/physics.h>
#include <stddef.h>

struct driven {
    double m, l, g, a, w;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass", 1, offsetof(struct driven, m)},
    {"l", "m", "length", 1, offsetof(struct driven, l)},
    {"g", "m/s^2", "gravity", 9.81, offsetof(struct driven, g)},
    {"a", "m", "amplitude of the pivot", 0.1, offsetof(struct driven, a)},
    {"w", "rad/s", "frequency of the pivot", 60, offsetof(struct driven, w)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct driven *p = params;
    ad_var m = PHYS_PARAM(p, m), l = PHYS_PARAM(p, l), a = PHYS_PARAM(p, a);
    ad_var w = PHYS_PARAM(p, w), turn = ad_mul(w, t);
    ad_var rising = ad_mul(ad_mul(ad_neg(a), w), ad_sin(turn));
    ad_var across = ad_mul(l, v), along = ad_mul(across, ad_sin(q));
    ad_var T =
        ad_add(ad_square(across), ad_add(ad_mul(2.0, ad_mul(rising, along)), ad_square(rising)));
    ad_var height = ad_sub(ad_mul(a, ad_cos(turn)), ad_mul(l, ad_cos(q)));
    return ad_sub(ad_mul(ad_mul(0.5, m), T), ad_mul(ad_mul(m, PHYS_PARAM(p, g)), height));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 3.0415926535897931; /* 0.1 from the top */
    v[0] = 0;
    return AD_OK;
}

static const char *const coordinates[] = {"theta"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "driven",
    .what = "a pendulum on a shaken pivot",
    .dof = 1,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "rad",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct driven),
    .lagrangian = lagrangian,
    .slices = 400,
    .dt = 0.005,
    .start = start,
};
