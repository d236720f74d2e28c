/* Helpers for tests of the tape: reproducible values, evaluation in one call, checks of a gradient.
 */
#ifndef TESTS_AUTODIFF_SUPPORT_H
#define TESTS_AUTODIFF_SUPPORT_H

#include "autodiff/autodiff.h"
#include "tests/close.h"

/* splitmix64: any seed will do. */
uint64_t random_bits(uint64_t *state);
double uniform(uint64_t *state, double lo, double hi);
size_t below(uint64_t *state, size_t n);
/* n values in [lo, hi) representable in f32, so that both types see the same; the caller frees. */
double *random_values(uint64_t *state, size_t n, double lo, double hi);

/* A program of these outputs; fails the test with the tape's message if it does not compile. */
ad_program *compile(ad_tape *tape, size_t n, const ad_var out[]);
/* Value of y (rows*cols) at x[k] = at[k]; the caller frees. */
double *evaluate(ad_var y, size_t n, const ad_var x[], const double *const at[]);
/* The same for a value without inputs, or of 1x1. */
double evaluate_scalar(ad_var y, size_t n, const ad_var x[], const double *const at[]);

/* The value (order 0) or derivative of this order of f at x. */
typedef ad_var function(ad_var x);
double derivative(function *f, int order, double x);
/* a ~ b to rounding, where b may be infinite or NaN. */
void assert_same(double a, double b, const char *what);

static inline size_t size_of(ad_var x) { return ad_rows(x) * ad_cols(x); }

/* Sum of y's elements times fixed irregular weights: a scalar in which every element counts. */
ad_var weighted_sum(ad_var y);

/* ad_check_gradient and ad_check_second; a failure prints the worst entry and `name`. */
void assert_gradient(const char *name, ad_var y, size_t n, const ad_var x[],
                     const double *const at[], double tolerance, size_t entries);
void assert_second(const char *name, ad_var y, size_t n, const ad_var x[], const double *const at[],
                   double tolerance, size_t entries);

/* Runs f with the kernels of every instruction set this machine has. */
void for_each_isa(void (*f)(void));

void assert_tape_ok(const ad_tape *tape);

#endif
