/* Pair laws without a node per pair: all pairs of bodies as the rows of one value. */
#include "physics.h"

#include <stdint.h>
#include <stdlib.h>

/* Rows of coordinate `axis` of the first and of the second body of every pair. */
static void pair_rows(size_t bodies, size_t dims, size_t axis, uint32_t first[], uint32_t second[])
{
    size_t p = 0;
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = i + 1; j < bodies; j++, p++) {
            first[p] = (uint32_t)(i * dims + axis);
            second[p] = (uint32_t)(j * dims + axis);
        }
}

void phys_pair_differences(ad_var q, size_t bodies, size_t dims, ad_var d[])
{
    size_t pairs = bodies < 2 ? 0 : bodies * (bodies - 1) / 2;
    uint32_t *rows = pairs ? malloc(2 * pairs * sizeof *rows) : NULL;
    for (size_t axis = 0; axis < dims; axis++) {
        if (!pairs) {
            d[axis] =
                ad_refuse(q.tape, AD_E_ARGUMENT, "pairs: %zu bodies, expected two or more", bodies);
        } else if (!rows) {
            d[axis] = ad_refuse(q.tape, AD_E_MEMORY, "out of memory for %zu pairs", pairs);
        } else {
            pair_rows(bodies, dims, axis, rows, rows + pairs);
            d[axis] =
                ad_sub(ad_gather_rows(q, pairs, rows), ad_gather_rows(q, pairs, rows + pairs));
        }
    }
    free(rows);
}

ad_var phys_pair_squares(ad_var q, size_t bodies, size_t dims, double softening)
{
    ad_var d[8], sum;
    if (dims < 1 || dims > sizeof d / sizeof *d)
        return ad_refuse(q.tape, AD_E_ARGUMENT, "pairs: %zu dimensions, expected 1 to 8", dims);
    phys_pair_differences(q, bodies, dims, d);
    sum = ad_square(d[0]);
    for (size_t axis = 1; axis < dims; axis++)
        sum = ad_add(sum, ad_square(d[axis]));
    return softening == 0 ? sum : ad_add(sum, softening);
}
