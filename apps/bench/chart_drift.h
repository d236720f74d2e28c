/* Energy over many periods at equal work: part of `leastaction chart integrators`. */
#ifndef APPS_CHART_DRIFT_H
#define APPS_CHART_DRIFT_H

#include "chart.h"

/* drift.csv and its picture: an ellipse of e = 0.6 over 1000 periods. */
enum ad_status chart_drift(struct chart *chart, struct ad_error *error);

#endif
