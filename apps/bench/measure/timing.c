/* Timing of short jobs (timing.h), in many batches, each long enough for the clock and short enough
   to avoid most interruptions. */
#include "timing.h"
#include "autodiff/ascending.h"
#include "autodiff/autodiff.h"
#include "autodiff/clock.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double batch_ns = 2e5;
static const double cold_ns = 1e7; /* a first call may take so much longer than those after it:
                                      pages to touch, threads to wake */

enum { MAX_JOBS = 8 };

/* The first call of several is not counted: it finds the caches as the other jobs left them,
   perhaps full of lines that are yet to be written to memory. */
static double batch(const struct timed *job, size_t calls)
{
    double (*clock)(void) = job->processor ? processor_seconds : ad_now;
    if (calls > 1)
        job->run(job->context);
    double start = clock();
    for (size_t k = 0; k < calls; k++)
        job->run(job->context);
    return 1e9 * (clock() - start) / (double)calls;
}

static size_t calls_in_a_batch(const struct timed *job)
{
    double ns = batch(job, 1);
    if (ns < cold_ns)
        ns = batch(job, 1);
    if (ns > batch_ns)
        return ns > cold_ns ? 1 : 2;
    ns = batch(job, 2 + (size_t)(batch_ns / (ns + 1)));
    return 1 + (size_t)(batch_ns / ns);
}

static double ranked(size_t rank, size_t n, const double values[])
{
    double sorted[TIMING_ROUNDS];
    memcpy(sorted, values, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, ad_ascending);
    return sorted[rank];
}

void time_program(void *program) { ad_run(program); }

void time_in_turn(size_t n, struct timed jobs[], size_t rounds)
{
    size_t calls[MAX_JOBS];
    assert(n <= MAX_JOBS && 0 < rounds && rounds <= TIMING_ROUNDS);
    for (size_t j = 0; j < n; j++)
        calls[j] = calls_in_a_batch(&jobs[j]);
    for (size_t r = 0; r < rounds; r++)
        for (size_t j = 0; j < n; j++)
            jobs[j].batch[r] = batch(&jobs[j], calls[j]);
    for (size_t j = 0; j < n; j++)
        jobs[j].nanoseconds = ranked(rounds / 4, rounds, jobs[j].batch);
}

double time_least(const struct timed *job, size_t rounds) { return ranked(0, rounds, job->batch); }

double time_median(size_t n, const double values[]) { return ranked(n / 2, n, values); }

double time_ratio(const struct timed *a, const struct timed *b, size_t rounds)
{
    double ratio[TIMING_ROUNDS];
    assert(0 < rounds && rounds <= TIMING_ROUNDS);
    for (size_t r = 0; r < rounds; r++)
        ratio[r] = a->batch[r] / b->batch[r];
    return time_median(rounds, ratio);
}

double processor_seconds(void) { return ad_seconds_of(CLOCK_PROCESS_CPUTIME_ID); }
