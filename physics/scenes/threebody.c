/* Three bodies in the plane under a softened 1/r attraction:
       V = -G sum over pairs of m_i m_j / (r + offset),  r = sqrt(d^2 + softening).
   The published code replaces 1/(r + offset) by a line at small distances, which changes the law
   and its gradient there; that is off unless cap_radius is set. */
#include "attraction.h"
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
    ad_var m[BODIES];
    (void)q, (void)t;
    for (size_t k = 0; k < BODIES; k++)
        m[k] = PHYS_PARAM(s, m[k]);
    return phys_attraction_kinetic(v, BODIES, DIMS, m);
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct threebody *s = p;
    ad_var Gm1 = ad_mul(PHYS_PARAM(s, G), PHYS_PARAM(s, m[0])), m2 = PHYS_PARAM(s, m[1]),
           m3 = PHYS_PARAM(s, m[2]);
    ad_var strength[] = {ad_mul(Gm1, m2), ad_mul(Gm1, m3),
                         ad_mul(ad_mul(PHYS_PARAM(s, G), m2), m3)};
    (void)v, (void)t;
    ad_var squares = phys_pair_squares(q, BODIES, DIMS, 0);
    ad_var r = ad_sqrt(ad_add(squares, PHYS_PARAM(s, softening)));
    ad_var inverse = ad_recip(ad_add(r, PHYS_PARAM(s, offset)));
    if (s->cap_radius > 0) {
        ad_var inside = ad_sub(PHYS_PARAM(s, cap_radius), r);
        ad_var line = ad_add(ad_mul(PHYS_PARAM(s, cap_slope), inside), PHYS_PARAM(s, cap_value));
        inverse = ad_select(ad_lt(r, PHYS_PARAM(s, cap_radius)), line, inverse);
    }
    return ad_neg(ad_sum_rows(ad_mul(phys_stacked(LENGTH(strength), strength), inverse)));
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
