/* Checks of gradients, on correct gradients and on a wrong rule: this file compiles the gradient
   and the checks again with the sign of one rule flipped. */
#include "autodiff/internal.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The rule of cos is ad_neg(ad_sin(x)). */
#define ad_sin(x) ad_neg((ad_sin)(x))
#define ad_grad wrong_grad
#define ad_vjp wrong_vjp
#define ad_sweep_back wrong_sweep_back
#define ad_elementwise_tangent wrong_elementwise_tangent
#define ad_derivative_operands wrong_derivative_operands
#define ad_check_gradient wrong_check_gradient
#define ad_check_second wrong_check_second
#define ad_elementwise_rule wrong_elementwise_rule
#define ad_branches wrong_branches
#define ad_reduce_to wrong_reduce_to
#define ad_accumulate wrong_accumulate
#define ad_is_zero wrong_is_zero
#include "autodiff/gradient/rules_elementwise.c"
#include "autodiff/gradient/grad.c"
#include "autodiff/check.c"
#undef ad_sin
#undef ad_grad
#undef ad_check_gradient
#undef ad_check_second

enum { ROWS = 4, COLS = 9 };

static double *values(void)
{
    uint64_t state = 77;
    return random_values(&state, ROWS * COLS, 0.3, 1.2);
}

/* ---- wrong rules are found, and found where they are ---- */

static void test_wrong_rule(void **state)
{
    (void)state;
    double *v = values();
    const double *const at[] = {v, v};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[] = {ad_input(t, ROWS, COLS, NULL), ad_input(t, ROWS, COLS, NULL)};
    ad_var y = ad_add(ad_sum(ad_exp(x[0])), ad_sum(ad_square(x[1])));
    y = ad_add(y, ad_mul(0.5, ad_cos(ad_col(ad_row(x[1], 2), 7))));

    assert_int_equal(ad_check_gradient(y, 2, x, at, 1e-9, 0, &r), AD_OK);
    assert_true(r.passed);
    assert_int_equal(r.entries, 2 * ROWS * COLS);

    assert_int_equal(wrong_check_gradient(y, 2, x, at, 1e-9, 0, &r), AD_OK);
    assert_false(r.passed);
    double entry = v[2 * COLS + 7], largest = 0;
    for (size_t i = 0; i < ROWS * COLS; i++)
        largest = fmax(largest, 2 * v[i] + (i == 2 * COLS + 7 ? 0.5 * sin(entry) : 0));
    assert_int_equal(r.input, 1);
    assert_int_equal(r.row, 2);
    assert_int_equal(r.col, 7);
    assert_close(r.tape, 2 * entry + 0.5 * sin(entry), 1e-12, 0);
    assert_close(r.difference, 2 * entry - 0.5 * sin(entry), 1e-9, 0);
    assert_close(r.worst, sin(entry) / largest, 1e-4, 0);
    free(v);
    ad_tape_free(t);
}

/* The first order of sin is right there, the second is not. */
static void test_wrong_at_second_order(void **state)
{
    (void)state;
    double *v = values();
    const double *const at[] = {v};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, ROWS, COLS, NULL), y = ad_sum(ad_sin(x));
    assert_int_equal(wrong_check_gradient(y, 1, &x, at, 1e-9, 0, &r), AD_OK);
    assert_true(r.passed);
    assert_int_equal(wrong_check_second(y, 1, &x, at, 1e-6, 0, &r), AD_OK);
    assert_false(r.passed);
    assert_close(r.tape, -r.difference, 1e-6, 0);
    assert_int_equal(ad_check_second(y, 1, &x, at, 1e-8, 0, &r), AD_OK);
    assert_true(r.passed);
    free(v);
    ad_tape_free(t);
}

/* A dependence the tape does not see: step has no gradient, but here a jump. */
static void test_a_jump_is_no_gradient(void **state)
{
    (void)state;
    const double zero = 0;
    const double *const at[] = {&zero};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, NULL), y = ad_add(x, ad_step(x));
    assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-3, 0, &r), AD_OK);
    assert_false(r.passed);
    ad_tape_free(t);
}

