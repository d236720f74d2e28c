/* The one door to OpenBLAS and LAPACK. Matrices are row-major. */
#ifndef AUTODIFF_BLAS_H
#define AUTODIFF_BLAS_H

#include "autodiff.h"

/* c [m x n] = op(a) [m x k] op(b) [k x n]; ld*: row strides in elements. */
void ad_blas_gemm(enum ad_type type, bool transpose_a, bool transpose_b, size_t m, size_t n,
                  size_t k, const void *a, size_t lda, const void *b, size_t ldb, void *c,
                  size_t ldc);

/* OpenBLAS runs on one thread until ad_blas_threads(before): programs split products themselves, in
   the same pieces whatever the number of threads. Returns the number before. */
int ad_blas_single_thread(void);
void ad_blas_threads(int before);

/* Solves a x = b for one right side: a [n x n] is destroyed, b [n] becomes x. Returns 0, or 1 + the
   index of the zero pivot. */
int ad_blas_solve(size_t n, double *a, double *b);

#endif
