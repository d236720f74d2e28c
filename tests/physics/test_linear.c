/* LU, dense and banded, on either side of the size where LAPACK takes over, and libraries that
   cannot be loaded for it. */
#include "tests/close.h"
#include "autodiff/lazy.h"
#include "physics/linear/linear.h"

#include <complex.h>
#include <float.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MOST = 40 };

/* Reproducible numbers in [-1, 1], so that most columns need pivoting. */
static double number(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)*seed / 2147483648.0 - 1;
}

/* Largest component of a x - b in units of |a| |x|, for the rows of a [n x n]. */
static double residual(size_t n, const double *a, const double *x, const double *b)
{
    double worst = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = -b[i], size = fabs(b[i]);
        for (size_t j = 0; j < n; j++) {
            sum += a[i * n + j] * x[j];
            size += fabs(a[i * n + j] * x[j]);
        }
        worst = fmax(worst, fabs(sum) / size);
    }
    return worst;
}

static void test_dense(void **state)
{
    (void)state;
    double a[MOST * MOST], factor[MOST * MOST], b[MOST], x[MOST], once[MOST];
    int pivots[MOST];
    unsigned seed = 1;
    for (size_t n = 1; n <= MOST; n++) {
        for (size_t k = 0; k < n * n; k++)
            factor[k] = a[k] = number(&seed);
        for (size_t k = 0; k < n; k++)
            once[k] = x[k] = b[k] = number(&seed);
        assert_int_equal(phys_lapack_lu_factor(n, factor, pivots), 0);
        phys_lapack_lu_solve(n, factor, pivots, x);
        assert_true(residual(n, a, x, b) < 1e-12);
        for (size_t k = 0; k < n * n; k++)
            factor[k] = a[k];
        assert_int_equal(phys_lapack_lu_solve_once(n, factor, once), 0);
        assert_memory_equal(once, x, n * sizeof *x);
    }
}

/* The part of a band that factors fill holds anything before. */
static void test_band(void **state)
{
    (void)state;
    static double a[MOST * MOST], band[MOST * PHYS_BAND_ROWS(MOST)], b[MOST], x[MOST];
    int pivots[MOST];
    unsigned seed = 2;
    for (size_t n = 1; n <= MOST; n += 3)
        for (size_t width = 0; width < n; width++) {
            for (size_t k = 0; k < n * PHYS_BAND_ROWS(width); k++)
                band[k] = NAN;
            for (size_t i = 0; i < n; i++) {
                x[i] = b[i] = number(&seed);
                for (size_t j = 0; j < n; j++) {
                    bool inside = i <= j + width && j <= i + width;
                    a[i * n + j] = inside ? number(&seed) : 0;
                    if (inside)
                        band[PHYS_BAND(width, i, j)] = a[i * n + j];
                }
            }
            assert_int_equal(phys_lapack_band_factor(n, width, band, pivots), 0);
            phys_lapack_band_solve(n, width, band, pivots, x);
            assert_true(residual(n, a, x, b) < 1e-12);
        }
}

/* ---- by columns, real or complex ---- */

/* Numbers as pairs, and as phys_lapack_block_* takes them: without i, the real parts alone. */
static void pack(bool with_i, size_t n, const double complex *from, double *to)
{
    for (size_t k = 0; k < n; k++) {
        to[with_i ? 2 * k : k] = creal(from[k]);
        if (with_i)
            to[2 * k + 1] = cimag(from[k]);
    }
}

static double complex unpack(bool with_i, const double *from, size_t k)
{
    return with_i ? from[2 * k] + I * from[2 * k + 1] : from[k];
}

