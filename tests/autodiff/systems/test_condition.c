/* Condition of small systems: a solution without digits is an error; scales of equations are no
 * matter. */
#include "tests/autodiff/support.h"

#include <stdlib.h>
#include <string.h>

/* s Hilbert(n) s, whose solution for the right side that ones make is exactly known only as long as
   it has digits. */
static struct ad_error hilbert(size_t n, double s, enum ad_factors factors, enum ad_type type,
                               double *worst, double *condition)
{
    double a[32 * 32], b[32] = {0}, *x;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            a[i * n + j] = 1. / (double)(i + j + 1) * pow(s, (double)i + (double)j);
            if (type == AD_F32)
                a[i * n + j] = (double)(float)a[i * n + j];
            b[i] += a[i * n + j] * pow(s, -(double)j);
        }
    ad_tape *t = ad_tape_new(type);
    ad_var in[] = {ad_input(t, n * n, 1, "a"), ad_input(t, n, 1, "b")};
    ad_var y = ad_solve(in[0], in[1], factors);
    ad_program *p = compile(t, 1, &y);
    ad_set(p, in[0], a);
    ad_set(p, in[1], b);
    ad_run(p);
    x = random_values(&(uint64_t){1}, n, 0, 1);
    ad_get(p, y, x);
    *worst = 0;
    for (size_t i = 0; i < n; i++)
        *worst = fmax(*worst, fabs(x[i] * pow(s, (double)i) - 1));
    struct ad_error e = *ad_program_error(p), direct = {0};
    *condition = ad_program_condition(p);
    ad_evaluate(2, in, (const double *const[]){a, b}, y, x, &direct);
    assert_int_equal(direct.status, e.status);
    free(x);
    ad_program_free(p);
    ad_tape_free(t);
    return e;
}

/* No solution is off by more than a fifth without an error; those of more than half of the digits
   are none; where few digits are left the condition says how many. */
static void test_condition(void **state)
{
    (void)state;
    for (size_t n = 2; n <= 14; n++)
        for (int k = 0; k < 8; k++) {
            enum ad_type type = k % 2 ? AD_F32 : AD_F64;
            const double unit = type == AD_F64 ? 0x1p-52 : 0x1p-23;
            double off, condition;
            struct ad_error e = hilbert(n, k / 4 ? 1e-2 : 1, k / 2 % 2 ? AD_CHOLESKY : AD_LU, type,
                                        &off, &condition);
            if (e.status == AD_OK &&
                !(off < 0.2 && off < 10 * (pow(unit, 0.25) + condition * unit)))
                fail_msg("Hilbert %zu, case %d: off by %g, condition %g", n, k, off, condition);
            if ((e.status == AD_OK) != (n <= (type == AD_F64 ? 11 : 5)))
                fail_msg("Hilbert %zu, case %d: status %d, condition %g", n, k, e.status,
                         condition);
        }
}

/* Equations in units that differ: without scales, a pivot of the wrong row gives 0 and 1. */
static void test_units_of_equations(void **state)
{
    (void)state;
    static const double large[] = {1e9, 1e17, 1e100, 1e160, 1e300, 1e-17, 1e-160, 1e-300};
    for (size_t k = 0; k < LENGTH(large); k++)
        for (int type = 0; type < 2; type++) {
            if (type && !(large[k] < 1e18 && large[k] > 1e-18))
                continue;
            ad_tape *t = ad_tape_new(type ? AD_F32 : AD_F64);
            ad_var in[] = {ad_input(t, 4, 1, "a"), ad_input(t, 2, 1, "b")};
            double c = type ? (double)(float)large[k] : large[k];
            double *x = evaluate(
                ad_solve(in[0], in[1], AD_LU), 2, in,
                (const double *const[]){(double[]){2, 2 * c, 1, 1}, (double[]){2 + 2 * c, 2}});
            assert_close(x[0], 1, type ? 1e-6 : 1e-15, 0);
            assert_close(x[1], 1, type ? 1e-6 : 1e-15, 0);
            free(x);
            ad_tape_free(t);
        }
}

/* Moler's matrix L L', L of 1 and -1: no pivot is small. Kahan's L alone is well conditioned but
   for scales. Scaled rows and columns are no matter; a run forgets the condition of the one before.
 */
static void test_condition_without_small_pivots(void **state)
{
    (void)state;
    enum { N = 32, COLUMNS = 20 };
    static double a[N * N * COLUMNS];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var m = ad_input(t, N * N, COLUMNS, "m"), y = ad_inverse(m, AD_LU);
    ad_program *p = compile(t, 1, &y);
    for (int kind = 0; kind < 4; kind++) {
        for (size_t c = 0; c < COLUMNS; c++)
            for (size_t i = 0; i < N; i++)
                for (size_t j = 0; j < N; j++) {
                    double moler = i == j ? (double)i + 1 : (double)(i < j ? i : j) - 1;
                    double kahan = i == j ? 1 : i > j ? -1 : 0, unit = i == j;
                    a[(i * N + j) * COLUMNS + c] =
                        kind == 3              ? unit
                        : kind == 0 && c == 17 ? moler
                        : kind == 2 ? kahan * pow(10, 5 * (double)i) * pow(1e-3, (double)j)
                                    : kahan;
                }
        ad_set(p, m, a);
        ad_run(p);
        assert_int_equal(ad_program_error(p)->status, kind == 0 ? AD_E_NONFINITE : AD_OK);
        if (kind == 0)
            assert_non_null(strstr(ad_program_error(p)->message, "column 17 "));
        assert_true(ad_program_condition(p) < (kind == 3 ? 1 : 1e12));
    }
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_condition),
        cmocka_unit_test(test_units_of_equations),
        cmocka_unit_test(test_condition_without_small_pivots),
    };
    return cmocka_run_group_tests_name("condition of small systems", tests, NULL, NULL);
}
