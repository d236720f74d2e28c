/* Timing of short jobs, alternating between them. */
#ifndef APPS_BENCH_MEASURE_TIMING_H
#define APPS_BENCH_MEASURE_TIMING_H

#include <stdbool.h>
#include <stddef.h>

enum { TIMING_ROUNDS = 101, TIMING_SOME = 15, TIMING_QUICK = 5 };

/* A job that runs an ad_program, its context. */
void time_program(void *program);

struct timed {
    void (*run)(void *context);
    void *context;
    bool processor;              /* by the processor's clock, all threads together: what a busy
                                    machine changes less; false: by the wall's */
    double nanoseconds;          /* of one call: the lower quartile of the batches, for what
                                    disturbs a batch makes it longer, never shorter; the shortest
                                    are those of a processor that ran faster for a moment */
    double batch[TIMING_ROUNDS]; /* of one call in each of them */
};

/* Times jobs[0..n-1] in turn, a batch of each per round, so that what disturbs the machine disturbs
   all of them alike. At most TIMING_ROUNDS rounds. */
void time_in_turn(size_t n, struct timed jobs[], size_t rounds);

/* Of the batches of a job so timed, the least: what other work on the machine disturbs least. */
double time_least(const struct timed *job, size_t rounds);

/* How much longer a takes than b, timed in turn with it: the median over rounds, where what
   disturbed the machine disturbed both. */
double time_ratio(const struct timed *a, const struct timed *b, size_t rounds);

/* Of 1 to TIMING_ROUNDS values. */
double time_median(size_t n, const double values[]);

/* Of this process so far, all threads together: what a busy machine does not change. */
double processor_seconds(void);

#endif
