/* How ordered the gas is along a simulation: neighbours, hexagons, the pair distribution; and its
   picture. */
#ifndef APPS_GAS_ORDER_H
#define APPS_GAS_ORDER_H

#include "apps/output/plot.h"
#include "apps/output/report.h"
#include "physics/gas/order.h"
#include "physics/physics.h"

enum { GAS_BINS = 100 };

/* At one time. */
struct gas_order {
    struct phys_order mean;
    double reach;         /* of g, 5 sigma or the side of the square if that is less */
    double g[GAS_BINS];   /* in the square that holds the bodies */
    double peak, peak_at; /* its highest value, and at which distance */
};

/* Along a run; on is false for other scenes. */
struct gas_orders {
    bool on;
    struct gas_order start, end;
};

struct simulate_run;
struct simulate_result;

/* Bodies nearer than this are neighbours: halfway, by factors, from the first to the second shell
   of a crystal whose bodies are where their pair's energy is least. */
double gas_shell(const struct phys_system *system);
enum ad_status gas_order_measure(const struct phys_system *system, const double *q,
                                 struct gas_order *order, struct ad_error *error);

/* Of the first and last sample of a simulation of the gas. */
enum ad_status simulate_gas(const struct simulate_run *run, struct simulate_result *result,
                            struct ad_error *error);
void simulate_gas_report(const struct gas_orders *orders, struct report *report);
/* Bodies by their number of neighbours; g at the start and at the end; order against time. */
enum ad_status simulate_gas_picture(const struct simulate_run *run,
                                    const struct simulate_result *result, struct plot *plot,
                                    struct ad_error *error);

#endif
