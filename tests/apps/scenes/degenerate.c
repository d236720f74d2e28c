/* Nearly singular masses: T = (v1 + v2)^2/2 + eps (v1 - v2)^2/2, V = eps (q1 - q2)^2/2. With
   d = q1 - q2, d'' = -d whatever eps > 0 is. */
#include <physics/physics.h>

#include <stddef.h>

struct numbers {
    double eps;
};

static const struct phys_param params[] = {
    {"eps", "1", "the small mass", 1e-3, offsetof(struct numbers, eps)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    double eps = ((const struct numbers *)p)->eps;
    ad_var sum = ad_add(ad_row(v, 0), ad_row(v, 1)), d = ad_sub(ad_row(v, 0), ad_row(v, 1));
    ad_var apart = ad_sub(ad_row(q, 0), ad_row(q, 1));
    (void)t;
    return ad_add(ad_mul(0.5, ad_square(sum)),
                  ad_mul(0.5 * eps, ad_sub(ad_square(d), ad_square(apart))));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v, struct ad_error *e)
{
    (void)p, (void)seed, (void)e;
    q[0] = 1;
    q[1] = 0;
    v[0] = 0.3;
    v[1] = 0.1;
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "degenerate",
    .what = "masses that are nearly singular",
    .dof = 2,
    .dims = 1,
    .unit = "1",
    .time_unit = "1",
    .energy_unit = "1",
    .params = params,
    .n_params = sizeof params / sizeof *params,
    .params_bytes = sizeof(struct numbers),
    .lagrangian = lagrangian,
    .slices = 101,
    .dt = 0.1,
    .start = start,
};
