/* Extrema, log-sum-exp, softmax, detach and cumulative sums in cases that could be wrong without an
   error: ties, NaN, infinities, overflow, empty segments, and second order behind detach. */
#include "support.h"

#include <stdlib.h>
#include <string.h>

#define INF ((double)INFINITY)

/* Value and gradient of the sum of f(x), x of rows x cols, both ways: compiled and direct. */
struct answer {
    double value[64], gradient[64];
};

static struct answer answer(ad_var (*f)(ad_var), size_t rows, size_t cols, const double *x,
                            enum ad_type type)
{
    struct answer a = {{0}, {0}}, direct = {{0}, {0}};
    struct ad_error error = {0};
    ad_tape *t = ad_tape_new(type);
    ad_var in = ad_input(t, rows, cols, "x"), y = f(in), g;
    const double *const at[] = {x};
    assert_int_equal(ad_grad(y, 1, &in, &g), AD_OK);
    double *value = evaluate(y, 1, &in, at), *gradient = evaluate(g, 1, &in, at);
    size_t n = ad_rows(y) * ad_cols(y);
    memcpy(a.value, value, n * sizeof *value);
    memcpy(a.gradient, gradient, rows * cols * sizeof *gradient);
    assert_int_equal(
        ad_gradient(1, &in, at, y, direct.value, (double *[]){direct.gradient}, &error), AD_OK);
    for (size_t k = 0; k < n; k++)
        assert_same(direct.value[k], a.value[k], "direct value");
    for (size_t k = 0; k < rows * cols; k++)
        assert_same(direct.gradient[k], a.gradient[k], "direct gradient");
    free(value);
    free(gradient);
    ad_tape_free(t);
    return a;
}

static void test_ties(void **state)
{
    (void)state;
    const double x[] = {3, 1, 3, 3, 2, 3, 0, 3};
    for (int k = 0; k < 4; k++) {
        ad_var (*const f[])(ad_var) = {ad_max_rows, ad_max_cols, ad_min_rows, ad_min_cols};
        bool rows = k % 2 == 0;
        double in[8], total = 0;
        for (int i = 0; i < 8; i++)
            in[i] = k < 2 ? x[i] : -x[i];
        struct answer a = answer(f[k], rows ? 8 : 1, rows ? 1 : 8, in, AD_F64);
        assert_close(a.value[0], k < 2 ? 3 : -3, 0, 0);
        for (int i = 0; i < 8; i++) {
            total += a.gradient[i];
            assert_true(x[i] == 3 ? a.gradient[i] > 0 : a.gradient[i] == 0);
        }
        assert_close(total, 1, 0, 0);
    }
}

/* The first of equal ones, wherever they lie in the halves, for every number of rows. */
static void test_first_of_equal(void **state)
{
    (void)state;
    for (size_t n = 1; n <= 17; n++)
        for (size_t first = 0; first < n; first++)
            for (size_t second = first; second < n; second++) {
                double x[17] = {0};
                x[first] = x[second] = 2;
                assert_close(answer(ad_arg_max_cols, 1, n, x, AD_F64).value[0], (double)first, 0,
                             0);
                struct answer a = answer(ad_arg_max_rows, n, 1, x, AD_F32);
                assert_close(a.value[0], (double)first, 0, 0);
                assert_same(a.gradient[first], 0, "no gradient");
                assert_close(answer(ad_max_rows, n, 1, x, AD_F64).value[0], 2, 0, 0);
            }
    const double equal[] = {-INF, -INF, -INF};
    assert_close(answer(ad_arg_max_rows, 3, 1, equal, AD_F64).value[0], 0, 0, 0);
}

static void test_nan(void **state)
{
    (void)state;
    for (size_t at = 0; at < 7; at++) {
        double x[] = {1, 5, 2, -INF, INF, 0, 3};
        x[at] = NAN;
        assert_true(isnan(answer(ad_max_cols, 1, 7, x, AD_F64).value[0]));
        assert_true(isnan(answer(ad_min_rows, 7, 1, x, AD_F64).value[0]));
        assert_true(isnan(answer(ad_log_sum_exp_rows, 7, 1, x, AD_F64).value[0]));
        assert_close(answer(ad_arg_max_rows, 7, 1, x, AD_F64).value[0], (double)at, 0, 0);
    }
}

