/* Hand tracking: how far measured points are from the vertices of a hand whose 22 bones have
   turned, by 26 parameters: rotation and translation of the hand, and for each of 5 fingers two
   angles of the first bone and one of each of the next two. The fourth bone of a finger, the wrist
   and the palm do not turn. Points belong to vertices, or to triangles of vertices; then each has
   two coordinates there, which are parameters, too. */
#include "adbench.h"

#include <stdlib.h>

enum { BONES = 22, VERTICES = 544, TRIANGLES = 1084, FINGER = 4, FIRST = 2 };

static ad_var about(ad_var a, bool x_axis)
{
    ad_var c = ad_cos(a), s = ad_sin(a);
    ad_var parts[] = {ad_scalar(a.tape, 1), c, ad_neg(s), s, c};
    return ad_place(a.tape, 3, 3, 5, parts,
                    x_axis ? (size_t[]){0, 1, 1, 2, 2} : (size_t[]){1, 0, 2, 0, 2},
                    x_axis ? (size_t[]){0, 1, 2, 1, 2} : (size_t[]){1, 0, 0, 2, 2});
}

static ad_var times(ad_var a, ad_var b) { return ad_matmul(a, false, b, false); }

/* The vertices, skinned: each moved by its bones with their weights. */
static ad_var skinned(struct problem *p, ad_var theta)
{
    ad_var base = adbench_constant(p, 3, VERTICES, 33, 0, 1), position = {0};
    ad_var weights = adbench_constant(p, BONES, VERTICES, 34, 0.05, 0.05);
    ad_var relative = adbench_constant(p, 3, 4 * BONES, 35, 0, 0.7);
    ad_var inverse = adbench_constant(p, 3, 4 * BONES, 36, 0, 0.7), turn[BONES], at[BONES];
    size_t angle = 6;
    for (size_t i = 0; i < BONES; i++) {
        const size_t in_finger = (i - FIRST) % FINGER,
                     parent = i < FIRST || in_finger ? i - 1 : FIRST - 1;
        turn[i] = ad_slice_cols(relative, 4 * i, 3);
        at[i] = ad_col(relative, 4 * i + 3);
        if (i >= FIRST && in_finger < FINGER - 1)
            turn[i] = times(turn[i], about(ad_row(theta, angle++), false));
        if (i >= FIRST && in_finger == 0)
            turn[i] = times(turn[i], about(ad_row(theta, angle++), true));
        if (i > 0) {
            at[i] = ad_add(times(turn[parent], at[i]), at[parent]);
            turn[i] = times(turn[parent], turn[i]);
        }
        ad_var whole = times(turn[i], ad_slice_cols(inverse, 4 * i, 3));
        ad_var shift = ad_add(times(turn[i], ad_col(inverse, 4 * i + 3)), at[i]);
        ad_var part = ad_mul(ad_add(times(whole, base), shift), ad_row(weights, i));
        position = i ? ad_add(position, part) : part;
    }
    return position;
}

void adbench_hand(struct problem *p, const size_t size[3])
{
    const size_t n = size[0];
    const bool triangles = size[1];
    ad_var theta = adbench_input(p, 26, 1, 31, 0, 0.4), seen;
    ad_var measured = adbench_constant(p, 3, n, 32, 0, 1), position = skinned(p, theta);
    position =
        ad_add(adbench_rotate(ad_slice_rows(theta, 0, 3), position), ad_slice_rows(theta, 3, 3));
    uint32_t *vertex = malloc(3 * n * sizeof *vertex);
    if (!vertex)
        abort();
    for (size_t k = 0; k < n; k++)
        for (size_t corner = 0; corner < 3; corner++)
            vertex[corner * n + k] =
                (uint32_t)((triangles ? k * 7 % TRIANGLES * 5 + corner * 31 : k * 7) % VERTICES);
    seen = ad_gather_cols(position, n, vertex);
    if (triangles) {
        ad_var us = adbench_input(p, 2, n, 37, 0.3, 0.2), u = ad_row(us, 0), v = ad_row(us, 1);
        ad_var w = ad_sub(ad_sub(1.0, u), v);
        seen = ad_add(ad_mul(u, seen), ad_mul(v, ad_gather_cols(position, n, vertex + n)));
        seen = ad_add(seen, ad_mul(w, ad_gather_cols(position, n, vertex + 2 * n)));
    }
    free(vertex);
    p->y = ad_sub(measured, seen);
}
