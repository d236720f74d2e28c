/* A body that falls from rest into the centre of a 1/r attraction: the orbit of eccentricity 1,
   which ends after pi sqrt(r0^3 / (8 gm)). */
#include "scenes.h"

struct fall {
    double gm, r0;
};

static const struct phys_param params[] = {
    {"gm", "1", "gravitational constant times the central mass", 1, offsetof(struct fall, gm)},
    {"r0", "1", "distance at the start", 1, offsetof(struct fall, r0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)q, (void)t, (void)p;
    return ad_mul(0.5, ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct fall *s = p;
    (void)v, (void)t;
    return ad_div(-s->gm, ad_sqrt(ad_sum_rows(ad_square(q))));
}

static size_t dof_of(const void *p)
{
    const struct fall *s = p;
    return s->gm > 0 && s->r0 > 0 ? 2 : 0;
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct fall *s = p;
    (void)seed, (void)error;
    q[0] = s->r0;
    q[1] = v[0] = v[1] = 0;
    return AD_OK;
}

const struct phys_scene phys_scene_fall = {
    PHYS_SCENE_OF(struct fall),
    .name = "fall",
    .what = "a fall from rest into a centre of attraction",
    .dof_of = dof_of,
    .dims = 2,
    .coordinates = (const char *const[]){"x", "y"},
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.01,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
