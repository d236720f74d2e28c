/* Ranks as threads of one process. */
#ifndef TESTS_RANKS_H
#define TESTS_RANKS_H

#include "autodiff/ranks.h"

/* Calls work(context, ranks) on each of `count` ranks at once, and waits for all. No assertions
   inside: they belong to the thread of the test. */
void with_ranks(size_t count, void (*work)(void *context, struct ad_ranks *ranks), void *context);

#endif
