/* The one file that calls OpenBLAS and LAPACK. */
#include "blas.h"

#include <cblas.h>
#include <lapacke.h>
#include <limits.h>
#include <stdlib.h>

void ad_blas_gemm(enum ad_type type, bool transpose_a, bool transpose_b, size_t m, size_t n,
                  size_t k, const void *a, size_t lda, const void *b, size_t ldb, void *c,
                  size_t ldc)
{
    enum CBLAS_TRANSPOSE ta = transpose_a ? CblasTrans : CblasNoTrans;
    enum CBLAS_TRANSPOSE tb = transpose_b ? CblasTrans : CblasNoTrans;
    if (type == AD_F32)
        cblas_sgemm(CblasRowMajor, ta, tb, (blasint)m, (blasint)n, (blasint)k, 1, a, (blasint)lda,
                    b, (blasint)ldb, 0, c, (blasint)ldc);
    else
        cblas_dgemm(CblasRowMajor, ta, tb, (blasint)m, (blasint)n, (blasint)k, 1, a, (blasint)lda,
                    b, (blasint)ldb, 0, c, (blasint)ldc);
}

int ad_blas_single_thread(void)
{
    int before = openblas_get_num_threads();
    if (before != 1)
        openblas_set_num_threads(1);
    return before;
}

void ad_blas_threads(int before)
{
    if (before != 1)
        openblas_set_num_threads(before);
}

int ad_blas_solve(size_t n, double *a, double *b)
{
    if (n == 1) {
        if (a[0] == 0)
            return 1;
        b[0] /= a[0];
        return 0;
    }
    lapack_int pivots[128], *many = NULL, *p = pivots;
    if (n > sizeof pivots / sizeof *pivots) {
        many = malloc(n * sizeof *many);
        if (!many)
            return INT_MAX;
        p = many;
    }
    lapack_int info = LAPACKE_dgesv_work(LAPACK_COL_MAJOR, (lapack_int)n, 1, a, (lapack_int)n, p, b,
                                         (lapack_int)n);
    free(many);
    return (int)info;
}
