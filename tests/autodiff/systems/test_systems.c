/* Linear systems in cases that could be wrong without an error: singular and nearly singular
   columns, among others and in vector tails, all sizes up to 32 and some above; errors that name
   the column. */
#include "tests/autodiff/support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double matrix_element(const double *a, size_t cols, size_t n, size_t i, size_t j, size_t c)
{
    return a[(i * n + j) * cols + c];
}

/* |a x - b| against n units of |a| |x|: a backward stable solution, whatever the condition. */
static void assert_solved(const double *a, const double *x, const double *b, size_t n, size_t m,
                          size_t cols, double unit)
{
    for (size_t c = 0; c < cols; c++)
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < m; k++) {
                double left = 0, size = 0, right = b[(i * m + k) * cols + c];
                for (size_t j = 0; j < n; j++) {
                    double term = matrix_element(a, cols, n, i, j, c) * x[(j * m + k) * cols + c];
                    left += term;
                    size += fabs(term);
                }
                if (!is_close(left, right, 0, 40 * (double)n * unit * (size + fabs(right))))
                    fail_msg("side %zu, column %zu: row %zu is %.17g, not %.17g", n, c, i, left,
                             right);
            }
}

static void solve_random(size_t n, size_t cols, size_t m, enum ad_factors factors,
                         enum ad_type type)
{
    uint64_t random = 11 * n + cols;
    double *a = random_values(&random, n * n * cols, -1, 1);
    double *b = random_values(&random, n * m * cols, -1, 1);
    for (size_t c = 0; c < cols && factors == AD_CHOLESKY; c++)
        for (size_t i = 0; i < n; i++) {
            for (size_t j = 0; j < i; j++)
                a[(j * n + i) * cols + c] = a[(i * n + j) * cols + c];
            a[(i * n + i) * cols + c] = (double)(float)(0.6 * (double)n + 1);
        }
    ad_tape *t = ad_tape_new(type);
    ad_var in[] = {ad_input(t, n * n, cols, "a"), ad_input(t, n * m, cols, "b")};
    double *x = evaluate(ad_solve(in[0], in[1], factors), 2, in, (const double *const[]){a, b});
    assert_solved(a, x, b, n, m, cols, type == AD_F64 ? 0x1p-53 : 0x1p-24);
    free(x);
    free(a);
    free(b);
    ad_tape_free(t);
}

static void all_sides(void)
{
    static const size_t columns[] = {1, 7, 8, 19};
    for (size_t n = 1; n <= 32; n++)
        for (int factors = AD_LU; factors <= AD_CHOLESKY; factors++)
            for (int type = 0; type < 2; type++)
                solve_random(n, columns[n % 4], 1 + n % 3, (enum ad_factors)factors,
                             type ? AD_F64 : AD_F32);
    for (size_t n = 33; n <= 133; n += 50)
        for (int k = 0; k < 4; k++)
            solve_random(n, 1, 1 + n % 4, k % 2 ? AD_LU : AD_CHOLESKY, k / 2 ? AD_F64 : AD_F32);
}

static void test_all_sides(void **state)
{
    (void)state;
    for_each_isa(all_sides);
    solve_random(3, 2000, 1, AD_LU, AD_F64);
}

/* ---- singular columns ---- */

enum { COLS = 21 };

/* Of the identity in all columns but one. */
static void fill(double *a, size_t col, const double bad[4])
{
    for (size_t c = 0; c < COLS; c++)
        for (int k = 0; k < 4; k++)
            a[k * COLS + (int)c] = c == col ? bad[k] : k == 0 || k == 3;
}

