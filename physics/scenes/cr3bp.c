/* The circular restricted three-body problem in space: Jacobi's constant is -2 E. The start lies
   on the periodic motion in the plane about L1 of earth and moon (one of Lyapunov's) at which the
   family of halo orbits begins. */
#include "attraction.h"
#include "common.h"

struct cr3bp {
    double start[6], mu;
};

static const struct phys_param params[] = {
    {"mu", "1", "smaller body's share of the mass", 0.01215058560962404,
     offsetof(struct cr3bp, mu)},
    {"x0", "1", "place at the start", 0.8233908986, offsetof(struct cr3bp, start[0])},
    {"y0", "1", "place at the start", 0, offsetof(struct cr3bp, start[1])},
    {"z0", "1", "place at the start", 0, offsetof(struct cr3bp, start[2])},
    {"vx0", "1", "velocity at the start", 0, offsetof(struct cr3bp, start[3])},
    {"vy0", "1", "velocity at the start", 0.1263264031, offsetof(struct cr3bp, start[4])},
    {"vz0", "1", "velocity at the start", 0, offsetof(struct cr3bp, start[5])},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct cr3bp *s = p;
    (void)t;
    return phys_turning_frame(q, v, PHYS_PARAM(s, mu));
}

static size_t dof_of(const void *p)
{
    const struct cr3bp *s = p;
    return s->mu >= 0 && s->mu <= 1 ? 3 : 0;
}

const struct phys_scene phys_scene_cr3bp = {
    PHYS_SCENE_OF(struct cr3bp),
    .name = "cr3bp",
    .what = "a body near two on circles, in the turning frame, in space",
    .dof_of = dof_of,
    .dims = 3,
    .coordinates = (const char *const[]){"x", "y", "z"},
    PHYS_PURE_NUMBERS,
    .lagrangian = lagrangian,
    .slices = 201,
    .dt = 2.742994069 / 200, /* a period */
    .start = phys_start_3,
    .picture = PHYS_PICTURE_PLANE,
};
