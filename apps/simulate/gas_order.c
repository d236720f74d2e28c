/* Order of the gas along a simulation (gas_order.h). */
#include "gas_order.h"
#include "simulate.h"

#include <math.h>
#include <string.h>

double gas_shell(const struct phys_system *system)
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

enum ad_status gas_order_measure(const struct phys_system *system, const double *q,
                                 struct gas_order *order, struct ad_error *error)
{
    double sides[2];
    *order = (struct gas_order){0};
    measure_sides(system, q, sides);
    order->reach = fmin(5 * phys_system_get(system, "sigma"), fmin(sides[0], sides[1]));
    if (phys_order(system->bodies, q, gas_shell(system), NULL, NULL, &order->mean, error) !=
            AD_OK ||
        phys_pair_distribution(system->bodies, q, sides, order->reach, GAS_BINS, order->g, error) !=
            AD_OK)
        return error->status;
    for (size_t k = 0; k < GAS_BINS; k++)
        if (order->g[k] > order->peak) {
            order->peak = order->g[k];
            order->peak_at = ((double)k + 0.5) * order->reach / GAS_BINS;
        }
    return AD_OK;
}

enum ad_status simulate_gas(const struct simulate_run *run, struct simulate_result *result,
                            struct ad_error *error)
{
    const struct simulate_samples *s = &result->samples;
    const double *last = s->x + 2 * (s->n - 1) * s->dof;
    result->gas.on = strcmp(run->system.scene->name, "gas") == 0;
    if (result->gas.on && gas_order_measure(&run->system, s->x, &result->gas.start, error) == AD_OK)
        gas_order_measure(&run->system, last, &result->gas.end, error);
    return error->status;
}

void simulate_gas_print(const struct simulate_run *run, const struct gas_orders *orders)
{
    double sigma = phys_system_get(&run->system, "sigma");
    const struct gas_order *both[] = {&orders->start, &orders->end};
    if (!orders->on)
        return;
    printf("  %-24s %13s %12s %22s\n", "order", "neighbours", "hexatic", "peak of g, at");
    for (size_t k = 0; k < 2; k++)
        printf("  %-24s %13.3g %12.3g %11.3g %5.3g sigma  %s\n",
               k ? "  at the end" : "  at the start", both[k]->mean.neighbours,
               both[k]->mean.hexatic, both[k]->peak, both[k]->peak_at / sigma,
               phys_state_text(both[k]->mean.state));
}

static void json_order(struct json *json, const char *key, const struct gas_order *order)
{
    json_object(json, key);
    json_text(json, "state", phys_state_text(order->mean.state));
    json_number(json, "neighbours", order->mean.neighbours);
    json_number(json, "hexatic", order->mean.hexatic);
    json_number(json, "peak", order->peak);
    json_number(json, "peak_at", order->peak_at);
    json_end_object(json);
}

void simulate_gas_json(struct json *json, const struct gas_orders *orders)
{
    if (!orders->on)
        return;
    json_order(json, "order_start", &orders->start);
    json_order(json, "order_end", &orders->end);
}
