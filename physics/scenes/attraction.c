/* Point masses under 1/r attraction (attraction.h). */
#include "attraction.h"

#include <stdlib.h>

ad_var phys_attraction_kinetic(ad_var v, size_t bodies, size_t dims, const double m[])
{
    size_t rows = bodies * dims;
    double *half = malloc(rows * sizeof *half);
    if (!half)
        return ad_refuse(v.tape, AD_E_MEMORY, "out of memory for %zu bodies", bodies);
    for (size_t k = 0; k < rows; k++)
        half[k] = 0.5 * m[k / dims];
    ad_var weights = ad_const(v.tape, rows, 1, half);
    free(half);
    return ad_sum_rows(ad_mul(weights, ad_square(v)));
}

ad_var phys_attraction_potential(ad_var q, size_t bodies, size_t dims, const double m[], double G)
{
    size_t pairs = bodies * (bodies - 1) / 2, k = 0;
    double *strength = malloc(pairs * sizeof *strength);
    if (!strength)
        return ad_refuse(q.tape, AD_E_MEMORY, "out of memory for %zu bodies", bodies);
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = i + 1; j < bodies; j++)
            strength[k++] = -G * m[i] * m[j];
    ad_var weights = ad_const(q.tape, pairs, 1, strength);
    free(strength);
    return ad_sum_rows(ad_div(weights, ad_sqrt(phys_pair_squares(q, bodies, dims, 0))));
}
