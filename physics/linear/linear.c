/* Linear algebra by the LAPACK inside OpenBLAS (linear.h): the one file that calls it. */
#include "linear.h"
#include "autodiff/free.h"
#include "autodiff/blas.h"
#include "autodiff/lazy.h"

#include <cblas.h>
#include <complex.h>
#include <lapack.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define cblas_dgemm AD_LAZY(ad_blas_load, cblas_dgemm)
#define cblas_dgemv AD_LAZY(ad_blas_load, cblas_dgemv)
#define cblas_dtrsm AD_LAZY(ad_blas_load, cblas_dtrsm)
#define cblas_zgemm AD_LAZY(ad_blas_load, cblas_zgemm)
#define cblas_zgemv AD_LAZY(ad_blas_load, cblas_zgemv)
#define cblas_ztrsm AD_LAZY(ad_blas_load, cblas_ztrsm)
#define dgbtrf_ AD_LAZY(ad_blas_load, dgbtrf_)
#define dgbtrs_ AD_LAZY(ad_blas_load, dgbtrs_)
#define dgeev_ AD_LAZY(ad_blas_load, dgeev_)
#define dgesvd_ AD_LAZY(ad_blas_load, dgesvd_)
#define dgeqrf_ AD_LAZY(ad_blas_load, dgeqrf_)
#define dgetrf_ AD_LAZY(ad_blas_load, dgetrf_)
#define dgetrs_ AD_LAZY(ad_blas_load, dgetrs_)
#define dlaswp_ AD_LAZY(ad_blas_load, dlaswp_)
#define dorgqr_ AD_LAZY(ad_blas_load, dorgqr_)
#define dstevr_ AD_LAZY(ad_blas_load, dstevr_)
#define dsygv_ AD_LAZY(ad_blas_load, dsygv_)
#define dsytrf_ AD_LAZY(ad_blas_load, dsytrf_)
#define dsytrs_ AD_LAZY(ad_blas_load, dsytrs_)
#define zgbtrf_ AD_LAZY(ad_blas_load, zgbtrf_)
#define zgbtrs_ AD_LAZY(ad_blas_load, zgbtrs_)
#define zgetrf_ AD_LAZY(ad_blas_load, zgetrf_)
#define zgetrs_ AD_LAZY(ad_blas_load, zgetrs_)
#define zgttrf_ AD_LAZY(ad_blas_load, zgttrf_)
#define zgttrs_ AD_LAZY(ad_blas_load, zgttrs_)
#define zlaswp_ AD_LAZY(ad_blas_load, zlaswp_)

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
static const lapack_int one = 1;

/* ---- LU ---- */

/* Element (i, j) of a narrow system is a[i * row + j * column], up to `width` below and 2 width
   above the diagonal, of which pivoting fills the upper half. */
enum { NARROW = 40 };
struct narrow {
    size_t n, width, row, column;
};

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

#define NUMBER double
#define NAME(f) narrow_##f
#define SIZE(x) fabs(x)
#define TIMES(x, y) ((x) * (y))
#include "narrow.h"

/* Without the search for infinities of C's product. */
static double complex times(double complex x, double complex y)
{
    return creal(x) * creal(y) - cimag(x) * cimag(y) +
           I * (creal(x) * cimag(y) + cimag(x) * creal(y));
}

#define NUMBER double complex
#define NAME(f) narrow_complex_##f
#define SIZE(x) (fabs(creal(x)) + fabs(cimag(x))) /* as LAPACK orders them */
#define TIMES(x, y) times(x, y)
#include "narrow.h"

static struct narrow by_rows(size_t n) { return (struct narrow){n, n - 1, n, 1}; }
static struct narrow by_columns(size_t n) { return (struct narrow){n, n - 1, 1, n}; }

/* By columns it is the transpose that LAPACK factors. */
int phys_lapack_lu_factor(size_t n, double *a, int *pivots)
{
    if (n <= NARROW)
        return narrow_factor(by_rows(n), a, pivots);
    lapack_int size = (lapack_int)n, info;
    LAPACK_dgetrf(&size, &size, a, &size, pivots, &info);
    return info;
}

