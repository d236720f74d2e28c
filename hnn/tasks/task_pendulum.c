/* A pendulum: H = p^2 + k (1 - cos q). */
#include "task.h"

static ad_var H(ad_var q, ad_var p, ad_var t, const void *params)
{
    (void)t;
    return ad_add(ad_square(p), ad_mul(*(const double *)params, ad_sub(1, ad_cos(q))));
}

static ad_var spring(ad_var q, ad_var p, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_square(p), ad_square(q));
}

const struct hnn_task hnn_task_pendulum = {
    .name = "pendulum",
    .what = "H = p^2 + k (1 - cos q), from a radius in the phase plane",
    .dof = 1,
    .coordinates = (const char *const[]){""},
    .H = H,
    .start = hnn_task_on_circle,
    .published = {.size = sizeof(struct hnn_sampling),
                  .trials = 50,
                  .points = 45,
                  .time = 3,
                  .noise = 0.1,
                  .radius_min = 1.3,
                  .radius_max = 2.3,
                  .strength = 3},
    .published_start = hnn_task_off_axes,
    .published_energy = spring,
};
