/* Coupled coordinates whose masses have a kink where one passes 0. */
#include <physics/physics.h>

#include <math.h>

enum { N = 8 };

static ad_var ahead(ad_var x, uint32_t by)
{
    uint32_t place[N];
    for (uint32_t k = 0; k < N; k++)
        place[k] = (k + by) % N;
    return ad_gather_rows(x, N, place);
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    static const uint32_t mirrored[N] = {7, 6, 5, 4, 3, 2, 1, 0};
    ad_var turned = ad_mul(v, ad_gather_rows(v, N, mirrored)), L = ad_mul(0.5, ad_square(v));
    (void)t, (void)params;
    L = ad_add(L, ad_mul(0.15, ad_mul(ad_cos(ad_add(q, ad_gather_rows(q, N, mirrored))), turned)));
    L = ad_add(L, ad_mul(0.025, ad_mul(ad_abs(q), ad_mul(v, ahead(v, 3)))));
    L = ad_add(L, ad_sub(ad_cos(ad_sub(q, ahead(q, 5))), ad_mul(0.5, ad_square(q))));
    return ad_sum_rows(L);
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (int k = 0; k < N; k++) {
        q[k] = 0.5 * sin(1.7 * k + 0.4);
        v[k] = 0.5 * cos(0.9 * k);
    }
    return AD_OK;
}

const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION,
    .size = sizeof(struct phys_scene),
    .name = "kinked-masses",
    .what = "coordinates whose masses have kinks",
    .dof = N,
    .dims = 1,
    .unit = "",
    .time_unit = "",
    .energy_unit = "",
    .lagrangian = lagrangian,
    .start = start,
    .slices = 31,
    .dt = 1.0 / 30,
};