static void test_infinite_log_sum_exp(void **state)
{
    (void)state;
    static const struct {
        double x[3], value, gradient[3];
    } cases[] = {
        {{-INF, -INF, -INF}, -INF, {0, 0, 0}},
        {{-INF, 2, -INF}, 2, {0, 1, 0}},
        {{-INF, 0, 0}, 0.69314718055994530942, {0, 0.5, 0.5}},
        {{1e300, -1e300, 0}, 1e300, {1, 0, 0}},
        {{1000, 1000, -1000}, 1000.69314718055994531, {0.5, 0.5, 0}},
        {{-1e4, -1e4, -1e4}, -1e4 + 1.0986122886681098, {1. / 3, 1. / 3, 1. / 3}},
        {{-1e308, -1e308, -INF}, -1e308, {0.5, 0.5, 0}},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct answer a = answer(ad_log_sum_exp_rows, 3, 1, cases[k].x, AD_F64);
        assert_close(a.value[0], cases[k].value, 1e-15, 0);
        for (int i = 0; i < 3; i++)
            assert_close(a.gradient[i], cases[k].gradient[i], 1e-15, 0);
    }
    const double f32[] = {90, 90, -90};
    assert_close(answer(ad_log_sum_exp_cols, 1, 3, f32, AD_F32).value[0], 90 + 0.6931471805, 1e-7,
                 0);
}

static void test_infinite_term(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 1, "x");
    const double top[] = {0, INF, 1};
    const double *const at[] = {top};
    assert_close(evaluate_scalar(ad_log_sum_exp_rows(x), 1, &x, at), INF, 0, 0);
    assert_true(isnan(evaluate_scalar(ad_sum(ad_softmax_rows(x)), 1, &x, at)));
    ad_tape_free(t);
}

/* A masked column stays without effect on those beside it, at second order, too. */
static ad_var masked(ad_var x)
{
    ad_var g, y = ad_sum(ad_square(ad_max(-1e3, ad_log_sum_exp_rows(x))));
    ad_grad(y, 1, &x, &g);
    return g;
}

static void test_masked_column(void **state)
{
    (void)state;
    const double with[] = {0.3, -INF, 0.5, -INF}, without[] = {0.3, 0.5};
    struct answer a = answer(masked, 2, 2, with, AD_F64), b = answer(masked, 2, 1, without, AD_F64);
    for (int r = 0; r < 2; r++) {
        assert_close(a.value[2 * r], b.value[r], 1e-15, 0);
        assert_close(a.gradient[2 * r], b.gradient[r], 1e-14, 0);
        assert_same(a.value[2 * r + 1], 0, "masked");
        assert_same(a.gradient[2 * r + 1], 0, "masked");
    }
}

static ad_var first_share(ad_var x) { return ad_row(ad_softmax_rows(x), 0); }

static void test_softmax_edges(void **state)
{
    (void)state;
    const double far[] = {800, -800, 800}, none[] = {-INF, -INF}, one[] = {-INF, 3};
    struct answer a = answer(first_share, 3, 1, far, AD_F64);
    assert_close(a.value[0], 0.5, 1e-15, 0);
    assert_close(a.gradient[0], 0.25, 1e-15, 0);
    assert_close(a.gradient[1], 0, 0, 0);
    assert_close(a.gradient[2], -0.25, 1e-15, 0);
    assert_true(isnan(answer(first_share, 2, 1, none, AD_F64).value[0]));
    assert_close(answer(first_share, 2, 1, one, AD_F64).value[0], 0, 0, 0);
}

/* ---- detach ---- */

static ad_var half_detached(ad_var x) { return ad_mul(ad_detach(ad_square(x)), ad_sin(x)); }

static ad_var detached(ad_var x) { return ad_detach(ad_exp(x)); }

static ad_var detached_infinite(ad_var x) { return ad_mul(1e300, ad_detach(ad_exp(x))); }

