/* The one file of the tape that calls OpenBLAS. */
#include "blas.h"

#include <cblas.h>

void ad_blas_gemm(enum ad_type type, bool transpose_a, bool transpose_b, size_t m, size_t n,
                  size_t k, const void *a, size_t lda, const void *b, size_t ldb, bool add, void *c,
                  size_t ldc)
{
    enum CBLAS_TRANSPOSE ta = transpose_a ? CblasTrans : CblasNoTrans;
    enum CBLAS_TRANSPOSE tb = transpose_b ? CblasTrans : CblasNoTrans;
    if (type == AD_F32)
        cblas_sgemm(CblasRowMajor, ta, tb, (blasint)m, (blasint)n, (blasint)k, 1, a, (blasint)lda,
                    b, (blasint)ldb, add, c, (blasint)ldc);
    else
        cblas_dgemm(CblasRowMajor, ta, tb, (blasint)m, (blasint)n, (blasint)k, 1, a, (blasint)lda,
                    b, (blasint)ldb, add, c, (blasint)ldc);
}

/* The number of threads is OpenBLAS's own global. Programs may run side by side: the first to come
   sets it, the last to leave puts it back. */
static int users, threads_before;

void ad_blas_single_thread(void)
{
#pragma omp critical(ad_blas)
    if (users++ == 0) {
        threads_before = openblas_get_num_threads();
        if (threads_before != 1)
            openblas_set_num_threads(1);
    }
}

void ad_blas_threads(void)
{
#pragma omp critical(ad_blas)
    if (--users == 0 && threads_before != 1)
        openblas_set_num_threads(threads_before);
}
