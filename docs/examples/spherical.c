/* A spherical pendulum in its angles, theta from the vertical and phi about it. phi is in no place
   of L, so that p_phi = m l^2 sin^2(theta) phi' is constant. */
#include <physics/physics.h>
#include <stddef.h>

struct spherical {
    double m, l, g, theta0, turn0;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass of the bob", 1, offsetof(struct spherical, m)},
    {"l", "m", "length of the rod", 1, offsetof(struct spherical, l)},
    {"g", "m/s^2", "gravity", 9.81, offsetof(struct spherical, g)},
    {"theta0", "rad", "angle at the start, 0 hangs down", 1, offsetof(struct spherical, theta0)},
    {"turn0", "rad/s", "rate of phi there", 2, offsetof(struct spherical, turn0)},
};

static ad_var momentum(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct spherical *p = params;
    (void)t;
    ad_var across = ad_square(ad_mul(PHYS_PARAM(p, l), ad_sin(ad_row(q, 0))));
    return ad_mul(PHYS_PARAM(p, m), ad_mul(across, ad_row(v, 1)));
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct spherical *p = params;
    ad_var swing = ad_square(ad_mul(PHYS_PARAM(p, l), ad_row(v, 0)));
    ad_var round = ad_mul(momentum(q, v, t, params), ad_row(v, 1));
    return ad_mul(0.5, ad_add(ad_mul(PHYS_PARAM(p, m), swing), round));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct spherical *p = params;
    (void)v, (void)t;
    ad_var weight = ad_mul(ad_mul(PHYS_PARAM(p, m), PHYS_PARAM(p, g)), PHYS_PARAM(p, l));
    return ad_neg(ad_mul(weight, ad_cos(ad_row(q, 0))));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct spherical *p = params;
    (void)seed, (void)error;
    q[0] = p->theta0;
    q[1] = v[0] = 0;
    v[1] = p->turn0;
    return AD_OK;
}

static const char *const coordinates[] = {"theta", "phi"};
static const struct phys_observable observables[] = {{"p_phi", "kg m^2/s", momentum}};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "spherical",
    .what = "a pendulum that swings to all sides",
    .dof = 2,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "rad",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct spherical),
    .kinetic = kinetic,
    .potential = potential,
    .observables = observables,
    .n_observables = 1,
    .slices = 500,
    .dt = 0.01,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
};
