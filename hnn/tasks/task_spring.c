/* A mass on a spring: H = p^2 + k q^2. */
#include "task.h"

static ad_var H(ad_var q, ad_var p, ad_var t, const void *params)
{
    (void)t;
    return ad_add(ad_square(p), ad_mul(*(const double *)params, ad_square(q)));
}

const struct hnn_task hnn_task_spring = {
    .name = "spring",
    .what = "H = p^2 + k q^2, from a radius in the phase plane",
    .dof = 1,
    .coordinates = (const char *const[]){""},
    .H = H,
    .start = hnn_task_on_circle,
    .published = {.size = sizeof(struct hnn_sampling),
                  .trials = 50,
                  .points = 30,
                  .time = 3,
                  .noise = 0.1,
                  .radius_min = 0.1,
                  .radius_max = 1,
                  .strength = 1},
    .published_start = hnn_task_off_axes,
    .time_stretch = 1.09,
};