/* a is also factored with a unit matrix of PAD rows below, which LAPACK does. */
static void check_block(bool with_i, size_t n, unsigned *seed)
{
    enum { PAD = 17, ALL = MOST + PAD };
    static double complex a[MOST * MOST], b[MOST], wide[ALL * ALL], c[MOST * MOST];
    static double f[2 * MOST * MOST], g[2 * ALL * ALL], x[2 * ALL], y[2 * ALL], z[2 * ALL];
    static double left[2 * MOST * MOST], work[2 * MOST * MOST], S[2 * MOST * MOST];
    int pivots[ALL];
    const size_t size = n + PAD, parts = with_i ? 2 : 1, m = 3;
    memset(wide, 0, sizeof wide);
    for (size_t k = 0; k < size; k++)
        wide[k * (size + 1)] = 1;
    for (size_t k = 0; k < n * n; k++) {
        a[k] = number(seed) + (with_i ? I * number(seed) : 0);
        wide[k % n + k / n * size] = a[k];
    }
    if (n > 1) /* a pivot from below */
        a[0] = wide[0] = 0;
    for (size_t k = 0; k < n; k++)
        b[k] = number(seed) + (with_i ? I * number(seed) : 0);
    pack(with_i, n * n, a, f);
    pack(with_i, size * size, wide, g);
    memset(y, 0, sizeof y);
    pack(with_i, n, b, x);
    pack(with_i, n, b, y);
    assert_int_equal(phys_lapack_block_factor(with_i, n, f, pivots), 0);
    phys_lapack_block_solve(with_i, n, f, pivots, x);

    /* S = c - left^T a^-1 left, beside the products with the solution of each column */
    for (size_t k = 0; k < n * m; k++)
        c[k] = number(seed) + (with_i ? I * number(seed) : 0);
    pack(with_i, n * m, c, left);
    memset(S, 0, sizeof S);
    phys_lapack_block_eliminate(with_i, n, f, pivots, m, left, work, S);
    for (size_t j = 0; j < m; j++) {
        pack(with_i, n, c + j * n, z);
        phys_lapack_block_solve(with_i, n, f, pivots, z);
        for (size_t i = 0; i < m; i++) {
            double complex sum = unpack(with_i, S, i + j * m);
            double most = 1;
            for (size_t k = 0; k < n; k++) {
                sum += c[k + i * n] * unpack(with_i, z, k);
                most = fmax(most, cabs(unpack(with_i, z, k)));
            }
            assert_true(cabs(sum) < 1e-11 * most * most);
        }
    }

    assert_int_equal(phys_lapack_block_factor(with_i, size, g, pivots), 0);
    phys_lapack_block_solve(with_i, size, g, pivots, y);
    double largest = 0;
    for (size_t k = 0; k < n; k++)
        largest = fmax(largest, cabs(unpack(with_i, x, k)));
    for (size_t k = 0; k < n; k++)
        assert_true(cabs(unpack(with_i, x, k) - unpack(with_i, y, k)) < 1e-10 * largest);

    /* b - a x and b - a^T x */
    pack(with_i, n * n, a, f);
    for (size_t transpose = 0; transpose < 2; transpose++) {
        pack(with_i, n, b, z);
        phys_lapack_block_subtract(with_i, transpose, n, f, x, z);
        for (size_t i = 0; i < n; i++) {
            double complex sum = b[i];
            for (size_t j = 0; j < n; j++)
                sum -= a[transpose ? j + i * n : i + j * n] * unpack(with_i, x, j);
            assert_true(cabs(sum - unpack(with_i, z, i)) < 1e-12 * (1 + largest));
            assert_true(transpose || cabs(sum) < 1e-12 * (1 + largest));
        }
    }

    /* no row is left for the last pivot, and none at all */
    for (size_t k = 0; k < n; k++)
        f[parts * (k + (n - 1) * n)] = f[parts * (k + (n - 1) * n) + parts - 1] = 0;
    assert_int_equal(phys_lapack_block_factor(with_i, n, f, pivots), n);
    memset(f, 0, sizeof f);
    assert_int_equal(phys_lapack_block_factor(with_i, n, f, pivots), 1);
}

static void test_blocks(void **state)
{
    (void)state;
    unsigned seed = 3;
    for (size_t n = 1; n <= 20; n++)
        for (int k = 0; k < 10; k++)
            check_block(k % 2, n, &seed);
}

