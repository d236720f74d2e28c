/* A pendulum in x and y: a bob that a rod keeps at the distance l from the pivot, and free fall
   beside it. The rod is no part of L but a constraint, (x^2 + y^2 - l^2)/2l = 0; its force is the
   tension, m v^2/l - m g y/l towards the pivot. */
#include <math.h>
#include <physics/physics.h>
#include <stddef.h>

struct rod {
    double m, l, g, theta0, rate0;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass of the bob", 1, offsetof(struct rod, m)},
    {"l", "m", "length of the rod", 1, offsetof(struct rod, l)},
    {"g", "m/s^2", "gravity", 9.81, offsetof(struct rod, g)},
    {"theta0", "rad", "angle at the start, 0 hangs down", 1, offsetof(struct rod, theta0)},
    {"rate0", "rad/s", "its rate", 0, offsetof(struct rod, rate0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct rod *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)), ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct rod *p = params;
    (void)v, (void)t;
    return ad_mul(ad_mul(PHYS_PARAM(p, m), PHYS_PARAM(p, g)), ad_row(q, 1));
}

static ad_var constraint(ad_var q, ad_var t, const void *params)
{
    const struct rod *p = params;
    (void)t;
    ad_var l = PHYS_PARAM(p, l), off = ad_sub(ad_sum_rows(ad_square(q)), ad_square(l));
    return ad_div(off, ad_mul(2.0, l));
}

static ad_var angular_momentum(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct rod *p = params;
    (void)t;
    ad_var turn = ad_sub(ad_mul(ad_row(q, 0), ad_row(v, 1)), ad_mul(ad_row(q, 1), ad_row(v, 0)));
    return ad_mul(PHYS_PARAM(p, m), turn);
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct rod *p = params;
    (void)seed, (void)error;
    q[0] = p->l * sin(p->theta0);
    q[1] = -p->l * cos(p->theta0);
    v[0] = -q[1] * p->rate0;
    v[1] = q[0] * p->rate0;
    return AD_OK;
}

static const char *const coordinates[] = {"x", "y"};
static const char *const constraints[] = {"rod"};
static const struct phys_observable observables[] = {{"L_z", "kg m^2/s", angular_momentum}};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "rod",
    .what = "a pendulum in x and y, on a rod",
    .dof = 2,
    .dims = 2,
    .coordinates = coordinates,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct rod),
    .kinetic = kinetic,
    .potential = potential,
    .constraint = constraint,
    .constraints = constraints,
    .n_constraints = 1,
    .observables = observables,
    .n_observables = 1,
    .slices = 200,
    .dt = 0.01,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
