/* Matrix products and large systems (blas.h), and the number of threads of OpenBLAS. */
#include "blas.h"
#include "lazy.h"

#include <cblas.h>
#include <lapack.h>

#define cblas_dgemm AD_LAZY(ad_blas_load, cblas_dgemm)
#define cblas_sgemm AD_LAZY(ad_blas_load, cblas_sgemm)
#define cblas_dtrsm AD_LAZY(ad_blas_load, cblas_dtrsm)
#define cblas_strsm AD_LAZY(ad_blas_load, cblas_strsm)
#define dgetrf_ AD_LAZY(ad_blas_load, dgetrf_)
#define dpotrf_ AD_LAZY(ad_blas_load, dpotrf_)
#define sgetrf_ AD_LAZY(ad_blas_load, sgetrf_)
#define spotrf_ AD_LAZY(ad_blas_load, spotrf_)
#define openblas_get_num_threads AD_LAZY(load, openblas_get_num_threads)
#define openblas_set_num_threads AD_LAZY(load, openblas_set_num_threads)

#define MULTIPLY(T)                                                                                \
    for (size_t i = 0; i < m; i++) {                                                               \
        T *z = (T *)c + i * ldc;                                                                   \
        for (size_t j = 0; j < n && !add; j++)                                                     \
            z[j] = 0;                                                                              \
        for (size_t l = 0; l < k; l++) {                                                           \
            const T x = ((const T *)a)[i * row_a + l * col_a], *y = (const T *)b + l * row_b;      \
            if (transpose_b)                                                                       \
                for (size_t j = 0; j < n; j++)                                                     \
                    z[j] += x * y[j * ldb];                                                        \
            else                                                                                   \
                _Pragma("omp simd") for (size_t j = 0; j < n; j++) z[j] += x * y[j];               \
        }                                                                                          \
    }

void ad_blas_gemm(enum ad_type type, bool transpose_a, bool transpose_b, size_t m, size_t n,
                  size_t k, const void *a, size_t lda, const void *b, size_t ldb, bool add, void *c,
                  size_t ldc)
{
    /* A call of OpenBLAS takes as long as 256 multiplications; a product with a row of few numbers
       is bound by memory, and not worth loading it. */
    if ((double)m * (double)n * (double)k <= 256 || (m == 1 && k <= 8 && !transpose_b)) {
        size_t row_a = transpose_a ? 1 : lda, col_a = transpose_a ? lda : 1;
        size_t row_b = transpose_b ? 1 : ldb;
        if (type == AD_F32)
            MULTIPLY(float)
        else
            MULTIPLY(double)
        return;
    }
    enum CBLAS_TRANSPOSE ta = transpose_a ? CblasTrans : CblasNoTrans;
    enum CBLAS_TRANSPOSE tb = transpose_b ? CblasTrans : CblasNoTrans;
    if (type == AD_F32)
        cblas_sgemm(CblasRowMajor, ta, tb, (blasint)m, (blasint)n, (blasint)k, 1, a, (blasint)lda,
                    b, (blasint)ldb, add, c, (blasint)ldc);
    else
        cblas_dgemm(CblasRowMajor, ta, tb, (blasint)m, (blasint)n, (blasint)k, 1, a, (blasint)lda,
                    b, (blasint)ldb, add, c, (blasint)ldc);
}

void ad_blas_triangle(enum ad_type type, bool upper, bool transposed, bool unit, size_t n, size_t m,
                      const void *t, void *x, size_t ldx)
{
    const enum CBLAS_UPLO part = upper ? CblasUpper : CblasLower;
    const enum CBLAS_TRANSPOSE op = transposed ? CblasTrans : CblasNoTrans;
    const enum CBLAS_DIAG diagonal = unit ? CblasUnit : CblasNonUnit;
    const blasint rows = (blasint)n, cols = (blasint)m, ld = (blasint)ldx;
    if (type == AD_F32)
        cblas_strsm(CblasRowMajor, CblasLeft, part, op, diagonal, rows, cols, 1, t, rows, x, ld);
    else
        cblas_dtrsm(CblasRowMajor, CblasLeft, part, op, diagonal, rows, cols, 1, t, rows, x, ld);
}

_Static_assert(sizeof(lapack_int) == sizeof(int), "pivots are int");

/* LAPACK goes by columns: it sees a^T = P l' u', the upper triangle where rows have the lower. */
bool ad_blas_factor(enum ad_type type, bool cholesky, size_t n, void *a, int *pivot)
{
    const lapack_int side = (lapack_int)n;
    lapack_int info;
    if (cholesky && type == AD_F32)
        LAPACK_spotrf("U", &side, a, &side, &info);
    else if (cholesky)
        LAPACK_dpotrf("U", &side, a, &side, &info);
    else if (type == AD_F32)
        LAPACK_sgetrf(&side, &side, a, &side, pivot, &info);
    else
        LAPACK_dgetrf(&side, &side, a, &side, pivot, &info);
    return info == 0;
}

static void *load(void **slot, const char *name)
{
    return ad_lazy_load(slot, AD_LIBRARY_openblas, name);
}

/* The number of threads is global to OpenBLAS. Programs may run at the same time: the first sets it
   to 1, the last restores it; if OpenBLAS is not loaded yet, loading it sets it. */
static int users, threads_before = 1;
static bool loaded;

static void keep_to_one_thread(void)
{
    threads_before = openblas_get_num_threads();
    if (threads_before != 1)
        openblas_set_num_threads(1);
}

void *ad_blas_load(void **slot, const char *name)
{
#pragma omp critical(ad_blas)
    {
        if (!loaded && users > 0)
            keep_to_one_thread();
        loaded = true;
    }
    return load(slot, name);
}

void ad_blas_single_thread(void)
{
#pragma omp critical(ad_blas)
    if (users++ == 0 && loaded)
        keep_to_one_thread();
}

void ad_blas_threads(void)
{
#pragma omp critical(ad_blas)
    if (--users == 0 && loaded && threads_before != 1)
        openblas_set_num_threads(threads_before);
}
