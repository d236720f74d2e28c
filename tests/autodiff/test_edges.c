/* Values and gradients at the edges of the domains, as documented in autodiff.h; nothing that is
   not finite comes through the branch a select does not take, at any order. */
#include "support.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- gradients of one-argument functions at one point ---- */

typedef ad_var function(ad_var x);

/* The value (order 0) or derivative of this order of f at x. */
static double derivative(function *f, int order, double x)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var in = ad_input(tape, 1, 1, "x"), y = f(in);
    for (int k = 0; k < order; k++) {
        ad_var g;
        assert_int_equal(ad_grad(y, 1, &in, &g), AD_OK);
        y = g;
    }
    double value = evaluate_scalar(y, 1, &in, (const double *const[]){&x});
    ad_tape_free(tape);
    return value;
}

/* a ~ b, where b may be infinite or NaN. */
static void assert_same(double a, double b, const char *what)
{
    bool same = isnan(b) ? isnan(a) : a == b || fabs(a - b) <= 4 * DBL_EPSILON * fabs(b);
    if (!same)
        fail_msg("%s is %.17g, not %.17g", what, a, b);
}

#define INF ((double)INFINITY)

static const double pi = 3.14159265358979323846;

struct edge {
    const char *text;
    function *f;
    double x, value, slope;
};

#define UNARY_EDGES(X)                                                                             \
    X(abs, 0, 0, 0)                                                                                \
    X(abs, -0.0, 0, 0)                                                                             \
    X(abs, -INF, INF, -1)                                                                          \
    X(sign, 0, 0, 0)                                                                               \
    X(sign, -3, -1, 0)                                                                             \
    X(step, 0, 0, 0)                                                                               \
    X(step, 1e-300, 1, 0)                                                                          \
    X(relu, 0, 0, 0)                                                                               \
    X(relu, -5, 0, 0)                                                                              \
    X(relu, 5, 5, 1)                                                                               \
    X(sqrt, 0, 0, 0)                                                                               \
    X(sqrt, -1, NAN, NAN)                                                                          \
    X(asin, 1, pi / 2, 0)                                                                          \
    X(asin, -1, -pi / 2, 0)                                                                        \
    X(acos, 1, 0, 0)                                                                               \
    X(acos, -1, pi, 0)                                                                             \
    X(recip, 0, INF, -INF)                                                                         \
    X(log, 0, -INF, INF)                                                                           \
    X(log1p, -1, -INF, INF)                                                                        \
    X(exp, -800, 0, 0)                                                                             \
    X(exp, 800, INF, INF)                                                                          \
    X(sigmoid, 800, 1, 0)                                                                          \
    X(sigmoid, -800, 0, 0)                                                                         \
    X(softplus, 800, 800, 1)                                                                       \
    X(softplus, -800, 0, 0)                                                                        \
    X(tanh, 400, 1, 0)                                                                             \
    X(tanh, -400, -1, 0)

#define FUNCTION(name, x, value, slope) {"ad_" #name "(" #x ")", ad_##name, x, value, slope},

static void test_unary(void **state)
{
    (void)state;
    const struct edge edges[] = {UNARY_EDGES(FUNCTION)};
    for (size_t k = 0; k < sizeof edges / sizeof edges[0]; k++) {
        const struct edge *e = &edges[k];
        assert_same(derivative(e->f, 0, e->x), e->value, e->text);
        assert_same(derivative(e->f, 1, e->x), e->slope, e->text);
    }
}

static void test_nan_comes_through(void **state)
{
    (void)state;
    static function *const f[] = {ad_abs, ad_relu, ad_sqrt, ad_exp, ad_softplus, ad_tanh, ad_sin};
    for (size_t k = 0; k < sizeof f / sizeof f[0]; k++)
        assert_true(isnan(derivative(f[k], 0, NAN)));
}

/* ---- two arguments ---- */

typedef ad_var function2(ad_var a, ad_var b);

static ad_var f_pow(ad_var a, ad_var b) { return ad_pow(a, b); }

static ad_var f_hypot(ad_var a, ad_var b) { return ad_hypot(a, b); }

static ad_var f_atan2(ad_var a, ad_var b) { return ad_atan2(a, b); }

static ad_var f_min(ad_var a, ad_var b) { return ad_min(a, b); }

static ad_var f_max(ad_var a, ad_var b) { return ad_max(a, b); }

static void gradient2(function2 *f, double a, double b, double out[3])
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[] = {ad_input(tape, 1, 1, "a"), ad_input(tape, 1, 1, "b")}, y = f(x[0], x[1]), g[2];
    const double *const at[] = {&a, &b};
    assert_int_equal(ad_grad(y, 2, x, g), AD_OK);
    out[0] = evaluate_scalar(y, 2, x, at);
    out[1] = evaluate_scalar(g[0], 2, x, at);
    out[2] = evaluate_scalar(g[1], 2, x, at);
    ad_tape_free(tape);
}

