/* What a second thread buys; a part of `leastaction chart linear`. */
#ifndef APPS_BENCH_CHART_THREADS_H
#define APPS_BENCH_CHART_THREADS_H

#include "chart.h"

/* Gradients and a training step on one thread and on two: threads.csv. The chart is missed where a
   second thread changes a bit. */
enum ad_status chart_threads(struct chart *chart, struct ad_error *error);

#endif
