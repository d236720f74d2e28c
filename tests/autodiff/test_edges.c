/* Values and gradients at the edges of the domains, as documented in autodiff.h. */
#include "support.h"

#include <stdlib.h>

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unary),
        cmocka_unit_test(test_nan_comes_through),
        cmocka_unit_test(test_binary),
        cmocka_unit_test(test_nan_wins_min_and_max),
        cmocka_unit_test(test_number_powers_at_zero),
        cmocka_unit_test(test_norm_at_zero),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