static const struct {
    double a[4];
    bool lu, cholesky; /* refused */
} matrices[] = {
    {{1, 2, 2, 4}, true, true},
    {{0, 0, 0, 0}, true, true},
    {{NAN, 0, 0, 1}, true, true},
    {{INFINITY, 0, 0, 1}, true, true},
    {{1, 0.1 + 0.2, 1, 0.3}, true, false},  /* equal but for rounding; lower: 1, 1, 0.3: below */
    {{1, 1, 1, 1 + 0x1p-52}, true, true},   /* its last pivot is rounding alone */
    {{1, 1, 1, 1 + 0x1p-45}, false, false}, /* hardly regular */
    {{1, 0, 0, 1e-200}, false, false},      /* badly scaled, and well conditioned */
    {{1e200, 0, 0, 1e-200}, false, false},
    {{0, 1, 1, 0}, false, true},     /* needs a pivot */
    {{-1, 0, 0, 2}, false, true},    /* negative */
    {{1e-320, 0, 0, 1}, true, true}, /* its reciprocal is infinite */
};

static void assert_named(const struct ad_error *e, bool refused, size_t col)
{
    char name[32];
    snprintf(name, sizeof name, "column %zu ", col);
    assert_int_equal(e->status, refused ? AD_E_NONFINITE : AD_OK);
    if (refused && !strstr(e->message, name))
        fail_msg("%s: not named in: %s", name, e->message);
}

static void look_for(size_t k, size_t col, enum ad_factors factors)
{
    bool refused = factors == AD_LU ? matrices[k].lu : matrices[k].cholesky;
    double a[4 * COLS], ones[2 * COLS], x[2 * COLS], value[2 * COLS], g[4 * COLS], gb[2 * COLS];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var in[] = {ad_input(t, 4, COLS, "a"), ad_input(t, 2, COLS, "b")};
    ad_var y = ad_solve(in[0], in[1], factors);
    ad_program *p = compile(t, 1, &y);
    struct ad_error e = {0}, direct = {0};
    fill(a, col, matrices[k].a);
    for (int i = 0; i < 2 * COLS; i++)
        ones[i] = 1;
    ad_set(p, in[0], a);
    ad_set(p, in[1], ones);
    for (size_t threads = 1; threads < 3; threads++) {
        ad_set_threads(p, threads);
        ad_run(p);
        assert_named(ad_program_error(p), refused, col);
    }
    ad_get(p, y, x);
    for (size_t c = 0; c < COLS; c++) {
        if (c != col)
            assert_close(x[c], 1, 0, 0);
        else
            assert_true(isnan(x[c]) == refused);
    }
    if (refused && isfinite(matrices[k].a[0])) {
        assert_int_equal(ad_run_checked(p, &e), AD_E_NONFINITE);
        assert_named(&e, true, col);
    }
    ad_gradient(2, in, (const double *const[]){a, ones}, y, value, (double *const[]){g, gb},
                &direct);
    assert_named(&direct, refused, col);
    fill(a, col, (const double[]){2, 0, 0, 2}); /* the next run is right again */
    ad_set(p, in[0], a);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
    ad_program_free(p);
    ad_tape_free(t);
}

static void test_singular(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(matrices); k++)
        for (size_t col = k % 3; col < COLS; col += 5) {
            look_for(k, col, AD_LU);
            if (k != 4)
                look_for(k, col, AD_CHOLESKY);
        }
}

/* ---- one large matrix ---- */

enum { LARGE = 40 };

/* Of 2 on the diagonal and 1 above it, row i scaled by r^i, column j by c^j. */
static void fill_large(double *a, double r, double c)
{
    for (size_t i = 0; i < LARGE; i++)
        for (size_t j = 0; j < LARGE; j++)
            a[i * LARGE + j] = (i == j ? 2 : j == i + 1) * pow(r, (double)i) * pow(c, (double)j);
}

