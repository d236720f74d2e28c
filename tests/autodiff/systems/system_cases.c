/* Small systems of structure_cases.h: 3 x 3 in each column, with pivots off the diagonal for LU,
   symmetric for Cholesky. */
#include "tests/autodiff/structure_cases.h"

#include <math.h>

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

#define CASE(name, second)                                                                         \
    {                                                                                              \
#name, name, name##_element, second, 1, SMOOTH                                             \
    }

const struct structure system_cases[] = {
    CASE(solve_lu, SAME),     CASE(solve_cholesky, SAME),   CASE(solve_lu, ONE_COL),
    CASE(inverse_lu, NONE),   CASE(inverse_cholesky, NONE), CASE(logdet_lu, NONE),
    CASE(solve_by_one, SAME), CASE(logdet_cholesky, NONE),
};
const size_t system_n_cases = sizeof system_cases / sizeof system_cases[0];
