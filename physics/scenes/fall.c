/* A body that falls from rest into the centre of a 1/r attraction: the orbit of eccentricity 1,
   which ends after pi sqrt(r0^3 / (8 gm)). */
#include "common.h"

struct fall {
    double gm, r0;
};

static const struct phys_param params[] = {
    {"gm", "1", "gravitational constant times the central mass", 1, offsetof(struct fall, gm)},
    {"r0", "1", "distance at the start", 1, offsetof(struct fall, r0)},
};

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
    .kinetic = phys_centre_kinetic,
    .potential = phys_centre_potential,
    .slices = 101,
    .dt = 0.01,
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
