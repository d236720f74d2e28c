/* An operation of one's own, for tests: y_i = tanh(x_i + x_(i+1)/2) of the rows of x, which are a
   ring. */
#ifndef TESTS_AUTODIFF_RING_H
#define TESTS_AUTODIFF_RING_H

#include "autodiff/autodiff.h"

enum { RING_MOST = 64 };

/* Of `rows` rows, at most RING_MOST. */
struct ad_custom ring_operation(size_t rows);
ad_var ring(ad_var x);
/* y_i by definition, of column c of a rows x cols matrix; element i of its adjoint. */
double ring_element(const double *x, size_t rows, size_t cols, size_t i, size_t c);
double ring_adjoint_element(const double *y, const double *gy, size_t rows, size_t cols, size_t i,
                            size_t c);

#endif
