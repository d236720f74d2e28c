/* The parts of `leastaction chart paths`. */
#ifndef APPS_CHART_PATHS_H
#define APPS_CHART_PATHS_H

#include "charts.h"
#include "apps/output/json.h"
#include "timing.h"
#include "physics/physics.h"

/* Rules: error of the stationary path against the motion, over slices and over seconds. */
enum ad_status chart_rules(const struct chart_settings *settings, struct json *json,
                           struct ad_error *error);
/* Solvers: distance from the stationary path on the way, over seconds, from the published noise. */
enum ad_status chart_solvers(const struct chart_settings *settings, struct json *json,
                             struct ad_error *error);

/* Root mean square of the difference [n], relative to that of the reference. */
double path_distance(size_t n, const double *path, const double *reference);

#endif
