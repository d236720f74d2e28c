/* A bead on a hoop that rotates about its vertical diameter. The conserved quantity v L_v - L is
   not the energy, because the motor does work. Above w^2 = g/R the bead is at equilibrium at cos
   theta = g/(R w^2), about which it oscillates with frequency w sin theta. */
#include <physics/physics.h>
#include <math.h>
#include <stddef.h>

struct hoop {
    double m, R, w, g;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass", 1, offsetof(struct hoop, m)},
    {"R", "m", "radius", 1, offsetof(struct hoop, R)},
    {"w", "rad/s", "rate of turning", 5, offsetof(struct hoop, w)},
    {"g", "m/s^2", "gravity", 9.81, offsetof(struct hoop, g)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct hoop *p = params;
    (void)t;
    ad_var m = PHYS_PARAM(p, m), R = PHYS_PARAM(p, R), round = ad_mul(PHYS_PARAM(p, w), ad_sin(q));
    ad_var T = ad_mul(ad_mul(ad_mul(ad_mul(0.5, m), R), R), ad_add(ad_square(v), ad_square(round)));
    return ad_add(T, ad_mul(ad_mul(ad_mul(m, PHYS_PARAM(p, g)), R), ad_cos(q)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct hoop *p = params;
    (void)seed, (void)error;
    q[0] = acos(fmin(1, p->g / (p->R * p->w * p->w))) + 1e-4;
    v[0] = 0;
    return AD_OK;
}

static const char *const coordinates[] = {"theta"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "hoop",
    .what = "a bead on a turning hoop",
    .dof = 1,
    .dims = 1,
    .coordinates = coordinates,
    .unit = "rad",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct hoop),
    .lagrangian = lagrangian,
    .slices = 200,
    .dt = 0.02,
    .start = start,
};