/* 1/|x - a| at x closer to a than the first step of the differences, which straddle the pole. */
static void test_beside_a_pole(void **state)
{
    (void)state;
    const double at_0[] = {0.9877, 0.9941, 1.3};
    const double *const at[] = {at_0};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 3, NULL);
    ad_var y = ad_sum(ad_recip(ad_abs(ad_sub(x, 0.98772))));
    assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-6, 0, &r), AD_OK);
    assert_true(r.passed);
    assert_int_equal(ad_check_second(y, 1, &x, at, 1e-6, 0, &r), AD_OK);
    assert_true(r.passed);
    ad_tape_free(t);
}

/* Large terms that cancel hide some digits of the differences from them: what is within their
   rounding passes, with the tolerance for an error, and a wrong slope beyond it does not. */
static void test_terms_that_cancel(void **state)
{
    (void)state;
    const double at_0[] = {0.3, -0.7, 1.9};
    const double *const at[] = {at_0};
    const double tolerance = 1e-6;
    struct ad_check r;
    for (int k = 0; k < 4; k++) {
        ad_tape *t = ad_tape_new(AD_F64);
        ad_var x = ad_input(t, 1, 3, NULL), far = ad_mul(x, sqrt(7e9));
        ad_var nothing = ad_sub(ad_mul(7e9, ad_square(x)), ad_square(far));
        ad_var y = ad_sum(ad_add(nothing, ad_mul(k < 2 ? 1e-3 : 1, ad_cos(x))));
        assert_int_equal(
            (k % 2 ? ad_check_second : ad_check_gradient)(y, 1, &x, at, tolerance, 0, &r), AD_OK);
        assert_true(r.passed && r.cancels && r.worst == tolerance);
        assert_int_equal(wrong_check_gradient(y, 1, &x, at, tolerance, 0, &r), AD_OK);
        assert_true(k < 2 || !r.passed);
        ad_tape_free(t);
    }
}

/* G6: near a kink the gradient is right, and another one a step on. */
static void test_beside_a_kink(void **state)
{
    (void)state;
    static const double points[] = {1, -3, 0.25, 1e4},
                        distances[] = {1e-4, -1e-4, 3e-5, 7e-4, 1e-6};
    for (size_t k = 0; k < 4; k++)
        for (size_t d = 0; d < 5; d++)
            for (int form = 0; form < 4; form++) {
                double x0 = points[k], a = x0 + distances[d] * fabs(x0);
                const double values_at[] = {x0, x0 * 0.7};
                const double *const at[] = {values_at};
                struct ad_check r;
                ad_tape *t = ad_tape_new(AD_F64);
                ad_var x = ad_input(t, 1, 2, NULL), from = ad_sub(x, a);
                ad_var kinked = form == 0   ? ad_abs(from)
                                : form == 1 ? ad_relu(from)
                                : form == 2 ? ad_max(ad_square(x), a * a)
                                            : ad_mul(x, ad_min(from, 0.0));
                ad_var y = ad_sum(ad_add(kinked, ad_mul(0.3, ad_sin(x))));
                assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-6, 0, &r), AD_OK);
                assert_true(r.kink);
                assert_false(r.passed);
                assert_int_equal(r.col, 0);

                assert_int_equal(r.entries, 2);
                ad_tape_free(t);
            }
}

/* No kinks: whatever the scale, at inflections, in quick oscillations, where it is steep. */
static void test_smooth_is_no_kink(void **state)
{
    (void)state;
    static const double points[] = {0, 1, -2.5, 0.3, 40};
    for (size_t k = 0; k < 5; k++)
        for (int form = 0; form < 8; form++) {
            const double *const at[] = {&points[k]};
            struct ad_check r;
            ad_tape *t = ad_tape_new(AD_F64);
            ad_var x = ad_input(t, 1, 1, NULL), from = ad_sub(x, points[k]);
            ad_var y = form == 0   ? ad_cube(from)
                       : form == 1 ? ad_sin(ad_mul(50, x))
                       : form == 2 ? ad_tanh(ad_mul(30, from))
                       : form == 3 ? ad_add(1e6, ad_square(x))
                       : form == 4 ? ad_square(ad_square(from))
                       : form == 5 ? ad_mul(3, x)
                       : form == 6 ? ad_exp(ad_neg(ad_square(ad_mul(20, from))))
                                   : ad_pow(from, 5.0);
            y = ad_add(y, x);
            assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-5, 0, &r), AD_OK);
            assert_false(r.kink);
            assert_true(r.passed);
            ad_tape_free(t);
        }
}

