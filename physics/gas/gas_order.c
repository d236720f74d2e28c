/* Order of a gas at one time (order.h). */
#include "order.h"

#include <math.h>

double phys_gas_shell(const struct phys_system *system)
{
    double least = pow(2, 1 / 6.0) * phys_system_get(system, "sigma");
    return sqrt(sqrt(3)) * least;
}

/* Sides of the rectangle about the bodies. */
static void measure_sides(const struct phys_system *system, const double *q, double sides[2])
{
    for (size_t axis = 0; axis < 2; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t k = axis; k < system->dof; k += 2) {
            low = fmin(low, q[k]);
            high = fmax(high, q[k]);
        }
        sides[axis] = high - low;
    }
}

enum ad_status phys_gas_order(const struct phys_system *system, const double *q,
                              struct phys_gas_order *order, struct ad_error *error)
{
    double sides[2];
    if (AD_LACKS_RESULT(error, order) || AD_LACKS(error, system, system->scene, q))
        return error->status;
    measure_sides(system, q, sides);
    order->reach = fmin(5 * phys_system_get(system, "sigma"), fmin(sides[0], sides[1]));
    if (phys_order(system->bodies, q, phys_gas_shell(system), NULL, NULL, &order->mean, error) !=
            AD_OK ||
        phys_pair_distribution(system->bodies, q, sides, order->reach, PHYS_GAS_BINS, order->g,
                               error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < PHYS_GAS_BINS; k++)
        if (order->g[k] > order->peak) {
            order->peak = order->g[k];
            order->peak_at = ((double)k + 0.5) * order->reach / PHYS_GAS_BINS;
        }
    return AD_OK;
}