/* As test_band. */
static void test_complex_band(void **state)
{
    (void)state;
    static double complex a[MOST * MOST], b[MOST], x[MOST], band[MOST * PHYS_BAND_ROWS(MOST)];
    int pivots[MOST];
    unsigned seed = 4;
    for (size_t n = 1; n <= MOST; n += 3)
        for (size_t width = 0; width < n; width++) {
            for (size_t k = 0; k < n * PHYS_BAND_ROWS(width); k++)
                band[k] = (double)NAN;
            for (size_t i = 0; i < n; i++) {
                x[i] = b[i] = number(&seed) + I * number(&seed);
                for (size_t j = 0; j < n; j++) {
                    bool inside = i <= j + width && j <= i + width;
                    a[i * n + j] = inside ? number(&seed) + I * number(&seed) : 0;
                    if (inside)
                        band[PHYS_BAND(width, i, j)] = a[i * n + j];
                }
            }
            assert_int_equal(phys_lapack_band_factor_complex(n, width, (double *)band, pivots), 0);
            phys_lapack_band_solve_complex(n, width, (const double *)band, pivots, (double *)x);
            for (size_t i = 0; i < n; i++) {
                double complex sum = -b[i];
                double size = cabs(b[i]);
                for (size_t j = 0; j < n; j++) {
                    sum += a[i * n + j] * x[j];
                    size += cabs(a[i * n + j] * x[j]);
                }
                assert_true(cabs(sum) < 1e-12 * size);
            }
        }
}

/* The first zero pivot is named, factors are complete, and no index leads astray. */
static void test_singular(void **state)
{
    (void)state;
    for (size_t n = 2; n <= MOST; n += 19) {
        double a[MOST * MOST] = {0}, x[MOST];
        int pivots[MOST];
        for (size_t k = 0; k < n; k++) {
            a[k * n + k] = k == 1 ? 0 : 2;
            x[k] = 4;
        }
        assert_int_equal(phys_lapack_lu_factor(n, a, pivots), 2);
        phys_lapack_lu_solve(n, a, pivots, x);
        const bool finite = fabs(x[1]) <= DBL_MAX;
        assert_false(finite);
    }
}

/* As by the dynamic loader at the start: one line, and status 127. */
static void test_missing_library(void **state)
{
    (void)state;
    FILE *said = tmpfile();
    assert_non_null(said);
    pid_t child = fork();
    if (child == 0) {
        void *slot = NULL;
        dup2(fileno(said), STDERR_FILENO);
        ad_lazy_load(&slot, "libnone.so.3", "none");
        _exit(0);
    }
    int status;
    char line[200] = "";
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 127);
    rewind(said);
    assert_non_null(fgets(line, sizeof line, said));
    assert_non_null(strstr(line, "libnone.so.3"));
    fclose(said);
}

/* A matrix of log |det| and so many negative eigenvalues in two parts: the first rows, and the
   Schur complement of the others. */
static void expect_parts(size_t n, const double *a, size_t negative, double log_determinant)
{
    double f[40 * 40], rest[40 * 40], work[64 * 40], log_parts = 0;
    for (size_t inner = 1; inner < n; inner += 1 + n / 3) {
        int pivots[40];
        size_t m = n - inner;
        memcpy(f, a, n * n * sizeof *f);
        if (phys_lapack_symmetric_reduce(n, inner, f, pivots) != 0)
            continue; /* zeros on the diagonal alone */
        log_parts = 0;
        size_t below = phys_lapack_symmetric_inertia(inner, n, f, pivots, &log_parts);
        for (size_t k = 0; k < m * m; k++)
            rest[k] = f[(inner + k / m) * n + inner + k % m];
        assert_int_equal(phys_lapack_symmetric_factor(m, rest, pivots, work), 0);
        below += phys_lapack_symmetric_inertia(m, m, rest, pivots, &log_parts);
        assert_int_equal(below, negative);
        assert_close(log_parts, log_determinant, 1e-8, 1e-8);
    }
}

/* Symmetric indefinite matrices, small ones and those of LAPACK: the residual, and the inertia of
   both factors. Zeros on the diagonal need pivots of two rows. */
