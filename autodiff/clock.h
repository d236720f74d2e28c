/* Seconds of a monotonic clock, from an arbitrary origin. */
#ifndef AUTODIFF_CLOCK_H
#define AUTODIFF_CLOCK_H

#include <time.h>

static inline double ad_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds of CPU time of this thread. */
static inline double ad_thread_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#endif
