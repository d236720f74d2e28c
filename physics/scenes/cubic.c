/* An oscillator with a cubic term, V = k x^2/2 + a x^3/3: the simplest one whose steps can be in
   resonance with the motion. */
#include "scenes.h"

struct cubic {
    double m, k, a, q0, v0;
};

static const struct phys_param params[] = {
    {"m", "1", "mass", 1, offsetof(struct cubic, m)},
    {"k", "1", "stiffness", 1, offsetof(struct cubic, k)},
    {"a", "1", "strength of the cubic term", 1, offsetof(struct cubic, a)},
    {"q0", "1", "place at the start", 0.1, offsetof(struct cubic, q0)},
    {"v0", "1", "velocity at the start", 0, offsetof(struct cubic, v0)},
};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct cubic *s = p;
    (void)q, (void)t;
    return ad_mul(0.5 * s->m, ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct cubic *s = p;
    (void)v, (void)t;
    return ad_mul(ad_square(q), ad_add(0.5 * s->k, ad_mul(s->a / 3, q)));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct cubic *s = p;
    (void)seed, (void)error;
    q[0] = s->q0;
    v[0] = s->v0;
    return AD_OK;
}

const struct phys_scene phys_scene_cubic = {
    PHYS_SCENE_OF(struct cubic),
    .name = "cubic",
    .what = "an oscillator with a cubic term",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"x"},
    PHYS_PURE_NUMBERS,
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.05,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
};
