/* A pendulum whose pivot goes up and down at twice its frequency, with friction, in units of that:
   theta'' + c theta' + (1 + p cos 2t) sin theta = 0. It hangs still for p < 2c, swings once in two
   periods of the pivot beyond, turns over, and doubles its period from there. */
#include <physics/physics.h>
#include <stddef.h>

struct shaken {
    double p, c;
};

static const struct phys_param parameters[] = {
    {"p", "", "strength of the shaking", 0.5, offsetof(struct shaken, p)},
    {"c", "", "friction", 0.2, offsetof(struct shaken, c)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct shaken *s = params;
    ad_var weight = ad_add(1.0, ad_mul(PHYS_PARAM(s, p), ad_cos(ad_mul(2.0, t))));
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(weight, ad_cos(q)));
}

static ad_var dissipation(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct shaken *s = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, c)), ad_square(v));
}

/* Rises through 0 once in each period of the pivot. */
static ad_var beat(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)v, (void)params;
    return ad_sin(ad_mul(2.0, t));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.3;
    v[0] = 0;
    return AD_OK;
}

static const char *const coordinates[] = {"theta"};
static const struct phys_observable observables[] = {{"beat", "", beat}};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "shaken",
    .what = "a pendulum on a shaken pivot, with friction",
    .dof = 1,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "rad",
    .time_unit = "",
    .energy_unit = "",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct shaken),
    .lagrangian = lagrangian,
    .dissipation = dissipation,
    .observables = observables,
    .n_observables = 1,
    .slices = 400,
    .dt = 0.1,
    .start = start,
};
