/* One body around a fixed centre, from pericentre; energies are per unit of mass. With e = 0.6 and
   a = GM = 1 the energy is -1/2, the angular momentum 0.8, the action of a period 3 pi. */
#include "common.h"

#include <math.h>

struct kepler {
    double gm, a, e;
};

static const struct phys_param params[] = {
    {"gm", "1", "gravitational constant times the central mass", 1, offsetof(struct kepler, gm)},
    {"a", "1", "semi-major axis", 1, offsetof(struct kepler, a)},
    {"e", "1", "eccentricity, 0 <= e < 1", 0.6, offsetof(struct kepler, e)},
};

static size_t dof_of(const void *p)
{
    const struct kepler *s = p;
    return s->gm > 0 && s->a > 0 && s->e >= 0 && s->e < 1 ? 2 : 0;
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct kepler *s = p;
    (void)seed, (void)error;
    q[0] = s->a * (1 - s->e);
    q[1] = 0;
    v[0] = 0;
    v[1] = sqrt(s->gm / s->a * (1 + s->e) / (1 - s->e));
    return AD_OK;
}

const struct phys_scene phys_scene_kepler = {
    PHYS_SCENE_OF(struct kepler),
    .name = "kepler",
    .what = "a body around a fixed centre",
    .dof_of = dof_of,
    .dims = 2,
    .coordinates = (const char *const[]){"x", "y"},
    PHYS_PURE_NUMBERS,
    .kinetic = phys_centre_kinetic,
    .potential = phys_centre_potential,
    .slices = 101,
    .dt = M_PI / 100, /* half a period */
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