static void test_infinite_gradients_fail(void **state)
{
    (void)state;
    const double at_0[] = {1, 0, 2};
    const double *const at[] = {at_0};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 3, NULL), y = ad_sum(ad_log(x));
    assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-3, 0, &r), AD_OK);
    assert_false(r.passed);
    assert_true(isinf(r.worst));
    ad_tape_free(t);
}

/* ---- accuracy and scale ---- */

static void test_differences_have_ten_digits(void **state)
{
    (void)state;
    double *v = values();
    const double *const at[] = {v};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, ROWS, COLS, NULL);
    ad_var y = ad_sum(ad_exp(ad_mul(ad_sin(x), ad_log(x))));
    assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-10, 0, &r), AD_OK);
    assert_true(r.passed);
    free(v);
    ad_tape_free(t);
}

/* Units of astronomy: positions of 1e11 m, an action of 1e33 J s. */
static void test_any_units(void **state)
{
    (void)state;
    double *v = values();
    for (size_t i = 0; i < ROWS * COLS; i++)
        v[i] *= i % 2 ? 1e11 : -1e11;
    const double *const at[] = {v};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, ROWS, COLS, NULL);
    ad_var d = ad_sub(ad_slice_rows(x, 0, 2), ad_slice_rows(x, 2, 2));
    ad_var y = ad_sum(ad_div(1e44, ad_sqrt(ad_sum_rows(ad_square(d)))));
    assert_int_equal(ad_check_gradient(y, 1, &x, at, 1e-8, 0, &r), AD_OK);
    assert_true(r.passed);
    assert_int_equal(ad_check_second(y, 1, &x, at, 1e-8, 0, &r), AD_OK);
    assert_true(r.passed);
    free(v);
    ad_tape_free(t);
}

static void test_entries_are_spread(void **state)
{
    (void)state;
    double *v = values(), one = 1;
    const double *const at[] = {v, &one};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[] = {ad_input(t, ROWS, COLS, NULL), ad_input(t, 1, 1, NULL)};
    ad_var y = ad_sum(ad_mul(ad_sin(x[0]), x[1]));
    assert_int_equal(ad_check_gradient(y, 2, x, at, 1e-9, 5, &r), AD_OK);
    assert_int_equal(r.entries, 5 + 1);
    assert_true(r.passed);
    free(v);
    ad_tape_free(t);
}

/* An input on which y does not depend has gradient 0, and is compared. */
static void test_independent_inputs(void **state)
{
    (void)state;
    double *v = values(), one = 1;
    const double *const at[] = {v, &one};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[] = {ad_input(t, ROWS, COLS, NULL), ad_input(t, 1, 1, NULL)};
    ad_var y = ad_exp(x[1]);
    assert_int_equal(ad_check_gradient(y, 2, x, at, 1e-9, 0, &r), AD_OK);
    assert_int_equal(r.entries, ROWS * COLS + 1);
    assert_true(r.passed);
    free(v);
    ad_tape_free(t);
}

/* ---- wrong use ---- */

static void test_wrong_use(void **state)
{
    (void)state;
    double *v = values();
    const double *const at[] = {v};
    struct ad_check r;
    ad_tape *t = ad_tape_new(AD_F32);
    ad_var x = ad_input(t, ROWS, COLS, NULL);
    assert_int_equal(ad_check_gradient(ad_sum(x), 1, &x, at, 1, 0, &r), AD_E_ARGUMENT);
    assert_false(r.passed);
    ad_tape_free(t);

    t = ad_tape_new(AD_F64);
    x = ad_input(t, ROWS, COLS, NULL);
    assert_int_equal(ad_check_gradient(x, 1, &x, at, 1, 0, &r), AD_E_SHAPE);
    ad_tape_reset(t);
    x = ad_sin(ad_input(t, ROWS, COLS, NULL));
    assert_int_equal(ad_check_gradient(ad_sum(x), 1, &x, at, 1, 0, &r), AD_E_TAPE);
    ad_tape_reset(t);
    x = ad_input(t, ROWS, COLS, NULL);
    ad_var wrong = ad_sum(ad_add(x, ad_transpose(x)));
    assert_int_equal(ad_check_second(wrong, 1, &x, at, 1, 0, &r), AD_E_SHAPE);
    assert_false(r.passed);
    free(v);
    ad_tape_free(t);
}

