/* A satellite near earth and moon, in the frame that turns with them. The start lies on Arenstorf's
   periodic orbit with four loops (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations
   I, section II.0). */
#include "attraction.h"
#include "common.h"

struct arenstorf {
    double start[4], mu;
};

static const struct phys_param params[] = {
    {"mu", "1", "moon's share of the mass", 0.012277471, offsetof(struct arenstorf, mu)},
    {"x0", "1", "place at the start", 0.994, offsetof(struct arenstorf, start[0])},
    {"y0", "1", "place at the start", 0, offsetof(struct arenstorf, start[1])},
    {"vx0", "1", "velocity at the start", 0, offsetof(struct arenstorf, start[2])},
    {"vy0", "1", "velocity at the start", -2.00158510637908252240537862224,
     offsetof(struct arenstorf, start[3])},
};

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct arenstorf *s = p;
    (void)t;
    return phys_turning_frame(q, v, PHYS_PARAM(s, mu));
}

static size_t dof_of(const void *p)
{
    const struct arenstorf *s = p;
    return s->mu >= 0 && s->mu <= 1 ? 2 : 0;
}

const struct phys_scene phys_scene_arenstorf = {
    PHYS_SCENE_OF(struct arenstorf),
    .name = "arenstorf",
    .what = "a satellite near earth and moon, in the turning frame",
    .dof_of = dof_of,
    .dims = 2,
    .coordinates = (const char *const[]){"x", "y"},
    PHYS_PURE_NUMBERS,
    .lagrangian = lagrangian,
    .slices = 401,
    .dt = 17.0652165601579625588917206249 / 400, /* a period */
    .start = phys_start_2,
    .picture = PHYS_PICTURE_PLANE,
};
