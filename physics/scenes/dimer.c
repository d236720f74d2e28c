/* Two bodies under a Lennard-Jones potential, V = 4 epsilon ((sigma/r)^12 - (sigma/r)^6), without a
   cap: the steep wall limits the step. */
#include "scenes.h"

struct dimer {
    double m, epsilon, sigma, r0;
};

static const struct phys_param params[] = {
    {"m", "1", "mass of each body", 1, offsetof(struct dimer, m)},
    {"epsilon", "1", "depth of the well", 1, offsetof(struct dimer, epsilon)},
    {"sigma", "1", "distance where V is 0", 1, offsetof(struct dimer, sigma)},
    {"r0", "1", "distance at the start, at rest", 1.13, offsetof(struct dimer, r0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct dimer *s = p;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(s, m)), ad_sum_rows(ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct dimer *s = p;
    (void)v, (void)t;
    ad_var sigma = PHYS_PARAM(s, sigma);
    ad_var u = ad_div(ad_mul(sigma, sigma), phys_pair_squares(q, 2, 2, 0));
    ad_var u3 = ad_mul(u, ad_square(u));
    return ad_mul(ad_mul(4, PHYS_PARAM(s, epsilon)), ad_sub(ad_square(u3), u3));
}

static size_t dof_of(const void *p)
{
    const struct dimer *s = p;
    return s->m > 0 && s->sigma > 0 && s->r0 > 0 ? 4 : 0;
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct dimer *s = p;
    (void)seed, (void)error;
    q[0] = 0.5 * s->r0;
    q[2] = -0.5 * s->r0;
    q[1] = q[3] = v[0] = v[1] = v[2] = v[3] = 0;
    return AD_OK;
}

const struct phys_scene phys_scene_dimer = {
    PHYS_SCENE_OF(struct dimer),
    .name = "dimer",
    .what = "two bodies under the law of Lennard-Jones",
    .dof_of = dof_of,
    .dims = 2,
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.02,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
