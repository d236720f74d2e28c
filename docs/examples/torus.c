/* Geodesics on a torus: L = v^2/2 in its metric, with a mass matrix that depends on position. The
   speed is constant, and so is (R + r cos w)^2 du/dt (Clairaut). */
#include <physics/physics.h>
#include <stddef.h>

struct torus {
    double R, r;
};

static const struct phys_param parameters[] = {
    {"R", "m", "from the axis to the middle of the tube", 2, offsetof(struct torus, R)},
    {"r", "m", "radius of the tube", 1, offsetof(struct torus, r)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct torus *p = params;
    (void)t;
    ad_var R = PHYS_PARAM(p, R), r = PHYS_PARAM(p, r);
    ad_var round = ad_mul(ad_add(R, ad_mul(r, ad_cos(ad_row(q, 1)))), ad_row(v, 0));
    ad_var tube = ad_mul(r, ad_row(v, 1));
    return ad_mul(0.5, ad_add(ad_square(round), ad_square(tube)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = q[1] = 0;
    v[0] = 0.25, v[1] = 0.7;
    return AD_OK;
}

static const char *const coordinates[] = {"u", "w"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "torus",
    .what = "a geodesic on a torus",
    .dof = 2,
    .dims = 2,
    .coordinates = coordinates,
    .unit = "rad",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct torus),
    .lagrangian = lagrangian,
    .slices = 100,
    .dt = 0.05,
    .start = start,
};