static void test_detach(void **state)
{
    (void)state;
    const double x[] = {0.7, 2};
    struct answer a = answer(half_detached, 1, 2, x, AD_F64), b = answer(detached, 1, 2, x, AD_F64);
    for (int k = 0; k < 2; k++) {
        assert_close(a.value[k], x[k] * x[k] * sin(x[k]), 1e-15, 0);
        assert_close(a.gradient[k], x[k] * x[k] * cos(x[k]), 1e-15, 0);
        assert_close(b.value[k], exp(x[k]), 1e-15, 0);
        assert_same(b.gradient[k], 0, "no gradient");
        assert_close(derivative(half_detached, 2, x[k]), -x[k] * x[k] * sin(x[k]), 1e-15, 0);
    }
    const double large[] = {700};
    assert_same(answer(detached_infinite, 1, 1, large, AD_F64).gradient[0], 0, "no gradient");
}

/* It costs nothing in a program, and its operand may be an output, too. */
static void test_detach_is_left_out(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 5, "x"), d = ad_detach(x), y = ad_detach(ad_sin(d));
    ad_program *p = compile(t, 3, (ad_var[]){d, y, x});
    assert_int_equal(ad_program_info(p).instructions, 1);
    double in[15], out[15];
    for (int k = 0; k < 15; k++)
        in[k] = k + 0.25;
    assert_int_equal(ad_set(p, x, in), AD_OK);
    ad_run(p);
    assert_int_equal(ad_get(p, d, out), AD_OK);
    assert_memory_equal(out, in, sizeof in);
    assert_int_equal(ad_get(p, y, out), AD_OK);
    assert_close(out[14], sin(in[14]), 1e-15, 0);
    ad_program_free(p);
    ad_tape_free(t);
}

/* ---- lists and ranges ---- */

static void test_empty_segments(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 3, "x");
    ad_var s = ad_scatter_cols(x, (uint32_t[]){2, 0, 2}, 4);
    const double in[] = {1, 2, 4, 8, 16, 32}, expected[] = {2, 0, 5, 0, 16, 0, 40, 0};
    double *v = evaluate(s, 1, &x, (const double *const[]){in});
    for (int k = 0; k < 8; k++)
        assert_same(v[k], expected[k], "sum by segment");
    free(v);
    ad_tape_free(t);
}

static void test_refused_lists(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F32);
    for (int k = 0; k < 5; k++) {
        ad_tape_reset(t);
        ad_var x = ad_input(t, 2, 3, "x");
        switch (k) {
        case 0:
            ad_gather_cols(x, 2, (uint32_t[]){0, 3});
            break;
        case 1:
            ad_gather_cols(x, 0, NULL);
            break;
        case 2:
            ad_scatter_cols(x, (uint32_t[]){0, 1, 4}, 4);
            break;
        case 3:
            ad_scatter_cols(x, (uint32_t[]){0, 0, 0}, 0);
            break;
        default: /* f32 does not count so far */
            ad_arg_max_cols(ad_broadcast(ad_col(x, 0), 2, (1u << 24) + 1));
        }
        assert_int_equal(ad_tape_error(t)->status, AD_E_SHAPE);
    }
    ad_tape_free(t);
}

/* Running totals of f32 are kept in f64. */
static void test_long_cumsum(void **state)
{
    (void)state;
    enum { N = 300000 };
    float *in;
    ad_tape *t = ad_tape_new(AD_F32);
    ad_var x = ad_input(t, 1, N, "x"), y = ad_cumsum_cols(x);
    ad_program *p = compile(t, 1, &y);
    in = ad_data(p, x);
    for (int k = 0; k < N; k++)
        in[k] = 0.1f;
    ad_run(p);
    assert_close((double)((float *)ad_data(p, y))[N - 1], N * (double)0.1f, 1e-7, 0);
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ties),
        cmocka_unit_test(test_first_of_equal),
        cmocka_unit_test(test_nan),
        cmocka_unit_test(test_infinite_log_sum_exp),
        cmocka_unit_test(test_infinite_term),
        cmocka_unit_test(test_masked_column),
        cmocka_unit_test(test_softmax_edges),
        cmocka_unit_test(test_detach),
        cmocka_unit_test(test_detach_is_left_out),
        cmocka_unit_test(test_empty_segments),
        cmocka_unit_test(test_refused_lists),
        cmocka_unit_test(test_long_cumsum),
    };
    return cmocka_run_group_tests_name("reductions", tests, NULL, NULL);
}
