/* A satellite near earth and moon, in the frame that turns with them: L has terms linear in the
   velocity,
       L = ((x' - y)^2 + (y' + x)^2) / 2 + (1 - mu)/r1 + mu/r2,
   and its Legendre energy is Jacobi's constant. The start lies on Arenstorf's periodic orbit with
   four loops (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.0). */
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

/* 1 / distance from (-shift, 0). */
static ad_var inverse(ad_var x, ad_var y, ad_var shift)
{
    return ad_recip(ad_sqrt(ad_add(ad_square(ad_add(x, shift)), ad_square(y))));
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct arenstorf *s = p;
    (void)t;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1);
    ad_var u = ad_sub(ad_row(v, 0), y), w = ad_add(ad_row(v, 1), x);
    ad_var T = ad_mul(0.5, ad_add(ad_square(u), ad_square(w)));
    ad_var mu = PHYS_PARAM(s, mu);
    return ad_add(T, ad_add(ad_mul(ad_sub(1, mu), inverse(x, y, mu)),
                            ad_mul(mu, inverse(x, y, ad_sub(mu, 1)))));
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
