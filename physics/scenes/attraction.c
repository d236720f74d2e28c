/* Point masses under 1/r attraction (attraction.h). */
#include "attraction.h"

#include <stdlib.h>

ad_var phys_stacked(size_t n, ad_var values[])
{
    size_t width = 1;
    for (size_t k = 0; k < n; k++)
        width = ad_cols(values[k]) > width ? ad_cols(values[k]) : width;
    for (size_t k = 0; k < n; k++)
        if (ad_cols(values[k]) != width)
            values[k] = ad_broadcast(values[k], 1, width);
    return ad_concat_rows(n, values);
}

ad_var phys_attraction_kinetic(ad_var v, size_t bodies, size_t dims, const ad_var m[])
{
    size_t rows = bodies * dims;
    ad_var *half = malloc(rows * sizeof *half);
    if (!half)
        return ad_refuse(v.tape, AD_E_MEMORY, "out of memory for %zu bodies", bodies);
    for (size_t k = 0; k < rows; k++)
        half[k] = ad_mul(0.5, m[k / dims]);
    ad_var weights = phys_stacked(rows, half);
    free(half);
    return ad_sum_rows(ad_mul(weights, ad_square(v)));
}

ad_var phys_attraction_potential(ad_var q, size_t bodies, size_t dims, const ad_var m[], ad_var G)
{
    size_t pairs = bodies * (bodies - 1) / 2, k = 0;
    ad_var *strength = malloc(pairs * sizeof *strength);
    if (!strength)
        return ad_refuse(q.tape, AD_E_MEMORY, "out of memory for %zu bodies", bodies);
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = i + 1; j < bodies; j++)
            strength[k++] = ad_mul(ad_mul(ad_neg(G), m[i]), m[j]);
    ad_var weights = phys_stacked(pairs, strength);
    free(strength);
    return ad_sum_rows(ad_div(weights, ad_sqrt(phys_pair_squares(q, bodies, dims, 0))));
}

/* 1 / distance from (-shift, 0, 0); aside: the square of the distance from the axis of x. */
static ad_var inverse(ad_var x, ad_var aside, ad_var shift)
{
    return ad_recip(ad_sqrt(ad_add(ad_square(ad_add(x, shift)), aside)));
}

ad_var phys_turning_frame(ad_var q, ad_var v, ad_var mu)
{
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), aside = ad_square(y);
    ad_var u = ad_sub(ad_row(v, 0), y), w = ad_add(ad_row(v, 1), x);
    ad_var T = ad_add(ad_square(u), ad_square(w));
    if (ad_rows(q) > 2) {
        aside = ad_add(aside, ad_square(ad_row(q, 2)));
        T = ad_add(T, ad_square(ad_row(v, 2)));
    }
    return ad_add(ad_mul(0.5, T), ad_add(ad_mul(ad_sub(1, mu), inverse(x, aside, mu)),
                                         ad_mul(mu, inverse(x, aside, ad_sub(mu, 1)))));
}
