/* Burrau's problem: masses 3, 4, 5 at rest at the corners of a 3-4-5 triangle, each opposite the
   side of its number. They pass close to each other many times until two of them leave as a pair
   (Szebehely, Peters, Astronomical Journal 72, 1967). */
#include "attraction.h"
#include "scenes.h"

#include <string.h>

enum { BODIES = 3, DIMS = 2 };

struct pythagorean {
    double m[BODIES], G;
};

static const struct phys_param params[] = {
    {"m1", "1", "mass", 3, offsetof(struct pythagorean, m[0])},
    {"m2", "1", "mass", 4, offsetof(struct pythagorean, m[1])},
    {"m3", "1", "mass", 5, offsetof(struct pythagorean, m[2])},
    {"G", "1", "strength of the attraction", 1, offsetof(struct pythagorean, G)},
};

static void masses(const struct pythagorean *s, ad_var m[BODIES])
{
    for (size_t k = 0; k < BODIES; k++)
        m[k] = PHYS_PARAM(s, m[k]);
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    ad_var m[BODIES];
    (void)q, (void)t;
    masses(p, m);
    return phys_attraction_kinetic(v, BODIES, DIMS, m);
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct pythagorean *s = p;
    ad_var m[BODIES];
    (void)v, (void)t;
    masses(s, m);
    return phys_attraction_potential(q, BODIES, DIMS, m, PHYS_PARAM(s, G));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    static const double at[BODIES * DIMS] = {1, 3, -2, -1, 1, -1};
    (void)p, (void)seed, (void)error;
    memcpy(q, at, sizeof at);
    memset(v, 0, sizeof at);
    return AD_OK;
}

const struct phys_scene phys_scene_pythagorean = {
    PHYS_SCENE_OF(struct pythagorean),
    .name = "pythagorean",
    .what = "three bodies from rest with near collisions",
    .dof = BODIES * DIMS,
    .dims = DIMS,
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 161,
    .dt = 0.1,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
