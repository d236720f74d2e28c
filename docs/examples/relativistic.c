/* A relativistic particle, pushed by a constant force: L = -m c^2 sqrt(1 - v^2/c^2) + F x, with a
   mass matrix that grows without bound as v nears c. From rest, with u = F t/(m c):
   x = (m c^2/F) (sqrt(1 + u^2) - 1). */
#include <physics/physics.h>
#include <stddef.h>

struct relativistic {
    double m, c, force;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass at rest", 1, offsetof(struct relativistic, m)},
    {"c", "m/s", "speed of light", 1, offsetof(struct relativistic, c)},
    {"force", "N", "force", 1, offsetof(struct relativistic, force)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct relativistic *p = params;
    (void)t;
    ad_var c = PHYS_PARAM(p, c), rest = ad_mul(ad_mul(PHYS_PARAM(p, m), c), c);
    ad_var slowing = ad_sqrt(ad_sub(1.0, ad_square(ad_mul(ad_div(1, c), v))));
    return ad_sub(ad_mul(PHYS_PARAM(p, force), q), ad_mul(rest, slowing));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = v[0] = 0;
    return AD_OK;
}

static const char *const coordinates[] = {"x"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "relativistic",
    .what = "a relativistic particle under a constant force",
    .dof = 1,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct relativistic),
    .lagrangian = lagrangian,
    .slices = 100,
    .dt = 0.05,
    .start = start,
};
