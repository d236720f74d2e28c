/* Linear systems of structure_cases.h: 3 x 3 in each column, and one of 37 x 37, with pivots off
   the diagonal for LU, symmetric for Cholesky; products in each column. */
#include "tests/autodiff/structure_cases.h"

#include <math.h>
#include <string.h>

enum { N = 3, SIDES = 2 };

static double at(const struct matrix *m, size_t r, size_t c) { return m->v[r * m->cols + c]; }

static uint32_t picked(size_t k, size_t rows) { return (uint32_t)((k * k * 5 + k * 3) % rows); }

/* 0.4 of rows of x, and 3 in one element of each row: in the next column, or on the diagonal. */
static ad_var matrices(ad_var x, bool cholesky)
{
    uint32_t list[N * N];
    double large[N * N] = {0};
    for (size_t k = 0; k < N * N; k++)
        list[k] = picked(k, ad_rows(x));
    for (size_t i = 0; i < N; i++)
        large[i * N + (i + !cholesky) % N] = 3;
    return ad_add(ad_mul(0.4, ad_gather_rows(x, N * N, list)), ad_const(x.tape, N * N, 1, large));
}

static double element(const struct matrix *x, bool cholesky, size_t i, size_t j, size_t c)
{
    size_t k = cholesky && j > i ? j * N + i : i * N + j;
    return 0.4 * at(x, picked(k, x->rows), c) + (j == (i + !cholesky) % N ? 3 : 0);
}

/* By cofactors. */
static double minor(const struct matrix *x, bool cholesky, size_t i, size_t j, size_t c)
{
    size_t r0 = (i + 1) % N, r1 = (i + 2) % N, c0 = (j + 1) % N, c1 = (j + 2) % N;
    return element(x, cholesky, r0, c0, c) * element(x, cholesky, r1, c1, c) -
           element(x, cholesky, r0, c1, c) * element(x, cholesky, r1, c0, c);
}

static double determinant(const struct matrix *x, bool cholesky, size_t c)
{
    double d = 0;
    for (size_t j = 0; j < N; j++)
        d += element(x, cholesky, 0, j, c) * minor(x, cholesky, 0, j, c);
    return d;
}

static double inverse_at(const struct matrix *x, bool cholesky, size_t i, size_t j, size_t c)
{
    return minor(x, cholesky, j, i, c) / determinant(x, cholesky, c);
}

static ad_var solution(const ad_var x[2], enum ad_factors factors)
{
    uint32_t list[N * SIDES];
    for (size_t k = 0; k < N * SIDES; k++)
        list[k] = picked(k + 7, ad_rows(x[1]));
    return ad_solve(matrices(x[0], factors == AD_CHOLESKY), ad_gather_rows(x[1], N * SIDES, list),
                    factors);
}

static double solution_at(const struct matrix x[2], bool cholesky, size_t r, size_t c)
{
    double s = 0;
    for (size_t j = 0; j < N; j++)
        s += inverse_at(x, cholesky, r / SIDES, j, c) *
             at(x + 1, picked(j * SIDES + r % SIDES + 7, x[1].rows), x[1].cols == 1 ? 0 : c);
    return s;
}

#define BOTH(suffix, factors, cholesky)                                                            \
    static ad_var solve_##suffix(const ad_var x[2]) { return solution(x, factors); }               \
    static double solve_##suffix##_element(const struct matrix x[2], size_t r, size_t c)           \
    {                                                                                              \
        return solution_at(x, cholesky, r, c);                                                     \
    }                                                                                              \
    static ad_var inverse_##suffix(const ad_var x[2])                                              \
    {                                                                                              \
        return ad_inverse(matrices(x[0], cholesky), factors);                                      \
    }                                                                                              \
    static double inverse_##suffix##_element(const struct matrix x[2], size_t r, size_t c)         \
    {                                                                                              \
        return inverse_at(x, cholesky, r / N, r % N, c);                                           \
    }                                                                                              \
    static ad_var logdet_##suffix(const ad_var x[2])                                               \
    {                                                                                              \
        return ad_logdet(matrices(x[0], cholesky), factors);                                       \
    }                                                                                              \
    static double logdet_##suffix##_element(const struct matrix x[2], size_t r, size_t c)          \
    {                                                                                              \
        (void)r;                                                                                   \
        return log(fabs(determinant(x, cholesky, c)));                                             \
    }
BOTH(lu, AD_LU, false)
BOTH(cholesky, AD_CHOLESKY, true)

/* One matrix, that of the first column, for all right sides. */
static ad_var solve_by_one(const ad_var x[2])
{
    return solution((const ad_var[]){ad_col(x[0], 0), x[1]}, AD_LU);
}

static double solve_by_one_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    for (size_t j = 0; j < N; j++)
        s += inverse_at(x, false, r / SIDES, j, 0) *
             at(x + 1, picked(j * SIDES + r % SIDES + 7, x[1].rows), c);
    return s;
}

/* ---- one large matrix, of all elements of x ---- */

enum { LARGE = 37, BOTH_SIDES = LARGE * SIDES, COLUMNS = 2 };

static ad_var all_picked(ad_var x, size_t n, size_t from)
{
    uint32_t list[LARGE * LARGE];
    const size_t size = ad_rows(x) * ad_cols(x);
    for (size_t k = 0; k < n; k++)
        list[k] = picked(k + from, size);
    return ad_gather_rows(ad_reshape(x, size, 1), n, list);
}