int phys_lapack_lu_sign(size_t n, double *a, int *pivots)
{
    int sign = phys_lapack_lu_factor(n, a, pivots) == 0;
    for (size_t i = 0; i < n; i++)
        if ((pivots[i] == (int)i + 1) != (a[i * n + i] > 0))
            sign = -sign;
    return sign;
}

void phys_lapack_lu_solve(size_t n, const double *a, const int *pivots, double *b)
{
    lapack_int size = (lapack_int)n, info;
    if (n <= NARROW)
        narrow_solve(by_rows(n), a, pivots, b);
    else
        LAPACK_dgetrs("T", &size, &one, a, &size, pivots, b, &size, &info);
}

int phys_lapack_lu_solve_once(size_t n, double *a, double *b)
{
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

/* A narrow band, whose element (0, 0) has 2 width numbers before it. */
static struct narrow banded(size_t n, size_t width)
{
    return (struct narrow){n, width, 1, PHYS_BAND_ROWS(width) - 1};
}

int phys_lapack_band_factor(size_t n, size_t width, double *band, int *pivots)
{
    if (width <= NARROW)
        return narrow_factor(banded(n, width), band + 2 * width, pivots);
    lapack_int w = (lapack_int)width, size = (lapack_int)n, rows = PHYS_BAND_ROWS(w), info;
    LAPACK_dgbtrf(&size, &size, &w, &w, band, &rows, pivots, &info);
    return info;
}

void phys_lapack_band_solve(size_t n, size_t width, const double *band, const int *pivots,
                            double *b)
{
    lapack_int w = (lapack_int)width, size = (lapack_int)n, rows = PHYS_BAND_ROWS(w), info;
    if (width <= NARROW)
        narrow_solve(banded(n, width), band + 2 * width, pivots, b);
    else
        LAPACK_dgbtrs("N", &size, &w, &w, &one, band, &rows, pivots, b, &size, &info);
}

int phys_lapack_band_factor_complex(size_t n, size_t width, double *band, int *pivots)
{
    if (width <= NARROW)
        return narrow_complex_factor(banded(n, width), band + 4 * width, pivots);
    lapack_int w = (lapack_int)width, size = (lapack_int)n, rows = PHYS_BAND_ROWS(w), info;
    LAPACK_zgbtrf(&size, &size, &w, &w, (lapack_complex_double *)band, &rows, pivots, &info);
    return info;
}

void phys_lapack_band_solve_complex(size_t n, size_t width, const double *band, const int *pivots,
                                    double *b)
{
    lapack_int w = (lapack_int)width, size = (lapack_int)n, rows = PHYS_BAND_ROWS(w), info;
    if (width <= NARROW)
        narrow_complex_solve(banded(n, width), band + 4 * width, pivots, b);
    else
        LAPACK_zgbtrs("N", &size, &w, &w, &one, (const lapack_complex_double *)band, &rows, pivots,
                      (lapack_complex_double *)b, &size, &info);
}

int phys_lapack_block_factor(bool with_i, size_t n, double *a, int *pivots)
{
    lapack_int size = (lapack_int)n, info;
    if (n <= NARROW)
        return (with_i ? narrow_complex_factor : narrow_factor)(by_columns(n), a, pivots);
    if (with_i)
        LAPACK_zgetrf(&size, &size, (lapack_complex_double *)a, &size, pivots, &info);
    else
        LAPACK_dgetrf(&size, &size, a, &size, pivots, &info);
    return info;
}

void phys_lapack_block_solve(bool with_i, size_t n, const double *a, const int *pivots, double *b)
{
    lapack_int size = (lapack_int)n, info;
    if (n <= NARROW)
        (with_i ? narrow_complex_solve : narrow_solve)(by_columns(n), a, pivots, b);
    else if (with_i)
        LAPACK_zgetrs("N", &size, &one, (const lapack_complex_double *)a, &size, pivots,
                      (lapack_complex_double *)b, &size, &info);
    else
        LAPACK_dgetrs("N", &size, &one, a, &size, pivots, b, &size, &info);
}

void phys_lapack_block_subtract(bool with_i, bool transpose, size_t size, const double *a,
                                const double *x, double *y)
{
    const double unit[] = {1, 0}, minus_unit[] = {-1, 0};
    blasint n = (blasint)size;
    CBLAS_TRANSPOSE op = transpose ? CblasTrans : CblasNoTrans;
    if (size <= NARROW)
        (with_i ? narrow_complex_subtract
                : narrow_subtract)(transpose ? by_rows(size) : by_columns(size), a, x, y);
    else if (with_i)
        cblas_zgemv(CblasColMajor, op, n, n, minus_unit, a, n, x, 1, unit, y, 1);
    else
        cblas_dgemv(CblasColMajor, op, n, n, -1, a, n, x, 1, 1, y, 1);
}

/* b becomes L^-1 P^-1 b for m columns. */
static void forward(bool with_i, blasint n, const double *a, const int *pivots, blasint m,
                    double *b)
{
    const double unit[] = {1, 0};
    if (n <= NARROW) { /* whose L is not LAPACK's */
        (with_i ? narrow_complex_forward_all : narrow_forward_all)(by_columns((size_t)n), a, pivots,
                                                                   (size_t)m, b);
    } else if (with_i) {
        LAPACK_zlaswp(&m, (lapack_complex_double *)b, &n, &one, &n, pivots, &one);
        cblas_ztrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasUnit, n, m, unit, a, n,
                    b, n);
    } else {
        LAPACK_dlaswp(&m, b, &n, &one, &n, pivots, &one);
        cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasUnit, n, m, 1, a, n, b,
                    n);
    }
}

