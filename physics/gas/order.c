/* Order in the plane (order.h). The hexatic order parameter is that of D. R. Nelson and B. I.
   Halperin, Phys. Rev. B 19 (1979). */
#include "order.h"
#include "autodiff/free.h"
#include "cell_list.h"

#include <math.h>
#include <stdlib.h>

enum { FULL_SHELL = 6 };

/* sum [bodies][2] becomes the real and imaginary parts of the sums of exp(6 i angle); the angle of
   a pair is the same from either side, for 6 pi turns whole circles. */
static void add_bonds(const struct phys_near *near, const double *x, uint32_t *count, double *sum)
{
    for (size_t k = 0; k < near->n; k++) {
        uint32_t i = near->first[k], j = near->second[k];
        double angle = 6 * atan2(x[2 * i + 1] - x[2 * j + 1], x[2 * i] - x[2 * j]);
        const double bond[] = {cos(angle), sin(angle)};
        for (uint32_t part = 0; part < 2; part++) {
            sum[2 * i + part] += bond[part];
            sum[2 * j + part] += bond[part];
        }
        count[i]++;
        count[j]++;
    }
}

static enum phys_state state_of(const struct phys_order *order)
{
    if (order->neighbours < 2)
        return PHYS_STATE_GAS;
    return order->neighbours >= 4 && order->hexatic > 0.5 ? PHYS_STATE_SOLID : PHYS_STATE_DENSE;
}

const char *phys_state_text(enum phys_state state)
{
    static const char *const texts[] = {
        [PHYS_STATE_GAS] = "gas-like",
        [PHYS_STATE_DENSE] = "dense, but not ordered",
        [PHYS_STATE_SOLID] = "solid-like",
    };
    return (size_t)state < sizeof texts / sizeof *texts && texts[state] ? texts[state] : "unknown";
}

enum ad_status phys_order(size_t bodies, const double *x, double shell, uint32_t *neighbours,
                          double *hexatic, struct phys_order *order, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, order) || AD_LACKS(error, x))
        return error->status;
    struct phys_near near = {0};
    uint32_t *count = calloc(bodies, sizeof *count);
    double *sum = calloc(2 * bodies, sizeof *sum);
    if (!count || !sum)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu bodies", bodies);
    else if (phys_near_pairs(bodies, x, shell, &near, error) == AD_OK)
        add_bonds(&near, x, count, sum);
    for (size_t i = 0; i < bodies && error->status == AD_OK; i++) {
        double share = hypot(sum[2 * i], sum[2 * i + 1]) / fmax(FULL_SHELL, count[i]);
        order->neighbours += count[i] / (double)bodies;
        order->hexatic += share / (double)bodies;
        if (neighbours)
            neighbours[i] = count[i];
        if (hexatic)
            hexatic[i] = share;
    }
    order->state = state_of(order);
    phys_near_free(&near);
    AD_FREE(count, sum);
    return error->status;
}