static void test_binary(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        function2 *f;
        double a, b, expected[3]; /* value, by a, by b */
    } edges[] = {
        {"hypot(0, 0)", f_hypot, 0, 0, {0, 0, 0}},
        {"hypot(3e200, 4e200)", f_hypot, 3e200, 4e200, {5e200, 0.6, 0.8}},
        {"atan2(0, 0)", f_atan2, 0, 0, {0, 0, 0}},
        {"atan2(0, -1)", f_atan2, 0, -1, {3.14159265358979323846, -1, 0}},
        {"pow(0, 0.5)", f_pow, 0, 0.5, {0, 0, 0}},
        {"pow(0, 1)", f_pow, 0, 1, {0, 1, 0}},
        {"pow(0, 2)", f_pow, 0, 2, {0, 0, 0}},
        {"pow(0, 0)", f_pow, 0, 0, {1, 0, 0}},
        {"pow(2, 0)", f_pow, 2, 0, {1, 0, 0.69314718055994530942}},
        {"min, equal", f_min, 0.7, 0.7, {0.7, 0.5, 0.5}},
        {"max, equal", f_max, 0.7, 0.7, {0.7, 0.5, 0.5}},
        {"min", f_min, -1, 2, {-1, 1, 0}},
        {"max", f_max, -1, 2, {2, 0, 1}},
        {"min, infinite", f_min, -1, INFINITY, {-1, 1, 0}},
    };
    for (size_t k = 0; k < sizeof edges / sizeof edges[0]; k++) {
        double got[3];
        gradient2(edges[k].f, edges[k].a, edges[k].b, got);
        for (int i = 0; i < 3; i++)
            assert_same(got[i], edges[k].expected[i], edges[k].text);
    }
}

static void test_nan_wins_min_and_max(void **state)
{
    (void)state;
    double got[3];
    function2 *const f[] = {f_min, f_max};
    for (int k = 0; k < 2; k++) {
        gradient2(f[k], NAN, 1, got);
        assert_true(isnan(got[0]));
        gradient2(f[k], 1, NAN, got);
        assert_true(isnan(got[0]));
    }
}

static ad_var sqrt_by_pow(ad_var x) { return ad_pow(x, 0.5); }

static ad_var pow_0(ad_var x) { return ad_pow(x, 0.0); }

static ad_var pow_third(ad_var x) { return ad_pow(x, 1.0 / 3); }

static ad_var pow_2_5(ad_var x) { return ad_pow(x, 2.5); }

static ad_var pow_3(ad_var x) { return ad_pow(x, 3.0); }

static void test_number_powers_at_zero(void **state)
{
    (void)state;
    assert_same(derivative(sqrt_by_pow, 1, 0), 0, "d x^0.5");
    assert_same(derivative(pow_third, 1, 0), 0, "d x^(1/3)");
    assert_same(derivative(pow_2_5, 1, 0), 0, "d x^2.5");
    assert_same(derivative(pow_2_5, 2, 0), 0, "d2 x^2.5");
    assert_same(derivative(pow_3, 1, 0), 0, "d x^3");
    assert_same(derivative(pow_3, 2, 0), 0, "d2 x^3");
    assert_same(derivative(pow_3, 3, 0), 6, "d3 x^3");
    assert_same(derivative(pow_3, 3, -2), 6, "d3 x^3");
    assert_same(derivative(pow_0, 0, 0), 1, "x^0");
    assert_same(derivative(pow_0, 1, 0), 0, "d x^0");
}

/* The norm of a vector, its usual form: finite at zero. */
static void test_norm_at_zero(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 3, 4, NULL), g;
    double zero[12] = {0};
    ad_var norm = ad_sum(ad_sqrt(ad_sum_rows(ad_square(x))));
    assert_int_equal(ad_grad(norm, 1, &x, &g), AD_OK);
    double *v = evaluate(g, 1, &x, (const double *const[]){zero});
    for (int i = 0; i < 12; i++)
        assert_same(v[i], 0, "d |x|");
    free(v);
    ad_tape_free(tape);
}

/* ---- select ---- */

static ad_var guarded_recip(ad_var r) { return ad_select(ad_gt(r, 0.0), ad_div(1.0, r), 0.0); }

static ad_var guarded_log(ad_var x) { return ad_select(ad_gt(x, 0.0), ad_log(x), ad_mul(x, x)); }

static ad_var guarded_exp(ad_var x) { return ad_select(ad_lt(x, 100.0), ad_exp(x), 3.0); }

