/* Matrix products by OpenBLAS, the only BLAS calls of the tape. Matrices are row-major. */
#ifndef AUTODIFF_BLAS_H
#define AUTODIFF_BLAS_H

#include "autodiff.h"

/* c [m x n] = op(a) [m x k] op(b) [k x n], or c += that; ld*: row strides in elements. */
void ad_blas_gemm(enum ad_type type, bool transpose_a, bool transpose_b, size_t m, size_t n,
                  size_t k, const void *a, size_t lda, const void *b, size_t ldb, bool add, void *c,
                  size_t ldc);

/* For other functions of OpenBLAS, by AD_LAZY (lazy.h). */
void *ad_blas_load(void **slot, const char *name);

/* Between these two calls OpenBLAS runs on one thread: programs split products themselves, into the
   same pieces whatever the number of threads. Calls come in pairs, from any thread. */
void ad_blas_single_thread(void);
void ad_blas_threads(void);

#endif