/* ---- all checks, and their report ---- */

static void test_all_checks(void **state)
{
    static const double values[] = {0.5, 1e-9};
    const double *const at[] = {values};
    struct ad_checks c;
    char text[1000], part[8];
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 2, "length");
    ad_var smooth = ad_sum(ad_sin(x)), kink = ad_sum(ad_abs(x)),
           pole = ad_sum(ad_log(ad_sub(x, 1e-9)));
    assert_int_equal(ad_check_all(smooth, 1, &x, at, 0, &c), AD_OK);
    assert_true(c.passed && c.first.passed && c.second.passed);
    assert_int_equal(ad_check_all(smooth, 1, &x, at, 1e-300, &c), AD_OK);
    assert_false(c.passed);

    assert_int_equal(ad_check_all(kink, 1, &x, at, 0, &c), AD_OK);
    assert_false(c.passed);
    assert_true(c.first.kink);
    assert_int_equal(c.first.col, 1);
    size_t length = ad_checks_text(&c, 1, &x, text, sizeof text);
    assert_int_equal(length, strlen(text));
    assert_non_null(strstr(text, "\"length\""));
    assert_int_equal(ad_checks_text(&c, 1, &x, part, sizeof part), length);
    assert_int_equal(strlen(part), sizeof part - 1);

    assert_int_equal(ad_check_all(pole, 1, &x, at, 0, &c), AD_OK);
    assert_false(c.passed);
    assert_int_equal(c.not_finite.status, AD_E_NONFINITE);
    ad_checks_text(&c, 1, &x, text, sizeof text);
    assert_non_null(strstr(text, c.not_finite.message));
    ad_tape_free(t);

    assert_int_equal(ad_check_all((ad_var){0}, 1, &x, at, 0, &c), AD_E_TAPE);
    assert_false(c.passed);
}

/* A value whose adjoint is right and whose recorded derivative is not. */
static void test_all_checks_see_the_second_order(void **state)
{
    static const double values[] = {0.5, 0.9};
    const double *const at[] = {values};
    struct ad_checks c;
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 2, "x");
    ad_var right = ad_sum(ad_mul(x, ad_square(x))), held = ad_detach(ad_mul(3.0, ad_square(x)));
    /* x^3, with the slope 3 x^2 held */
    ad_var y = ad_add(ad_detach(ad_sub(right, ad_sum(ad_mul(held, x)))), ad_sum(ad_mul(held, x)));
    assert_int_equal(ad_check_all(right, 1, &x, at, 0, &c), AD_OK);
    assert_true(c.passed);
    assert_int_equal(ad_check_all(y, 1, &x, at, 0, &c), AD_OK);
    assert_true(c.first.passed);
    assert_false(c.second.passed || c.passed);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrong_rule),
        cmocka_unit_test(test_wrong_at_second_order),
        cmocka_unit_test(test_a_jump_is_no_gradient),
        cmocka_unit_test(test_beside_a_pole),
        cmocka_unit_test(test_terms_that_cancel),
        cmocka_unit_test(test_beside_a_kink),
        cmocka_unit_test(test_smooth_is_no_kink),
        cmocka_unit_test(test_infinite_gradients_fail),
        cmocka_unit_test(test_differences_have_ten_digits),
        cmocka_unit_test(test_any_units),
        cmocka_unit_test(test_entries_are_spread),
        cmocka_unit_test(test_independent_inputs),
        cmocka_unit_test(test_wrong_use),
        cmocka_unit_test(test_all_checks),
        cmocka_unit_test(test_all_checks_see_the_second_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
