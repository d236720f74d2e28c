/* The parts of `leastaction chart paths`. */
#ifndef APPS_BENCH_CHART_PATHS_H
#define APPS_BENCH_CHART_PATHS_H

#include "chart.h"
#include "apps/bench/measure/timing.h"
#include "physics/linear/vectors.h"
#include "physics/physics.h"

/* Rules: error of the stationary path against the motion, over slices and over CPU time. */
enum ad_status chart_rules(struct chart *chart, struct ad_error *error);
/* Solvers: distance from the stationary path on the way, over CPU time, from the published noise.
 */
enum ad_status chart_solvers(struct chart *chart, struct ad_error *error);
/* Boundaries: CPU time of a path to an error, from a straight line, and its true error. */
enum ad_status chart_boundaries(struct chart *chart, struct ad_error *error);

/* Three columns of two panels, room for a legend at their right. */
extern const struct layout figure_of_six;
#define LEGEND_RIGHT                                                                               \
    "at screen 0.998, screen 0.93 right top Left reverse samplen 2 spacing 1.4 font ',10'"

#endif
