/* Seconds of clocks, from arbitrary origins. */
#ifndef AUTODIFF_CLOCK_H
#define AUTODIFF_CLOCK_H

#include <time.h>

static inline double ad_seconds_of(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline double ad_now(void) { return ad_seconds_of(CLOCK_MONOTONIC); }

/* CPU time of this thread. */
static inline double ad_thread_seconds(void) { return ad_seconds_of(CLOCK_THREAD_CPUTIME_ID); }

#endif
