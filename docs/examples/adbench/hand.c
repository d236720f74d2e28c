/* Hand tracking: how far measured points are from the vertices of a hand whose bones have turned.
   26 parameters for 5 fingers of 3 bones: rotation and translation of the hand, and for each finger
   two angles of the first bone and one of each other. */
#include "adbench.h"

#include <stdlib.h>

/* cos and sin of angle k of the parameters. */
static ad_var turned(ad_var theta, size_t k, bool about_x)
{
    ad_var a = ad_row(theta, k), c = ad_cos(a), s = ad_sin(a), one = ad_scalar(a.tape, 1);
    ad_var parts[] = {one, c, ad_neg(s), s, c};
    return ad_place(a.tape, 3, 3, 5, parts,
                    about_x ? (size_t[]){0, 1, 1, 2, 2} : (size_t[]){2, 0, 0, 1, 1},
                    about_x ? (size_t[]){0, 1, 2, 1, 2} : (size_t[]){2, 0, 1, 0, 1});
}

void adbench_hand(struct problem *p, const size_t size[3])
{
    const size_t fingers = size[0], bones = size[1], n = size[2];
    ad_var theta = adbench_input(p, 6 + fingers * (bones + 1), 1, 31, 0, 0.4);
    ad_var measured = adbench_constant(p, 3, n, 32, 0, 1);
    ad_var base = adbench_constant(p, 3, n, 33, 0, 1);
    ad_var weights = adbench_constant(p, fingers * bones, n, 34, 0.05, 0.05);
    ad_var offsets = adbench_constant(p, 3, fingers * bones, 35, 0, 0.5), position = {0};
    size_t angle = 6;
    for (size_t f = 0; f < fingers; f++) {
        ad_var turn = {0}, at = {0}, rest = {0};
        for (size_t b = 0; b < bones; b++) {
            ad_var step = ad_col(offsets, f * bones + b), own = turned(theta, angle++, true);
            if (b == 0)
                own = ad_matmul(own, false, turned(theta, angle++, false), false);
            rest = b ? ad_add(rest, step) : step; /* where the bone begins, at rest */
            at = b ? ad_add(at, ad_matmul(turn, false, step, false)) : step;
            turn = b ? ad_matmul(turn, false, own, false) : own;
            ad_var moved = ad_add(ad_matmul(turn, false, ad_sub(base, rest), false), at);
            ad_var part = ad_mul(moved, ad_row(weights, f * bones + b));
            position = position.tape ? ad_add(position, part) : part;
        }
    }
    ad_var placed =
        ad_add(adbench_rotate(ad_slice_rows(theta, 0, 3), position), ad_slice_rows(theta, 3, 3));
    p->y = ad_sub(measured, placed);
}
