/* Ranks as threads of one process. */
#ifndef APPS_BENCH_MEASURE_THREAD_RANKS_H
#define APPS_BENCH_MEASURE_THREAD_RANKS_H

#include "autodiff/ranks.h"

/* Calls work(context, ranks) on each of `count` ranks at once, and waits for all; 0: here, with
   NULL. No assertions inside: they belong to the thread of the test. */
void with_ranks(size_t count, void (*work)(void *context, struct ad_ranks *ranks), void *context);

#endif
