/* Three equal masses that follow each other along one figure eight (Chenciner, Montgomery, Annals
   of Mathematics 152, 2000; initial values by Simo). With m = G = 1 the period is 6.3259138908. */
#include "attraction.h"
#include "scenes.h"

#include <math.h>

enum { BODIES = 3, DIMS = 2 };

struct figure8 {
    double m, G;
};

static const struct phys_param params[] = {
    {"m", "1", "mass of each body", 1, offsetof(struct figure8, m)},
    {"G", "1", "strength of the attraction", 1, offsetof(struct figure8, G)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct figure8 *s = p;
    (void)q, (void)t;
    ad_var m = PHYS_PARAM(s, m);
    return phys_attraction_kinetic(v, BODIES, DIMS, (ad_var[]){m, m, m});
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct figure8 *s = p;
    (void)v, (void)t;
    ad_var m = PHYS_PARAM(s, m), G = PHYS_PARAM(s, G);
    return phys_attraction_potential(q, BODIES, DIMS, (ad_var[]){m, m, m}, G);
}

static size_t dof_of(const void *p)
{
    const struct figure8 *s = p;
    return s->m > 0 && s->G > 0 ? BODIES * DIMS : 0;
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    static const double x[DIMS] = {0.97000436, -0.2430874784197};
    static const double v3[DIMS] = {-0.9324073307192, -0.8647315139076};
    const struct figure8 *s = p;
    double speed = sqrt(s->G * s->m);
    (void)seed, (void)error;
    for (size_t k = 0; k < DIMS; k++) {
        q[k] = x[k];
        q[DIMS + k] = -x[k];
        q[2 * DIMS + k] = 0;
        v[k] = v[DIMS + k] = -0.5 * speed * v3[k];
        v[2 * DIMS + k] = speed * v3[k];
    }
    return AD_OK;
}

const struct phys_scene phys_scene_figure8 = {
    PHYS_SCENE_OF(struct figure8),
    .name = "figure8",
    .what = "three equal masses on one figure eight",
    .dof_of = dof_of,
    .dims = DIMS,
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.063259138908, /* a period */
    .start = start,
    .picture = PHYS_PICTURE_PLANE,
};
