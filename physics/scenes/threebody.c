/* Three bodies in the plane under a softened 1/r attraction:
       V = -G sum over pairs of m_i m_j / (r + offset),  r = sqrt(d^2 + softening).
   The published code replaces 1/(r + offset) by a line at small distances, which changes the law
   and its gradient there; that is off unless cap_radius is set. */
#include "scenes.h"

#include <string.h>

enum { BODIES = 3, DIMS = 2 };

struct threebody {
    double m[BODIES], G, softening, offset;
    double cap_radius, cap_slope, cap_value;
};

static const struct phys_param params[] = {
    {"m1", "1", "mass", 1, offsetof(struct threebody, m[0])},
    {"m2", "1", "mass", 1, offsetof(struct threebody, m[1])},
    {"m3", "1", "mass", 1, offsetof(struct threebody, m[2])},
    {"G", "1", "strength of the attraction", 1.3e-4, offsetof(struct threebody, G)},
    {"softening", "1", "added to r^2", 1e-6, offsetof(struct threebody, softening)},
    {"offset", "1", "added to r", 1e-6, offsetof(struct threebody, offset)},
    {"cap_radius", "1", "below it 1/r becomes a line; 0: never", 0,
     offsetof(struct threebody, cap_radius)},
    {"cap_slope", "1", "slope of that line", 500, offsetof(struct threebody, cap_slope)},
    {"cap_value", "1", "its value at cap_radius", 20, offsetof(struct threebody, cap_value)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct threebody *s = p;
    double half[BODIES * DIMS];
    (void)q, (void)t;
    for (size_t k = 0; k < BODIES * DIMS; k++)
        half[k] = 0.5 * s->m[k / DIMS];
    return ad_sum_rows(ad_mul(ad_const(v.tape, BODIES * DIMS, 1, half), ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct threebody *s = p;
    const double strength[] = {s->G * s->m[0] * s->m[1], s->G * s->m[0] * s->m[2],
                               s->G * s->m[1] * s->m[2]};
    (void)v, (void)t;
    ad_var r = ad_sqrt(phys_pair_squares(q, BODIES, DIMS, s->softening));
    ad_var inverse = ad_recip(ad_add(r, s->offset));
    if (s->cap_radius > 0) {
        ad_var line = ad_add(ad_mul(s->cap_slope, ad_sub(s->cap_radius, r)), s->cap_value);
        inverse = ad_select(ad_lt(r, s->cap_radius), line, inverse);
    }
    return ad_neg(ad_sum_rows(ad_mul(ad_const(q.tape, LENGTH(strength), 1, strength), inverse)));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    static const double at[] = {0.4, 0.3, 0.4, 0.7, 0.7, 0.5};
    static const double velocity[] = {0.017, -0.006, -0.012, -0.012, 0.002, 0.017};
    (void)p, (void)seed, (void)error;
    memcpy(q, at, sizeof at);
    memcpy(v, velocity, sizeof velocity);
    return AD_OK;
}

static const struct phys_setting published[] = {{"cap_radius", 0.05}};

static const struct phys_preset paper = {
    .slices = 100,
    .dt = 0.5,
    .steps = 1000,
    .learning_rate = 2e-2,
    .damping = 1,
    .euler_start = true,
    .noise = {.sigma = 0.03, .clip = 1, .margin = 3, .scale = 0.8, .shift = 0.2},
    .set = published,
    .n_set = LENGTH(published),
};

const struct phys_scene phys_scene_threebody = {
    PHYS_SCENE_OF(struct threebody),
    .name = "threebody",
    .what = "three bodies that attract each other in the plane",
    .dof = BODIES * DIMS,
    .dims = DIMS,
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 100,
    .dt = 0.5,
    .start = start,
    .per_body = true,
    .picture = PHYS_PICTURE_PLANE,
    .paper = &paper,
};
