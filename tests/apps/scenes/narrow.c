/* A free particle, a barrier of height `barrier` and width `s` at x0, and a kick of size `pulse`
   that lasts `w` at t0. With barrier 1 the start's energy 1/2 does not pass: it bounces. */
#include <physics/physics.h>

#include <stddef.h>

struct numbers {
    double barrier, x0, s, pulse, t0, w;
};

static const struct phys_param params[] = {
    {"barrier", "1", "height", 0, offsetof(struct numbers, barrier)},
    {"x0", "1", "place", 5, offsetof(struct numbers, x0)},
    {"s", "1", "width", 0.02, offsetof(struct numbers, s)},
    {"pulse", "1", "change of the velocity", 0, offsetof(struct numbers, pulse)},
    {"t0", "1", "when", 5, offsetof(struct numbers, t0)},
    {"w", "1", "how long", 0.01, offsetof(struct numbers, w)},
};

static ad_var bell(ad_var x, double centre, double width)
{
    return ad_exp(ad_mul(-0.5 / (width * width), ad_square(ad_sub(x, centre))));
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct numbers *n = p;
    ad_var free = ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(n->barrier, bell(q, n->x0, n->s)));
    ad_var kick = ad_mul(n->pulse / (n->w * 2.5066282746310002), bell(t, n->t0, n->w));
    return ad_add(free, ad_mul(q, kick));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v, struct ad_error *e)
{
    (void)p, (void)seed, (void)e;
    q[0] = 0;
    v[0] = 1;
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "narrow",
    .what = "a narrow barrier and a short pulse",
    .dof = 1,
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