static void symmetric_factors(void **state)
{
    enum { SIZES = 40, TRIES = 60 };
    static double a[SIZES * SIZES], f[SIZES * SIZES], g[SIZES * SIZES], work[64 * SIZES];
    (void)state;
    uint64_t noise = 12345;
    for (size_t n = 1; n <= SIZES; n++)
        for (size_t try = 0; try < TRIES; try++) {
            int pivots[SIZES], other[SIZES];
            double x[2 * SIZES], b[2 * SIZES];
            for (size_t k = 0; k < n * n; k++) {
                noise = noise * 6364136223846793005u + 1442695040888963407u;
                double value = (double)(int64_t)noise / 9.3e18;
                size_t i = k / n, j = k % n;
                value = i == j && try % 3 == 0 ? 0
                        : try % 3 == 1         ? value * pow(10, 3 * value)
                                               : value;
                if (i >= j)
                    a[i * n + j] = a[j * n + i] = value;
            }
            if (n == 1)
                a[0] = try % 2 ? 0.3 : -0.7;
            for (size_t k = 0; k < n * n; k++)
                f[k] = g[k] = a[k];
            for (size_t k = 0; k < 2 * n; k++)
                x[k] = b[k] = cos(1.7 * (double)k);
            assert_int_equal(phys_lapack_symmetric_factor(n, f, pivots, work), 0);
            assert_int_equal(phys_lapack_symmetric_factor_large(n, g, other, work), 0);
            double log_f = 0, log_g = 0;
            assert_int_equal(phys_lapack_symmetric_inertia(n, n, f, pivots, &log_f),
                             phys_lapack_symmetric_inertia(n, n, g, other, &log_g));
            assert_close(log_f, log_g, 1e-9, 1e-9);
            log_g = 0;
            expect_parts(n, a, phys_lapack_symmetric_inertia(n, n, f, pivots, &log_g), log_f);
            phys_lapack_symmetric_solve(n, f, pivots, 2, x);
            for (size_t k = 0; k < 2 * n; k++) {
                double sum = -b[k], most = 0, size = fabs(b[k]);
                for (size_t j = 0; j < n; j++) {
                    sum += a[k % n * n + j] * x[k / n * n + j];
                    size += fabs(x[k / n * n + j]);
                }
                for (size_t j = 0; j < n * n; j++)
                    most = fmax(most, fabs(a[j]));
                assert_true(fabs(sum) <= 1e-13 * fmax(1, most) * size);
            }
        }
    double singular[] = {1, 2, 2, 4}, nothing[4] = {0}, lost[] = {1, (double)NAN, (double)NAN, 2};
    int pivots[2];
    assert_int_equal(phys_lapack_symmetric_factor(2, singular, pivots, work), 2);
    assert_int_equal(phys_lapack_symmetric_factor(2, nothing, pivots, work), 1);
    assert_int_not_equal(phys_lapack_symmetric_factor(2, lost, pivots, work), 0);
}

/* Of one row, which needs no LAPACK: as a diagonal of two, but for the bits. */
static void eigenvalues_of_one_row(void **state)
{
    (void)state;
    double a[] = {-3}, b[] = {4}, A[] = {-3, 0, 0, 5}, B[] = {4, 0, 0, 1}, value, values[2];
    assert_int_equal(phys_lapack_eigenvectors(1, a, b, &value), 0);
    assert_int_equal(phys_lapack_eigenvectors(2, A, B, values), 0);
    assert_close(value, values[0], 1e-15, 0);
    assert_close(a[0], fabs(A[0]), 1e-15, 0);
    b[0] = -4;
    assert_int_equal(phys_lapack_eigenvectors(1, a, b, &value), 2);
    a[0] = (double)NAN;
    assert_true(phys_lapack_eigenvectors(1, a, b, &value) < 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eigenvalues_of_one_row),
        cmocka_unit_test(symmetric_factors),
        cmocka_unit_test(test_dense),
        cmocka_unit_test(test_band),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_complex_band),
        cmocka_unit_test(test_singular),
        cmocka_unit_test(test_missing_library),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
