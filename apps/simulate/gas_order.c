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
    if (result->gas.on && gas_order_measure(&run->system, s->x, &result->gas.start, error) == AD_OK)
        gas_order_measure(&run->system, last, &result->gas.end, error);
    return error->status;
}

static void report_order(const struct gas_order *order, const char *label, struct report *report)
{
    report_number(report, "neighbours", label, NULL, order->mean.neighbours);
    report_number(report, "hexatic", label, NULL, order->mean.hexatic);
    report_number(report, "peak", label, NULL, order->peak);
    report_number(report, "peak_at", label, NULL, order->peak_at);
    report_text(report, "state", label, phys_state_text(order->mean.state));
}

void simulate_gas_report(const struct gas_orders *orders, struct report *report)
{
    if (!orders->on)
        return;
    report_line(report, "  %-24s %14s %14s %14s %14s", "order", "neighbours", "hexatic",
                "peak of g", "at distance");
    report->object = "order_start";
    report_order(&orders->start, "  at the start", report);
    report->object = "order_end";
    report_order(&orders->end, "  at the end", report);
    report->object = NULL;
}
