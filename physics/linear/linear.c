/* Linear algebra by LAPACK (linear.h): the one file that calls it. */
#include "linear.h"

#include <cblas.h>
#include <lapacke.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>

void phys_lapack_gemm_complex(bool transpose_b, size_t m, size_t n, size_t k, const double *a,
                              const double *b, double *c)
{
    static const double one[2] = {1, 0}, zero[2] = {0, 0};
    blasint rows = (blasint)m, cols = (blasint)n, inner = (blasint)k;
    if (n == 1) /* b is a vector either way */
        cblas_zgemv(CblasRowMajor, CblasNoTrans, rows, inner, one, a, inner, b, 1, zero, c, 1);
    else
        cblas_zgemm(CblasRowMajor, CblasNoTrans, transpose_b ? CblasTrans : CblasNoTrans, rows,
                    cols, inner, one, a, inner, b, transpose_b ? inner : cols, zero, c, cols);
}

_Static_assert(sizeof(lapack_int) == sizeof(int), "pivots are int");

/* By columns it is the transpose that is factored. */
int phys_lapack_lu_factor(size_t n, double *a, int *pivots)
{
    lapack_int size = (lapack_int)n;
    return LAPACKE_dgetrf_work(LAPACK_COL_MAJOR, size, size, a, size, pivots);
}

void phys_lapack_lu_solve(size_t n, const double *a, const int *pivots, double *b)
{
    lapack_int size = (lapack_int)n;
    LAPACKE_dgetrs_work(LAPACK_COL_MAJOR, 'T', size, 1, a, size, pivots, b, size);
}

int phys_lapack_lu_solve_once(size_t n, double *a, double *b)
{
    if (n == 1) {
        if (a[0] == 0)
            return 1;
        b[0] /= a[0];
        return 0;
    }
    int pivots[128], *many = NULL, *p = pivots;
    if (n > sizeof pivots / sizeof *pivots) {
        many = malloc(n * sizeof *many);
        if (!many)
            return INT_MAX;
        p = many;
    }
    int info = phys_lapack_lu_factor(n, a, p);
    if (info == 0)
        phys_lapack_lu_solve(n, a, p, b);
    free(many);
    return info;
}

int phys_lapack_band_factor(size_t n, size_t width, double *band, int *pivots)
{
    lapack_int w = (lapack_int)width, size = (lapack_int)n;
    return LAPACKE_dgbtrf_work(LAPACK_COL_MAJOR, size, size, w, w, band, PHYS_BAND_ROWS(w), pivots);
}

void phys_lapack_band_solve(size_t n, size_t width, const double *band, const int *pivots,
                            double *b)
{
    lapack_int w = (lapack_int)width, size = (lapack_int)n;
    LAPACKE_dgbtrs_work(LAPACK_COL_MAJOR, 'N', size, w, w, 1, band, PHYS_BAND_ROWS(w), pivots, b,
                        size);
}

int phys_lapack_band_factor_complex(size_t n, size_t width, double *band, int *pivots)
{
    lapack_int size = (lapack_int)n, w = (lapack_int)width;
    return LAPACKE_zgbtrf_work(LAPACK_COL_MAJOR, size, size, w, w, (lapack_complex_double *)band,
                               PHYS_BAND_ROWS(w), pivots);
}

void phys_lapack_band_solve_complex(size_t n, size_t width, const double *band, const int *pivots,
                                    double *b)
{
    lapack_int size = (lapack_int)n, w = (lapack_int)width;
    LAPACKE_zgbtrs_work(LAPACK_COL_MAJOR, 'N', size, w, w, 1, (const lapack_complex_double *)band,
                        PHYS_BAND_ROWS(w), pivots, (lapack_complex_double *)b, size);
}

int phys_lapack_complex_factor(size_t n, double *a, int *pivots)
{
    lapack_int size = (lapack_int)n;
    return LAPACKE_zgetrf_work(LAPACK_COL_MAJOR, size, size, (lapack_complex_double *)a, size,
                               pivots);
}

void phys_lapack_complex_solve(size_t n, const double *a, const int *pivots, size_t m, double *b)
{
    lapack_int size = (lapack_int)n;
    LAPACKE_zgetrs_work(LAPACK_COL_MAJOR, 'N', size, (lapack_int)m,
                        (const lapack_complex_double *)a, size, pivots, (lapack_complex_double *)b,
                        size);
}

