/* A weight on a spring, free to swing. Without gravity, and started at rest, it stays on its ray
   and oscillates there: r = l + a cos(sqrt(k/m) t). */
#include <physics/physics.h>
#include <stddef.h>

struct elastic {
    double m, k, l, g;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass", 1, offsetof(struct elastic, m)},
    {"k", "N/m", "stiffness", 40, offsetof(struct elastic, k)},
    {"l", "m", "length at rest", 1, offsetof(struct elastic, l)},
    {"g", "m/s^2", "gravity", 9.81, offsetof(struct elastic, g)},
};

/* q, v: [2 x n], one column a time slice. Row 0 is the length, row 1 the angle from the vertical.
 */
static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct elastic *p = params;
    ad_var across = ad_mul(ad_row(q, 0), ad_row(v, 1));
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)),
                  ad_add(ad_square(ad_row(v, 0)), ad_square(across)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct elastic *p = params;
    ad_var r = ad_row(q, 0), height = ad_neg(ad_mul(r, ad_cos(ad_row(q, 1))));
    ad_var stretch = ad_sub(r, PHYS_PARAM(p, l)),
           weight = ad_mul(PHYS_PARAM(p, m), PHYS_PARAM(p, g));
    return ad_add(ad_mul(ad_mul(0.5, PHYS_PARAM(p, k)), ad_square(stretch)),
                  ad_mul(weight, height));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    q[0] = 1.2, q[1] = 0.5;
    v[0] = v[1] = 0;
    return AD_OK;
}

static const char *const coordinates[] = {"r", "theta"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "elastic",
    .what = "a pendulum on a spring",
    .dof = 2,
    .dims = 2,
    .coordinates = coordinates,
    .unit = "m, rad",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct elastic),
    .kinetic = kinetic,
    .potential = potential, /* or .lagrangian, where L does not split */
    .slices = 100,
    .dt = 0.01,
    .start = start,
};
