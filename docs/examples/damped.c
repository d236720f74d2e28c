/* Duffing's oscillator: a spring with a cubic part, Rayleigh's dissipation function D = c v^2/2 and
   a drive F cos(w t). The two forces are not in L. Without the cubic part (b = 0) the motion is
       exp(-c t/2m) (A cos(W t) + B sin(W t)) + the forced one. */
#include <physics/physics.h>
#include <stddef.h>

struct damped {
    double m, k, b, c, F, w, x0, v0;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass", 1, offsetof(struct damped, m)},
    {"k", "N/m", "stiffness", 4, offsetof(struct damped, k)},
    {"b", "N/m^3", "of the cubic part", 0, offsetof(struct damped, b)},
    {"c", "N s/m", "damping", 0.3, offsetof(struct damped, c)},
    {"F", "N", "of the drive", 0.5, offsetof(struct damped, F)},
    {"w", "rad/s", "of the drive", 1.5, offsetof(struct damped, w)},
    {"x0", "m", "elongation at the start", 1, offsetof(struct damped, x0)},
    {"v0", "m/s", "velocity at the start", 0, offsetof(struct damped, v0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)), ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)v, (void)t;
    ad_var square = ad_square(q), quarter = ad_mul(ad_mul(0.25, PHYS_PARAM(p, b)), square);
    return ad_mul(square, ad_add(ad_mul(0.5, PHYS_PARAM(p, k)), quarter));
}

static ad_var dissipation(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, c)), ad_square(v));
}

static ad_var forces(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)q, (void)v;
    return ad_mul(PHYS_PARAM(p, F), ad_cos(ad_mul(PHYS_PARAM(p, w), t)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct damped *p = params;
    (void)seed, (void)error;
    q[0] = p->x0;
    v[0] = p->v0;
    return AD_OK;
}

static const char *const coordinates[] = {"x"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "damped",
    .what = "a damped and driven spring (Duffing)",
    .dof = 1,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct damped),
    .kinetic = kinetic,
    .potential = potential,
    .dissipation = dissipation,
    .forces = forces,
    .slices = 400,
    .dt = 0.05,
    .start = start,
};
