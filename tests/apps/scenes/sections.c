/* Two oscillators of frequencies a and b from the surface x = 0, and c (x^2 y - y^3 / 3): Henon and
   Heiles with a = b = c = 1. */
#include "physics/physics.h"

#include <stddef.h>

struct sections {
    double a, b, c, y0, vx0, vy0;
};

static const struct phys_param parameters[] = {
    {"a", NULL, "frequency of x", 1, offsetof(struct sections, a)},
    {"b", NULL, "frequency of y", 1, offsetof(struct sections, b)},
    {"c", NULL, "strength of the cubic terms", 0, offsetof(struct sections, c)},
    {"y0", NULL, "start", 1, offsetof(struct sections, y0)},
    {"vx0", NULL, "start", 1, offsetof(struct sections, vx0)},
    {"vy0", NULL, "start", 0, offsetof(struct sections, vy0)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct sections *p = params;
    (void)t;
    ad_var a = PHYS_PARAM(p, a), b = PHYS_PARAM(p, b), c = PHYS_PARAM(p, c);
    ad_var x = ad_row(q, 0), y = ad_row(q, 1);
    ad_var kinetic = ad_add(ad_square(ad_row(v, 0)), ad_square(ad_row(v, 1)));
    ad_var springs = ad_add(ad_square(ad_mul(a, x)), ad_square(ad_mul(b, y)));
    ad_var cubic = ad_mul(y, ad_sub(ad_square(x), ad_div(ad_square(y), 3.0)));
    return ad_sub(ad_mul(0.5, ad_sub(kinetic, springs)), ad_mul(c, cubic));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct sections *p = params;
    (void)seed, (void)error;
    q[0] = 0, q[1] = p->y0;
    v[0] = p->vx0, v[1] = p->vy0;
    return AD_OK;
}

static const char *const coordinates[] = {"x", "y"};

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "sections",
    .what = "two oscillators, coupled or not",
    .dof = 2,
    .dims = 2,
    .coordinates = coordinates,
    .unit = "",
    .time_unit = "",
    .energy_unit = "",
    .params = parameters,
    .n_params = sizeof parameters / sizeof *parameters,
    .params_bytes = sizeof(struct sections),
    .lagrangian = lagrangian,
    .slices = 100,
    .dt = 0.1,
    .start = start,
};
