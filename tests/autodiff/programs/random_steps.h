/* Steps of a random recording (random_tape.h): values recorded so far, and one more. */
#ifndef TESTS_AUTODIFF_PROGRAMS_RANDOM_STEPS_H
#define TESTS_AUTODIFF_PROGRAMS_RANDOM_STEPS_H

#include "random_tape.h"

#include "tests/autodiff/support.h"

#include <math.h>

struct maker {
    struct random_tape *r;
    uint64_t random;
    size_t rows, cols, n, max;
    size_t most; /* elements of a value */
    ad_var *pool;
};

static inline size_t pick(struct maker *m, size_t n) { return below(&m->random, n); }

static inline double number(struct maker *m, double lo, double hi)
{
    return (float)uniform(&m->random, lo, hi);
}

static inline bool fits(size_t a, size_t b) { return a == b || a == 1 || b == 1; }
static inline size_t larger(size_t a, size_t b) { return a > b ? a : b; }

/* x in [lo, hi], by a factor and a shift where it is not. */
ad_var maker_into(struct maker *m, ad_var x, double lo, double hi);
/* Adds a value, made finite and of order one. */
void maker_keep(struct maker *m, ad_var x);
/* Recent values more often; old ones so that they live long. */
ad_var maker_any(struct maker *m);
/* A value that goes with a in an operation on elements. */
ad_var maker_partner(struct maker *m, ad_var a);
/* One of `smooth` operations, 0: any, may need a value whole: few of them make long segments. */
void random_step(struct maker *m, size_t smooth);

#endif