static ad_var large_matrix(ad_var x, bool cholesky)
{
    static double large[LARGE * LARGE];
    memset(large, 0, sizeof large);
    for (size_t i = 0; i < LARGE; i++)
        large[i * LARGE + (i + !cholesky) % LARGE] = 3;
    return ad_add(ad_mul(0.03, all_picked(x, LARGE * LARGE, 0)),
                  ad_const(x.tape, LARGE * LARGE, 1, large));
}

/* By elimination with pivots: the solution x, the inverse's factor; returns log |det|. */
static double eliminate(const struct matrix *m, bool cholesky, double x[LARGE])
{
    double a[LARGE][LARGE], log_of = 0;
    for (size_t i = 0; i < LARGE; i++)
        for (size_t j = 0; j < LARGE; j++) {
            size_t k = cholesky && j > i ? j * LARGE + i : i * LARGE + j;
            a[i][j] =
                0.03 * m->v[picked(k, m->rows * m->cols)] + (j == (i + !cholesky) % LARGE ? 3 : 0);
        }
    for (size_t k = 0; k < LARGE; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < LARGE; i++)
            best = fabs(a[i][k]) > fabs(a[best][k]) ? i : best;
        for (size_t j = 0; j < LARGE; j++) {
            double swap = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = swap;
        }
        double swap = x[k];
        x[k] = x[best];
        x[best] = swap;
        log_of += log(fabs(a[k][k]));
        for (size_t i = 0; i < LARGE; i++) {
            const double factor = i == k ? 0 : a[i][k] / a[k][k];
            for (size_t j = k; j < LARGE; j++)
                a[i][j] -= factor * a[k][j];
            x[i] -= factor * x[k];
        }
    }
    for (size_t i = 0; i < LARGE; i++)
        x[i] /= a[i][i];
    return log_of;
}

static ad_var large_solution(const ad_var x[2], enum ad_factors factors)
{
    ad_var b = ad_reshape(all_picked(x[0], BOTH_SIDES * COLUMNS, 7), BOTH_SIDES, COLUMNS);
    return ad_solve(large_matrix(x[0], factors == AD_CHOLESKY), b, factors);
}

static double large_solution_at(const struct matrix x[2], bool cholesky, size_t r, size_t c)
{
    double side[LARGE];
    for (size_t i = 0; i < LARGE; i++)
        side[i] = x->v[picked((i * SIDES + r % SIDES) * COLUMNS + c + 7, x->rows * x->cols)];
    eliminate(x, cholesky, side);
    return side[r / SIDES];
}

#define BOTH_LARGE(suffix, factors, cholesky)                                                      \
    static ad_var large_solve_##suffix(const ad_var x[2]) { return large_solution(x, factors); }   \
    static double large_solve_##suffix##_element(const struct matrix x[2], size_t r, size_t c)     \
    {                                                                                              \
        return large_solution_at(x, cholesky, r, c);                                               \
    }                                                                                              \
    static ad_var large_logdet_##suffix(const ad_var x[2])                                         \
    {                                                                                              \
        return ad_logdet(large_matrix(x[0], cholesky), factors);                                   \
    }                                                                                              \
    static double large_logdet_##suffix##_element(const struct matrix x[2], size_t r, size_t c)    \
    {                                                                                              \
        double none[LARGE] = {0};                                                                  \
        (void)r, (void)c;                                                                          \
        return eliminate(x, cholesky, none);                                                       \
    }
BOTH_LARGE(lu, AD_LU, false)
BOTH_LARGE(cholesky, AD_CHOLESKY, true)

/* ---- products of 2 x 3 and 3 x 2 ---- */

enum { HEIGHT = 2 };

static ad_var product(const ad_var x[2])
{
    uint32_t a[HEIGHT * N], b[N * SIDES];
    for (size_t k = 0; k < HEIGHT * N; k++)
        a[k] = picked(k, ad_rows(x[0]));
    for (size_t k = 0; k < N * SIDES; k++)
        b[k] = picked(k + 7, ad_rows(x[1]));
    return ad_product(ad_gather_rows(x[0], HEIGHT * N, a), ad_gather_rows(x[1], N * SIDES, b), N);
}

static double product_element(const struct matrix x[2], size_t r, size_t c)
{
    double s = 0;
    for (size_t j = 0; j < N; j++)
        s += at(x, picked(r / SIDES * N + j, x->rows), c) *
             at(x + 1, picked(j * SIDES + r % SIDES + 7, x[1].rows), x[1].cols == 1 ? 0 : c);
    return s;
}

#define CASE(name, second)                                                                         \
    {                                                                                              \
#name, name, name##_element, second, 1, SMOOTH                                             \
    }

const struct structure system_cases[] = {
    CASE(solve_lu, SAME),         CASE(solve_cholesky, SAME),
    CASE(solve_lu, ONE_COL),      CASE(inverse_lu, NONE),
    CASE(inverse_cholesky, NONE), CASE(logdet_lu, NONE),
    CASE(solve_by_one, SAME),     CASE(logdet_cholesky, NONE),
    CASE(large_solve_lu, NONE),   CASE(large_solve_cholesky, NONE),
    CASE(large_logdet_lu, NONE),  CASE(large_logdet_cholesky, NONE),
    CASE(product, SAME),          CASE(product, ONE_COL),
};
const size_t system_n_cases = sizeof system_cases / sizeof system_cases[0];
