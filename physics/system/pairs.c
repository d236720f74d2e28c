/* Pairs of bodies as the rows of one value, so that pair laws need no node per pair. */
#include "system.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { MOST_DIMS = 8 };

/* Coordinate `axis` of either body of each pair; rows is work space for n. */
static ad_var axis_of(ad_var q, size_t dims, size_t axis, size_t n, const uint32_t bodies[],
                      uint32_t rows[])
{
    for (size_t p = 0; p < n; p++)
        rows[p] = (uint32_t)fmin(bodies[p] * (double)dims + (double)axis, UINT32_MAX);
    return ad_gather_rows(q, n, rows);
}

void phys_listed_differences(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                             const uint32_t second[], ad_var d[])
{
    if (!d || (pairs && (!first || !second))) {
        ad_var none = ad_refuse(q.tape, AD_E_ARGUMENT, "pairs: got no %s (NULL)",
                                d ? "list of bodies" : "place for the differences");
        for (size_t axis = 0; d && axis < dims; axis++)
            d[axis] = none;
        return;
    }
    uint32_t *rows = malloc((pairs + 1) * sizeof *rows);
    for (size_t axis = 0; axis < dims; axis++)
        d[axis] = rows ? ad_sub(axis_of(q, dims, axis, pairs, first, rows),
                                axis_of(q, dims, axis, pairs, second, rows))
                       : ad_refuse(q.tape, AD_E_MEMORY, "out of memory for %zu pairs", pairs);
    free(rows);
}

static void list_all(size_t bodies, uint32_t first[], uint32_t second[])
{
    size_t p = 0;
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = i + 1; j < bodies; j++, p++) {
            first[p] = (uint32_t)i;
            second[p] = (uint32_t)j;
        }
}

void phys_pair_differences(ad_var q, size_t bodies, size_t dims, ad_var d[])
{
    if (bodies > ad_rows(q)) { /* and the number of pairs may not even be a size_t */
        bodies = 0;
        ad_refuse(q.tape, AD_E_SHAPE, "pairs: more bodies than the %zu rows", ad_rows(q));
    }
    size_t pairs = bodies < 2 ? 0 : bodies * (bodies - 1) / 2;
    uint32_t *list = pairs ? malloc(2 * pairs * sizeof *list) : NULL;
    if (list) {
        list_all(bodies, list, list + pairs);
        phys_listed_differences(q, dims, pairs, list, list + pairs, d);
    }
    for (size_t axis = 0; axis < dims && !list && d; axis++)
        d[axis] = pairs ? ad_refuse(q.tape, AD_E_MEMORY, "out of memory for %zu pairs", pairs)
                        : ad_refuse(q.tape, AD_E_ARGUMENT,
                                    "pairs: %zu bodies, expected two or more", bodies);
    free(list);
}

static ad_var sum_of_squares(size_t dims, const ad_var d[], double softening)
{
    ad_var sum = ad_square(d[0]);
    for (size_t axis = 1; axis < dims; axis++)
        sum = ad_add(sum, ad_square(d[axis]));
    return softening == 0 ? sum : ad_add(sum, softening);
}

static bool few_dims(ad_var q, size_t dims)
{
    if (dims >= 1 && dims <= MOST_DIMS)
        return true;
    ad_refuse(q.tape, AD_E_ARGUMENT, "pairs: %zu dimensions, expected 1 to %d", dims, MOST_DIMS);
    return false;
}

ad_var phys_pair_squares(ad_var q, size_t bodies, size_t dims, double softening)
{
    ad_var d[MOST_DIMS];
    if (!few_dims(q, dims))
        return q;
    phys_pair_differences(q, bodies, dims, d);
    return sum_of_squares(dims, d, softening);
}

ad_var phys_listed_squares(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                           const uint32_t second[], double softening)
{
    ad_var d[MOST_DIMS];
    if (!few_dims(q, dims))
        return q;
    phys_listed_differences(q, dims, pairs, first, second, d);
    return sum_of_squares(dims, d, softening);
}
