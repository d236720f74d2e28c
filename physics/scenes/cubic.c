/* An oscillator with a cubic term, V = k x^2/2 + a x^3/3: the simplest one whose steps can be in
   resonance with the motion. */
#include "common.h"

struct cubic {
    struct phys_particle at;
    double k, a;
};

static const struct phys_param params[] = {
    {"m", "1", "mass", 1, offsetof(struct cubic, at.m)},
    {"k", "1", "stiffness", 1, offsetof(struct cubic, k)},
    {"a", "1", "strength of the cubic term", 1, offsetof(struct cubic, a)},
    {"q0", "1", "place at the start", 0.1, offsetof(struct cubic, at.start[0])},
    {"v0", "1", "velocity at the start", 0, offsetof(struct cubic, at.start[1])},
};

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct cubic *s = p;
    (void)v, (void)t;
    ad_var cubic = ad_mul(ad_div(PHYS_PARAM(s, a), 3), q);
    return ad_mul(ad_square(q), ad_add(ad_mul(0.5, PHYS_PARAM(s, k)), cubic));
}

const struct phys_scene phys_scene_cubic = {
    PHYS_SCENE_OF(struct cubic),
    .name = "cubic",
    .what = "an oscillator with a cubic term",
    .dof = 1,
    .dims = 1,
    .coordinates = (const char *const[]){"x"},
    PHYS_PURE_NUMBERS,
    .kinetic = phys_particle_kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 0.05,
    .start = phys_start_1,
    .picture = PHYS_PICTURE_TIME,
};
