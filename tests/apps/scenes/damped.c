/* q'' = -k q - g q' by L = e^(g t) (v^2 - k q^2) / 2 (Caldirola, Kanai): a spring, with k < 0 a
   hillside, with friction. */
#include <physics/physics.h>

#include <stddef.h>

struct numbers {
    double k, g, q0, v0;
};

static const struct phys_param params[] = {
    {"k", "1", "stiffness", 1, offsetof(struct numbers, k)},
    {"g", "1", "friction", 0, offsetof(struct numbers, g)},
    {"q0", "1", "place at the start", 1, offsetof(struct numbers, q0)},
    {"v0", "1", "velocity at the start", 0, offsetof(struct numbers, v0)},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct numbers *n = p;
    ad_var L = ad_mul(0.5, ad_sub(ad_square(v), ad_mul(n->k, ad_square(q))));
    return n->g != 0 ? ad_mul(ad_exp(ad_mul(n->g, t)), L) : L;
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v, struct ad_error *e)
{
    const struct numbers *n = p;
    (void)seed, (void)e;
    q[0] = n->q0;
    v[0] = n->v0;
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "damped",
    .what = "a spring or a hillside, with friction",
    .dof = 1,
    .dims = 1,
    .unit = "1",
    .time_unit = "1",
    .energy_unit = "1",
    .params = params,
    .n_params = sizeof params / sizeof *params,
    .params_bytes = sizeof(struct numbers),
    .lagrangian = lagrangian,
    .slices = 100,
    .dt = 0.1,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
};
