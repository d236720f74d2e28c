/* A charge in the plane, in a uniform perpendicular magnetic field: L depends on the velocity, and
   on a gauge that does not affect the motion. It moves in circles of radius m v/(q B), with period
   2 pi m/(q B). */
#include <physics/physics.h>
#include <stddef.h>

struct magnetic {
    double m, charge, B, gauge;
};

static const struct phys_param parameters[] = {
    {"m", "kg", "mass", 1, offsetof(struct magnetic, m)},
    {"charge", "C", "charge", 1, offsetof(struct magnetic, charge)},
    {"B", "T", "field, out of the plane", 2, offsetof(struct magnetic, B)},
    {"gauge", "", "A = B (-gauge y, (1 - gauge) x)", 0.5, offsetof(struct magnetic, gauge)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct magnetic *p = params;
    (void)t;
    ad_var x_vy = ad_mul(ad_row(q, 0), ad_row(v, 1)), y_vx = ad_mul(ad_row(q, 1), ad_row(v, 0));
    ad_var gauge = PHYS_PARAM(p, gauge), strength = ad_mul(PHYS_PARAM(p, charge), PHYS_PARAM(p, B));
    ad_var A_v = ad_sub(ad_mul(ad_sub(1, gauge), x_vy), ad_mul(gauge, y_vx));
    ad_var T = ad_mul(ad_mul(0.5, PHYS_PARAM(p, m)), ad_sum_rows(ad_square(v)));
    return ad_add(T, ad_mul(strength, A_v));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1, q[1] = 0;
    v[0] = 0, v[1] = 1;
    return AD_OK;
}

static const char *const coordinates[] = {"x", "y"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "magnetic",
    .what = "a charge across a magnetic field",
    .dof = 2,
    .dims = 2,
    .coordinates = coordinates,
    .unit = "m",
    .time_unit = "s",
    .energy_unit = "J",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct magnetic),
    .lagrangian = lagrangian,
    .slices = 100,
    .dt = 0.02,
    .start = start,
};