static void test_large(void **state)
{
    (void)state;
    static const struct {
        double r, c;
        size_t at; /* an element ... */
        double is; /* ... that becomes this; 0: stays */
        bool refused;
    } rows[] = {
        {1, 1, 0, 0, false},
        {1e7, 1e-3, 0, 0, false},
        {1e-7, 1, 0, 0, false},
        {1, 1, 3 * LARGE + 3, NAN, true},
        {1, 1, 7, INFINITY, true},
        {1, 1, LARGE * LARGE - 2, 4 + 0x1p-50, true}, /* twice the row above but for rounding */
        {0, 1, 0, 0, true},                           /* row 1 and those below are 0 */
    };
    for (size_t k = 0; k < LENGTH(rows); k++) {
        ad_tape *t = ad_tape_new(AD_F64);
        double a[LARGE * LARGE], b[2 * LARGE], x[2 * LARGE];
        ad_var in[] = {ad_input(t, LARGE * LARGE, 1, "a"), ad_input(t, LARGE, 2, "b")};
        ad_var y = ad_solve(in[0], in[1], AD_LU);
        ad_program *p = compile(t, 1, &y);
        struct ad_error e = {0};
        fill_large(a, rows[k].r, rows[k].c);
        if (rows[k].is != 0)
            a[rows[k].at] = rows[k].is;
        for (size_t i = 0; i < LARGE; i++) /* of x = c^-i and 2 c^-i */
            for (size_t s = 0; s < 2; s++)
                b[2 * i + s] =
                    (i + 1 < LARGE ? 3. : 2.) * (double)(s + 1) * pow(rows[k].r, (double)i);
        ad_set(p, in[0], a);
        ad_set(p, in[1], b);
        ad_run(p);
        assert_named(ad_program_error(p), rows[k].refused, 0);
        ad_get(p, y, x);
        for (size_t i = 0; i < 2 * LARGE; i++)
            if (rows[k].refused)
                assert_true(isnan(x[i]));
            else
                assert_close(x[i] * pow(rows[k].c, (double)(i / 2)), 1. + (double)(i % 2), 1e-14,
                             0);
        ad_evaluate(2, in, (const double *const[]){a, b}, y, x, &e);
        assert_named(&e, rows[k].refused, 0);
        ad_program_free(p);
        ad_tape_free(t);
    }
}

/* a a^-1 = 1, and log |a^-1| = - log |a|, whose gradient is a^-T. */
static void test_large_inverse(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_input(t, LARGE * LARGE, 1, "a"), inverse = ad_inverse(a, AD_LU), by;
    ad_var m = ad_reshape(a, LARGE, LARGE), n = ad_reshape(inverse, LARGE, LARGE);
    ad_var log_of = ad_logdet(a, AD_LU), sum = ad_add(log_of, ad_logdet(inverse, AD_LU));
    uint64_t seed = 3;
    double *at = random_values(&seed, (size_t)LARGE * LARGE, -1, 1);
    const double *const x[] = {at};
    assert_int_equal(ad_grad(log_of, 1, &a, &by), AD_OK);
    by = ad_sub(ad_reshape(by, LARGE, LARGE), ad_transpose(n));
    double *one = evaluate(ad_matmul(m, false, n, false), 1, &a, x), *none = evaluate(by, 1, &a, x);
    for (size_t i = 0; i < (size_t)LARGE * LARGE; i++) {
        assert_close(one[i], i % (LARGE + 1) == 0, 0, 1e-11);
        assert_close(none[i], 0, 0, 1e-11);
    }
    assert_close(evaluate_scalar(sum, 1, &a, x), 0, 0, 1e-11);
    free(at);
    free(one);
    free(none);
    ad_tape_free(t);
}

/* Of two columns the first is named; of a held matrix in each run again, too. */
static void test_held(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_hold(ad_input(t, 4, 3, "a")), b = ad_input(t, 2, 3, "b");
    ad_var y = ad_add(ad_solve(a, b, AD_LU), ad_logdet(a, AD_LU));
    ad_program *p = compile(t, 1, &y);
    double m[] = {1, 1, 1, 0, 2, 2, 0, 2, 2, 1, 4, 4}, one[] = {1, 1, 1, 1, 1, 1};
    ad_set(p, a, m);
    ad_set(p, b, one);
    ad_run(p);
    assert_named(ad_program_error(p), true, 1);
    ad_set(p, b, one);
    assert_int_equal(ad_rerun(p), AD_E_NONFINITE);
    assert_named(ad_program_error(p), true, 1);
    m[10] = m[11] = 5;
    ad_set(p, a, m);
    ad_run(p);
    assert_int_equal(ad_rerun(p), AD_OK);
    assert_close(((double *)ad_data(p, y))[1], 3, 1e-15, 0); /* x = 3, -1; |det| = 1 */
    ad_program_free(p);
    ad_tape_free(t);
}