/* exp of exp of x^2 overflows at once; multiplied by what is zero there. */
static ad_var guarded_tower(ad_var x)
{
    ad_var tower = ad_mul(ad_exp(ad_exp(ad_square(x))), ad_sin(x));
    return ad_select(ad_lt(ad_abs(x), 1.0), tower, ad_cos(x));
}

static ad_var guarded_sqrt(ad_var x)
{
    return ad_select(ad_gt(x, 0.0), ad_sqrt(x), ad_mul(-1.0, ad_sqrt(ad_neg(x))));
}

static ad_var guarded_norm(ad_var x)
{
    ad_var r = ad_sqrt(ad_square(x));
    return ad_select(ad_gt(r, 0.0), ad_mul(ad_recip(r), ad_exp(ad_neg(r))), 1.0);
}

static ad_var nested(ad_var x)
{
    ad_var inner = ad_select(ad_gt(x, 1.0), ad_log(ad_sub(x, 1.0)), ad_recip(x));
    return ad_select(ad_gt(x, 0.0), inner, ad_select(ad_lt(x, -1.0), ad_pow(ad_neg(x), 1.5), x));
}

/* A select within the branch not taken of another. */
static ad_var buried(ad_var x)
{
    ad_var inner = ad_select(ad_gt(x, -1e9), ad_div(ad_log(x), x), ad_recip(ad_square(x)));
    return ad_select(ad_ne(x, 0.0), ad_exp(inner), ad_mul(2.0, x));
}

static ad_var capped(ad_var r) { return ad_min(ad_recip(r), 20.0); }

static ad_var ramp_of_recip(ad_var x) { return ad_relu(ad_sub(1.0, ad_recip(x))); }

struct branch {
    const char *text;
    function *f;
    double x, expected[4]; /* value, first, second and third derivative */
};

static void test_select(void **state)
{
    (void)state;
    const double e = exp(-0.5), s = sin(2), c = cos(2);
    const struct branch branches[] = {
        {"1/r at 0", guarded_recip, 0, {0, 0, 0, 0}},
        {"1/r at -1", guarded_recip, -1, {0, 0, 0, 0}},
        {"1/r at 2", guarded_recip, 2, {0.5, -0.25, 0.25, -0.375}},
        {"log at 0", guarded_log, 0, {0, 0, 2, 0}},
        {"log at -3", guarded_log, -3, {9, -6, 2, 0}},
        {"log at 2", guarded_log, 2, {log(2), 0.5, -0.25, 0.25}},
        {"exp at 800", guarded_exp, 800, {3, 0, 0, 0}},
        {"exp at -0.5", guarded_exp, -0.5, {e, e, e, e}},
        {"tower at 2", guarded_tower, 2, {c, -s, -c, s}},
        {"sqrt at -4", guarded_sqrt, -4, {-2, 0.25, 1. / 32, 3. / 256}},
        {"sqrt at 4", guarded_sqrt, 4, {2, 0.25, -1. / 32, 3. / 256}},
        {"screened at 0", guarded_norm, 0, {1, 0, 0, 0}},
        {"nested at 3", nested, 3, {log(2), 0.5, -0.25, 0.25}},
        {"nested at 0.5", nested, 0.5, {2, -4, 16, -96}},
        {"nested at 1", nested, 1, {1, -1, 2, -6}},
        {"nested at 0", nested, 0, {0, 1, 0, 0}},
        {"nested at -4", nested, -4, {8, -3, 0.375, 3. / 64}},
        {"buried at 0", buried, 0, {0, 2, 0, 0}},
        {"capped at 0", capped, 0, {20, 0, 0, 0}},
        {"capped at 0.01", capped, 0.01, {20, 0, 0, 0}},
        {"capped at 2", capped, 2, {0.5, -0.25, 0.25, -0.375}},
        {"ramp at 0", ramp_of_recip, 0, {0, 0, 0, 0}},
        {"ramp at 2", ramp_of_recip, 2, {0.5, 0.25, -0.25, 0.375}},
    };
    for (size_t k = 0; k < sizeof branches / sizeof branches[0]; k++)
        for (int order = 0; order < 4; order++) {
            char what[64];
            snprintf(what, sizeof what, "%s, order %d", branches[k].text, order);
            double got = derivative(branches[k].f, order, branches[k].x);
            double expected = branches[k].expected[order];
            if (!is_close(got, expected, 1e-13, 0))
                fail_msg("%s is %.17g, not %.17g", what, got, expected);
        }
}

static ad_var essential(ad_var x)
{
    return ad_select(ad_ne(x, 0.0), ad_exp(ad_div(ad_log(x), x)), ad_mul(2.0, x));
}