void phys_lapack_complex_eliminate(size_t n, const double *a, const int *pivots, size_t k, size_t m,
                                   double *b, double *work, double *c)
{
    const double one[] = {1, 0}, minus_one[] = {-1, 0};
    const size_t at = n - k;
    blasint size = (blasint)n, columns = (blasint)m, last = (blasint)k;
    cblas_zcopy((blasint)(n * m), b, 1, work, 1);
    LAPACKE_zlaswp_work(LAPACK_COL_MAJOR, columns, (lapack_complex_double *)work, size, 1, size,
                        pivots, 1);
    cblas_ztrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasUnit, size, columns, one,
                a, size, work, size);
    cblas_ztrsm(CblasColMajor, CblasLeft, CblasUpper, CblasTrans, CblasNonUnit, last, columns, one,
                a + 2 * (at * n + at), size, b + 2 * at, size);
    cblas_zgemm(CblasColMajor, CblasTrans, CblasNoTrans, columns, columns, last, minus_one,
                b + 2 * at, size, work + 2 * at, size, one, c, columns);
}

int phys_lapack_tridiagonal_factor_complex(size_t n, double *below, double *diagonal, double *above,
                                           double *second, int *pivots)
{
    return LAPACKE_zgttrf_work((lapack_int)n, (lapack_complex_double *)below,
                               (lapack_complex_double *)diagonal, (lapack_complex_double *)above,
                               (lapack_complex_double *)second, pivots);
}

void phys_lapack_tridiagonal_solve_complex(size_t n, const double *below, const double *diagonal,
                                           const double *above, const double *second,
                                           const int *pivots, size_t m, double *b)
{
    LAPACKE_zgttrs_work(
        LAPACK_COL_MAJOR, 'N', (lapack_int)n, (lapack_int)m, (const lapack_complex_double *)below,
        (const lapack_complex_double *)diagonal, (const lapack_complex_double *)above,
        (const lapack_complex_double *)second, pivots, (lapack_complex_double *)b, (lapack_int)n);
}

int phys_lapack_tridiagonal_eigenvectors(size_t n, double *diagonal, double *off, size_t count,
                                         double *values, double *vectors)
{
    lapack_int found, *support = malloc(2 * n * sizeof *support);
    double *all = malloc(n * sizeof *all); /* LAPACK wants room for every one of them */
    int info = LAPACK_WORK_MEMORY_ERROR;
    if (support && all)
        info = LAPACKE_dstevr(LAPACK_COL_MAJOR, 'V', 'I', (lapack_int)n, diagonal, off, 0, 0, 1,
                              (lapack_int)count, 0, &found, all, vectors, (lapack_int)n, support);
    for (size_t k = 0; info == 0 && k < count; k++)
        values[k] = all[k];
    free(support);
    free(all);
    return info;
}

int phys_lapack_symmetric_factor(size_t n, double *a, int *pivots, double *work)
{
    lapack_int size = (lapack_int)n;
    if (n == 1) {
        pivots[0] = 1;
        return a[0] == 0;
    }
    return LAPACKE_dsytrf_work(LAPACK_COL_MAJOR, 'L', size, a, size, pivots, work, 64 * size);
}

size_t phys_lapack_symmetric_inertia(size_t n, const double *a, const int *pivots)
{
    size_t negative = 0;
    for (size_t k = 0; k < n; k++) {
        double d = a[k * n + k], det = d;
        if (pivots[k] < 0) { /* a 2 x 2 pivot: one eigenvalue of either sign */
            double off = a[k * n + k + 1];
            det = (d / off * a[(k + 1) * n + k + 1] - off) * off;
            k++;
        }
        negative += det < 0;
    }
    return negative;
}

void phys_lapack_symmetric_solve(size_t n, const double *a, const int *pivots, size_t m, double *b)
{
    lapack_int size = (lapack_int)n;
    if (n == 1)
        for (size_t k = 0; k < m; k++)
            b[k] /= a[0];
    else
        LAPACKE_dsytrs_work(LAPACK_COL_MAJOR, 'L', size, (lapack_int)m, a, size, pivots, b, size);
}

int phys_lapack_eigenvectors(size_t n, double *a, double *b, double *values)
{
    lapack_int size = (lapack_int)n;
    return LAPACKE_dsygv(LAPACK_COL_MAJOR, 1, 'V', 'L', size, a, size, b, size, values);
}

/* By columns the rows are a matrix that is factored as Q R; the signs are those of a positive R. */
bool phys_lapack_orthonormal_rows(size_t n, size_t length, double *a, double *work)
{
    lapack_int columns = (lapack_int)n, size = (lapack_int)length;
    double *sign = work + n;
    if (LAPACKE_dgeqrf(LAPACK_COL_MAJOR, size, columns, a, size, work) != 0)
        return false;
    for (size_t k = 0; k < n; k++)
        sign[k] = a[k * length + k] < 0 ? -1 : 1;
    if (LAPACKE_dorgqr(LAPACK_COL_MAJOR, size, columns, columns, a, size, work) != 0)
        return false;
    for (size_t k = 0; k < n * length; k++)
        a[k] *= sign[k / length];
    return true;
}
