/* Bundle adjustment: where cameras (rotation, centre, focal length, principal point, two
   coefficients of radial distortion) see points, and the weights of the observations. */
#include "adbench.h"

#include <stdlib.h>

enum { CAMERA = 11 };

void adbench_ba(struct problem *p, const size_t size[3])
{
    const size_t cameras = size[0], points = size[1], n = size[2];
    static const double offset[CAMERA] = {0, 0, 0, 0, 0, -5, 1, 0, 0, 0, 0},
                        scale[CAMERA] = {0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 0.05, 0.05};
    ad_var all = adbench_input(p, CAMERA, cameras, 11, 0, 1);
    for (size_t k = 0; k < CAMERA * cameras; k++)
        p->at[0][k] = offset[k / cameras] + scale[k / cameras] * p->at[0][k];
    ad_var x = adbench_input(p, 3, points, 12, 0, 1);
    ad_var w = adbench_input(p, 1, n, 13, 0.5, 0.4);
    ad_var seen = adbench_constant(p, 2, n, 14, 0, 0.3);
    uint32_t *camera = malloc(n * sizeof *camera), *point = malloc(n * sizeof *point);
    if (!camera || !point)
        abort();
    for (size_t k = 0; k < n; k++) {
        camera[k] = (uint32_t)(k % cameras);
        point[k] = (uint32_t)((k * 7 + k / cameras) % points);
    }
    ad_var c = ad_gather_cols(all, n, camera); /* a column for each observation */
    ad_var from = ad_sub(ad_gather_cols(x, n, point), ad_slice_rows(c, 3, 3));
    ad_var v = adbench_rotate(ad_slice_rows(c, 0, 3), from);
    ad_var u = ad_div(ad_slice_rows(v, 0, 2), ad_row(v, 2)), r = ad_sum_rows(ad_square(u));
    ad_var distortion =
        ad_add(1.0, ad_add(ad_mul(ad_row(c, 9), r), ad_mul(ad_row(c, 10), ad_square(r))));
    ad_var projected = ad_add(ad_mul(ad_mul(u, distortion), ad_row(c, 6)), ad_slice_rows(c, 7, 2));
    p->y = ad_concat_rows(
        2, (ad_var[]){ad_mul(w, ad_sub(projected, seen)), ad_sub(1.0, ad_square(w))});
    free(camera);
    free(point);
}