void phys_lapack_block_eliminate(bool with_i, size_t size, const double *a, const int *pivots,
                                 size_t columns, double *b, double *work, double *c)
{
    const double unit[] = {1, 0}, minus_unit[] = {-1, 0};
    blasint n = (blasint)size, m = (blasint)columns;
    memcpy(work, b, (with_i ? 2 : 1) * size * columns * sizeof *b);
    if (size <= NARROW && columns <= NARROW) {
        (with_i ? narrow_complex_eliminate : narrow_eliminate)(by_columns(size), a, pivots, columns,
                                                               b, work, c);
        return;
    }
    forward(with_i, n, a, pivots, m, work);
    if (with_i) {
        cblas_ztrsm(CblasColMajor, CblasLeft, CblasUpper, CblasTrans, CblasNonUnit, n, m, unit, a,
                    n, b, n);
        cblas_zgemm(CblasColMajor, CblasTrans, CblasNoTrans, m, m, n, minus_unit, b, n, work, n,
                    unit, c, m);
    } else {
        cblas_dtrsm(CblasColMajor, CblasLeft, CblasUpper, CblasTrans, CblasNonUnit, n, m, 1, a, n,
                    b, n);
        cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, m, m, n, -1, b, n, work, n, 1, c, m);
    }
}

int phys_lapack_tridiagonal_factor_complex(size_t n, double *below, double *diagonal, double *above,
                                           double *second, int *pivots)
{
    lapack_int size = (lapack_int)n, info;
    LAPACK_zgttrf(&size, (lapack_complex_double *)below, (lapack_complex_double *)diagonal,
                  (lapack_complex_double *)above, (lapack_complex_double *)second, pivots, &info);
    return info;
}

void phys_lapack_tridiagonal_solve_complex(size_t n, const double *below, const double *diagonal,
                                           const double *above, const double *second,
                                           const int *pivots, size_t m, double *b)
{
    lapack_int size = (lapack_int)n, columns = (lapack_int)m, info;
    LAPACK_zgttrs("N", &size, &columns, (const lapack_complex_double *)below,
                  (const lapack_complex_double *)diagonal, (const lapack_complex_double *)above,
                  (const lapack_complex_double *)second, pivots, (lapack_complex_double *)b, &size,
                  &info);
}

static bool any_nan(size_t n, const double *x)
{
    for (size_t k = 0; k < n; k++)
        if (isnan(x[k]))
            return true;
    return false;
}

