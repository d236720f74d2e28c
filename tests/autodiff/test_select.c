/* Select: nothing that is not finite passes from the branch not taken, at any order; comparisons.
 */
#include "support.h"

#include <stdio.h>
#include <stdlib.h>

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

/* Where both are equal, and with NaN. */
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
        cmocka_unit_test(test_select),       cmocka_unit_test(test_select_at_high_orders),
        cmocka_unit_test(test_select_lanes), cmocka_unit_test(test_capped_pair),
        cmocka_unit_test(test_comparisons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