static ad_var pole(ad_var x)
{
    return ad_select(ad_ne(x, 0.0), ad_square(ad_recip(x)), ad_mul(2.0, x));
}

/* At any order: in the branch taken both are 2 x. */
static void test_select_at_high_orders(void **state)
{
    (void)state;
    for (int order = 0; order < 7; order++) {
        assert_same(derivative(essential, order, 0), order == 1 ? 2 : 0, "exp(log(x)/x), guarded");
        assert_same(derivative(pole, order, 0), order == 1 ? 2 : 0, "1/x^2, guarded");
    }
}

/* The same with lanes of both kinds, a matrix as condition and rows for branches. */
static void test_select_lanes(void **state)
{
    (void)state;
    enum { N = 301 };
    double r[3 * N];
    for (size_t i = 0; i < 3 * N; i++)
        r[i] = i % 3 == 0 ? 0 : 0.01 * (double)i;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 3, N, NULL), g, h;
    ad_var y = ad_select(ad_gt(x, 0.0), ad_mul(ad_row(x, 1), ad_pow(x, -3.0)), ad_row(x, 0));
    assert_int_equal(ad_grad(ad_sum(y), 1, &x, &g), AD_OK);
    assert_int_equal(ad_grad(weighted_sum(g), 1, &x, &h), AD_OK);
    double *slope = evaluate(g, 1, &x, (const double *const[]){r});
    double *bend = evaluate(h, 1, &x, (const double *const[]){r});
    for (size_t i = 0; i < 3 * N; i++) {
        assert_true(isfinite(slope[i]));
        assert_true(isfinite(bend[i]));
    }
    free(slope);
    free(bend);
    ad_tape_free(tape);
}

/* A gas of two bodies on top of each other: the capped law is flat, in f32 too. */
static void test_capped_pair(void **state)
{
    (void)state;
    for (enum ad_type type = AD_F32; type <= AD_F64; type++) {
        ad_tape *tape = ad_tape_new(type);
        ad_var q = ad_input(tape, 4, 1, "q"), g;
        ad_var dx = ad_sub(ad_row(q, 0), ad_row(q, 2)), dy = ad_sub(ad_row(q, 1), ad_row(q, 3));
        ad_var r = ad_sqrt(ad_add(ad_square(dx), ad_square(dy)));
        ad_var u = ad_pow(ad_div(0.04, r), 6.0);
        ad_var law = ad_min(ad_mul(10.0, ad_sub(ad_square(u), u)), 10.0);
        assert_int_equal(ad_grad(law, 1, &q, &g), AD_OK);
        const double at[] = {0.3, 0.4, 0.3, 0.4};
        double *v = evaluate(g, 1, &q, (const double *const[]){at});
        for (int i = 0; i < 4; i++)
            assert_same(v[i], 0, "force of the capped law");
        free(v);
        ad_tape_free(tape);
    }
}

/* ---- comparisons where they are equal, and with NaN ---- */

static void test_comparisons(void **state)
{
    (void)state;
    static const struct {
        double a, b, lt, le, gt, ge, eq, ne;
    } rows[] = {{1, 1, 0, 1, 0, 1, 1, 0},
                {1, 2, 1, 1, 0, 0, 0, 1},
                {0.0, -0.0, 0, 1, 0, 1, 1, 0},
                {NAN, 1, 0, 0, 0, 0, 0, 1},
                {INFINITY, INFINITY, 0, 1, 0, 1, 1, 0}};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var a = ad_input(tape, 1, 1, "a"), b = ad_input(tape, 1, 1, "b");
        const ad_var out[] = {ad_lt(a, b), ad_le(a, b), ad_gt(a, b),
                              ad_ge(a, b), ad_eq(a, b), ad_ne(a, b)};
        const double expected[] = {rows[k].lt, rows[k].le, rows[k].gt,
                                   rows[k].ge, rows[k].eq, rows[k].ne};
        for (size_t i = 0; i < 6; i++) {
            double got = evaluate_scalar(out[i], 2, (const ad_var[]){a, b},
                                         (const double *const[]){&rows[k].a, &rows[k].b});
            assert_same(got, expected[i], "comparison");
        }
        ad_tape_free(tape);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unary),
        cmocka_unit_test(test_nan_comes_through),
        cmocka_unit_test(test_binary),
        cmocka_unit_test(test_nan_wins_min_and_max),
        cmocka_unit_test(test_number_powers_at_zero),
        cmocka_unit_test(test_norm_at_zero),
        cmocka_unit_test(test_select),
        cmocka_unit_test(test_select_at_high_orders),
        cmocka_unit_test(test_select_lanes),
        cmocka_unit_test(test_capped_pair),
        cmocka_unit_test(test_comparisons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