int phys_lapack_tridiagonal_eigenvectors(size_t n, double *diagonal, double *off, size_t count,
                                         double *values, double *vectors)
{
    lapack_int size = (lapack_int)n, last = (lapack_int)count, found, info = -1;
    lapack_int room = 20 * size, pivots = 10 * size, *support = malloc(12 * n * sizeof *support);
    double *all = malloc(21 * n * sizeof *all); /* LAPACK wants room for every eigenvalue */
    const double zero = 0;
    if (support && all && !any_nan(n, diagonal) && !any_nan(n - 1, off))
        LAPACK_dstevr("V", "I", &size, diagonal, off, &zero, &zero, &one, &last, &zero, &found, all,
                      vectors, &size, support, all + n, &room, support + 2 * n, &pivots, &info);
    for (size_t k = 0; info == 0 && k < count; k++)
        values[k] = all[k];
    AD_FREE(support, all);
    return info;
}

int phys_lapack_symmetric_factor_large(size_t n, double *a, int *pivots, double *work)
{
    lapack_int size = (lapack_int)n, room = 64 * size, info;
    LAPACK_dsytrf("L", &size, a, &size, pivots, work, &room, &info);
    return info;
}

void phys_lapack_symmetric_solve_large(size_t n, const double *a, const int *pivots, size_t m,
                                       double *b)
{
    lapack_int size = (lapack_int)n, columns = (lapack_int)m, info;
    LAPACK_dsytrs("L", &size, &columns, a, &size, pivots, b, &size, &info);
}

int phys_lapack_eigenvectors(size_t n, double *a, double *b, double *values)
{
    if (n == 1 && !isnan(a[0]) && !isnan(b[0])) { /* before LAPACK is loaded */
        values[0] = a[0] / b[0];
        a[0] = 1 / sqrt(b[0]);
        return b[0] > 0 ? 0 : 2;
    }
    lapack_int size = (lapack_int)n, room = 66 * size, info = -1;
    double *work = malloc((size_t)room * sizeof *work);
    if (work && !any_nan(n * n, a) && !any_nan(n * n, b))
        LAPACK_dsygv(&one, "V", "L", &size, a, &size, b, &size, values, work, &room, &info);
    free(work);
    return info;
}

int phys_lapack_eigenvalues(size_t n, double *a, double *re, double *im, double *left,
                            double *right)
{
    lapack_int size = (lapack_int)n, room = 40 * size, info = -1;
    double *work = malloc((size_t)room * sizeof *work);
    if (work && !any_nan(n * n, a))
        LAPACK_dgeev("V", "V", &size, a, &size, re, im, left, &size, right, &size, work, &room,
                     &info);
    free(work);
    return info;
}

int phys_lapack_singular_values(size_t m, size_t n, double *a, double *s, double *u, double *vt)
{
    lapack_int rows = (lapack_int)m, columns = (lapack_int)n,
               least = rows < columns ? rows : columns, room = 64 * (rows + columns), info = -1;
    double *work = malloc((size_t)room * sizeof *work);
    if (work && !any_nan(m * n, a))
        LAPACK_dgesvd("S", "S", &rows, &columns, a, &rows, s, u, &rows, vt, &least, work, &room,
                      &info);
    free(work);
    return info;
}

/* By columns the rows are a matrix that is factored as Q R; the signs are those of a positive R. */
bool phys_lapack_orthonormal_rows(size_t n, size_t length, double *a, double *work)
{
    lapack_int columns = (lapack_int)n, size = (lapack_int)length, room = 64 * columns, info = -1;
    double *sign = work + n, *blocks = malloc((size_t)room * sizeof *blocks);
    if (blocks)
        LAPACK_dgeqrf(&size, &columns, a, &size, work, blocks, &room, &info);
    for (size_t k = 0; info == 0 && k < n; k++)
        sign[k] = a[k * length + k] < 0 ? -1 : 1;
    if (info == 0)
        LAPACK_dorgqr(&size, &columns, &columns, a, &size, work, blocks, &room, &info);
    free(blocks);
    if (info != 0)
        return false;
    for (size_t k = 0; k < n * length; k++)
        a[k] *= sign[k / length];
    return true;
}
