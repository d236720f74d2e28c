/* A double well, V = height ((x/a)^2 - 1)^2. A particle of less energy than the barrier stays in
   its well; a quantum particle tunnels. */
#include "scenes.h"

struct double_well {
    double m, a, height, x0, v0;
};

static const struct phys_param params[] = {
    {"m", "1", "mass", 1, offsetof(struct double_well, m)},
    {"a", "1", "distance of the wells from the middle", 1.5, offsetof(struct double_well, a)},
    {"height", "1", "of the barrier", 2, offsetof(struct double_well, height)},
    {"x0", "1", "place at the start", -1.5, offsetof(struct double_well, x0)},
    {"v0", "1", "velocity at the start", 1.5, offsetof(struct double_well, v0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct double_well *s = p;
    (void)q, (void)t;
    return ad_mul(0.5 * s->m, ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct double_well *s = p;
    (void)v, (void)t;
    return ad_mul(s->height, ad_square(ad_sub(ad_square(ad_mul(1 / s->a, q)), 1.0)));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct double_well *s = p;
    (void)seed, (void)error;
    q[0] = s->x0;
    v[0] = s->v0;
    return AD_OK;
}

const struct phys_scene phys_scene_double_well = {
    PHYS_SCENE_OF(struct double_well),
    .name = "double-well",
    .what = "two wells and the barrier between them",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"x"},
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.1,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
};
