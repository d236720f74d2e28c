/* The published rules: forward difference and rectangle, of first order. For separable L the
   stationary path of `left` is the semi-implicit Euler path. `left+repeat` counts the last slice
   too, with the velocity before it, which moves the stationary path off the true one. */
#include "internal.h"

#include <stdlib.h>

/* [1 x n]: the times of the first n slices. */
static ad_var times(ad_tape *tape, size_t n, double dt)
{
    double *t = malloc(n * sizeof *t);
    if (!t)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory for %zu slices", n);
    for (size_t i = 0; i < n; i++)
        t[i] = (double)i * dt;
    ad_var row = ad_const(tape, 1, n, t);
    free(t);
    return row;
}

static void left(ad_var x, double dt, ad_var *q, ad_var *v, ad_var *t)
{
    size_t n = ad_cols(x) - 1;
    *q = ad_slice_cols(x, 0, n);
    *v = ad_diff(x, 1 / dt, false);
    *t = times(x.tape, n, dt);
}

static void left_repeat(ad_var x, double dt, ad_var *q, ad_var *v, ad_var *t)
{
    *q = x;
    *v = ad_diff(x, 1 / dt, true);
    *t = times(x.tape, ad_cols(x), dt);
}

const struct phys_rule phys_rule_left = {"left", "forward difference and rectangle, first order",
                                         left};
const struct phys_rule phys_rule_left_repeat = {
    "left+repeat", "the same with the last velocity used twice, as published", left_repeat};
