/* Matrix products and large linear systems by OpenBLAS, the only calls of BLAS and LAPACK of the
   tape. Matrices are row-major. */
#ifndef AUTODIFF_BLAS_H
#define AUTODIFF_BLAS_H

#include "autodiff.h"

/* c [m x n] = op(a) [m x k] op(b) [k x n], or c += that; ld*: row strides in elements. */
void ad_blas_gemm(enum ad_type type, bool transpose_a, bool transpose_b, size_t m, size_t n,
                  size_t k, const void *a, size_t lda, const void *b, size_t ldb, bool add, void *c,
                  size_t ldc);

/* x [n x m] = op(t)^-1 x, t [n x n] triangular; `unit`: with a diagonal of 1. */
void ad_blas_triangle(enum ad_type type, bool upper, bool transposed, bool unit, size_t n, size_t m,
                      const void *t, void *x, size_t ldx);
/* Factors a [n x n] in place, of Cholesky, a = l l^T, or a = l u P^T, u with a diagonal of 1, where
   P swaps rows k and pivot[k] - 1, the last k first. False where a pivot is 0 or not positive. */
bool ad_blas_factor(enum ad_type type, bool cholesky, size_t n, void *a, int *pivot);

/* For other functions of OpenBLAS, by AD_LAZY (lazy.h). */
void *ad_blas_load(void **slot, const char *name);

/* Between these two calls OpenBLAS runs on one thread: programs split products themselves, into the
   same pieces whatever the number of threads. Calls come in pairs, from any thread. */
void ad_blas_single_thread(void);
void ad_blas_threads(void);

#endif
