/* The outer planets, AU and days (Hairer, Lubich, Wanner, Geometric Numerical Integration, table
   I.2.4): the Sun with the inner planets, Jupiter, Saturn, Uranus, Neptune. */
#include <physics/physics.h>

#include <string.h>

enum { BODIES = 5, DIMS = 3 };

static const double G = 2.95912208286e-4;
static const double m[] = {1.00000597682, 0.000954786104043, 0.000285583733151, 4.37273164546e-05,
                           5.17759138449e-05};
static const double q0[] = {0,           0,          0,          -3.5023653,  -3.8169847,
                            -1.5507963,  9.0755314,  -3.0458353, -1.6483708,  8.310142,
                            -16.2901086, -7.2521278, 11.4707666, -25.7294829, -10.8169456};
static const double v0[] = {0,           0,          0,          0.00565429, -0.0041249,
                            -0.00190589, 0.00168318, 0.00483525, 0.00192462, 0.00354178,
                            0.00137102,  0.00055029, 0.0028893,  0.00114527, 0.00039677};

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *p)
{
    double mass[BODIES * DIMS];
    (void)q, (void)t, (void)p;
    for (size_t k = 0; k < BODIES * DIMS; k++)
        mass[k] = 0.5 * m[k / DIMS];
    ad_var masses = ad_broadcast(ad_const(v.tape, BODIES * DIMS, 1, mass), ad_rows(v), ad_cols(v));
    return ad_sum_rows(ad_mul(masses, ad_square(v)));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *p)
{
    double strength[BODIES * (BODIES - 1) / 2];
    size_t n = 0;
    (void)v, (void)t, (void)p;
    for (size_t i = 0; i < BODIES; i++)
        for (size_t j = i + 1; j < BODIES; j++)
            strength[n++] = -G * m[i] * m[j];
    ad_var squares = phys_pair_squares(q, BODIES, DIMS, 0);
    ad_var weights = ad_broadcast(ad_const(q.tape, n, 1, strength), n, ad_cols(q));
    return ad_sum_rows(ad_div(weights, ad_sqrt(squares)));
}

static enum ad_status start(const void *p, uint64_t seed, double *q, double *v, struct ad_error *e)
{
    (void)p, (void)seed, (void)e;
    memcpy(q, q0, sizeof q0);
    memcpy(v, v0, sizeof v0);
    return AD_OK;
}

static void gm(const void *p, double values[])
{
    (void)p;
    for (size_t k = 0; k < BODIES; k++)
        values[k] = G * m[k];
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "outer",
    .what = "the outer planets",
    .dof = BODIES * DIMS,
    .dims = DIMS,
    .unit = "AU",
    .time_unit = "d",
    .energy_unit = "1",
    .kinetic = kinetic,
    .potential = potential,
    .slices = 101,
    .dt = 100,
    .start = start,
    .gm = gm,
};