static void test_singular_constant(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var b = ad_input(t, 2, 3, "b"), a = ad_const(t, 4, 1, (const double[]){1, 2, 2, 4});
    ad_var y = ad_solve(a, b, AD_LU);
    ad_program *p;
    assert_int_equal(ad_compile(t, 1, &y, &p), AD_E_NONFINITE);
    assert_null(p);
    assert_named(ad_tape_error(t), true, 0);
    ad_tape_free(t);
}

/* Cholesky reads the lower triangle; the gradient of what is above it is 0. */
static void test_lower_triangle(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_input(t, 4, 1, "a"), g;
    ad_var y = ad_logdet(a, AD_CHOLESKY);
    const double *const at[] = {(const double[]){2, NAN, 1, 3}};
    assert_int_equal(ad_grad(y, 1, &a, &g), AD_OK);
    assert_close(evaluate_scalar(y, 1, &a, at), log(5), 1e-15, 0);
    double *v = evaluate(g, 1, &a, at);
    assert_close(v[0], 0.6, 1e-15, 0);
    assert_close(v[1], 0, 0, 0);
    assert_close(v[2], -0.4, 1e-15, 0);
    assert_close(v[3], 0.4, 1e-15, 0);
    free(v);
    ad_tape_free(t);
}

/* One factor serves value and gradient. */
static void test_shared_factor(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_input(t, 9, 10, "a"), b = ad_input(t, 3, 10, "b"), g[2];
    ad_var y = ad_add(ad_sum(ad_square(ad_solve(a, b, AD_LU))), ad_sum(ad_logdet(a, AD_LU)));
    size_t before = ad_tape_size(t);
    assert_int_equal(ad_grad(y, 2, (ad_var[]){a, b}, g), AD_OK);
    assert_true(ad_tape_size(t) > before);
    ad_program *p = compile(t, 3, (ad_var[]){y, g[0], g[1]});
    ad_var apart = ad_logdet(a, AD_LU);
    ad_program *q = compile(t, 4, (ad_var[]){y, g[0], g[1], apart});
    assert_int_equal(ad_program_info(q).nodes, ad_program_info(p).nodes);
    ad_program_free(p);
    ad_program_free(q);
    ad_tape_free(t);
}

static void test_refused(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    for (int k = 0; k < 7; k++) {
        ad_tape_reset(t);
        ad_var a = ad_input(t, 9, 4, "a"), five = ad_input(t, 5, 4, "five");
        ad_var large = ad_input(t, 33 * 33, 4, "large"), narrow = ad_input(t, 3, 2, "narrow");
        switch (k) {
        case 0:
            ad_solve(five, five, AD_LU);
            break;
        case 1:
            ad_logdet(large, AD_LU);
            break;
        case 2:
            ad_solve(a, five, AD_CHOLESKY);
            break;
        case 3:
            ad_solve(a, narrow, AD_LU);
            break;
        case 4:
            ad_inverse(five, AD_CHOLESKY);
            break;
        case 5:
            ad_product(a, narrow, 3);
            break;
        default:
            ad_inverse(a, (enum ad_factors)2);
        }
        assert_int_equal(ad_tape_error(t)->status, k == 6 ? AD_E_ARGUMENT : AD_E_SHAPE);
    }
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_sides),      cmocka_unit_test(test_singular),
        cmocka_unit_test(test_held),           cmocka_unit_test(test_singular_constant),
        cmocka_unit_test(test_lower_triangle), cmocka_unit_test(test_shared_factor),
        cmocka_unit_test(test_large),          cmocka_unit_test(test_large_inverse),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("small systems", tests, NULL, NULL);
}
