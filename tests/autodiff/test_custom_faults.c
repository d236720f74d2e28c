/* Operations of one's own that fail: what a callback can do wrong, what checks find, and what is
 * refused. */
#include "support.h"

#include <math.h>
#include <string.h>

enum { COLS = 1000 };

/* ---- what a callback can do wrong ---- */

enum fault { RIGHT, FAILS, BEHIND, BEFORE, MAKES_NAN, WRONG_ADJOINT, LEAVES, N_FAULTS };

struct box {
    enum fault value, adjoint;
    double factor;
};

/* y = factor x^2, with a fault. */
static int square(void *user, size_t cols, const double *const x[], double *y)
{
    const struct box *box = user;
    for (size_t c = 0; c < cols; c++)
        y[c] = box->factor * x[0][c] * x[0][c];
    if (box->value == BEHIND || box->value == BEFORE)
        y[box->value == BEHIND ? (ptrdiff_t)cols : -1] = 1;
    if (box->value == MAKES_NAN)
        y[cols - 1] = (double)NAN;
    return box->value == FAILS && cols < 256; /* in the last block alone */
}

static int square_adjoint(void *user, size_t cols, const double *const x[], const double *y,
                          const double *gy, double *const gx[])
{
    const struct box *box = user;
    (void)y;
    for (size_t c = 0; c < cols; c++)
        if (box->adjoint != LEAVES || c != 2)
            gx[0][c] =
                (box->adjoint == WRONG_ADJOINT ? 1.001 : 1) * 2 * box->factor * x[0][c] * gy[c];
    if (box->adjoint == BEHIND || box->adjoint == BEFORE)
        gx[0][box->adjoint == BEHIND ? (ptrdiff_t)cols + 7 : -8] = 1;
    return box->adjoint == FAILS;
}

static void wrong_recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)y;
    gx[0] = ad_mul(ad_mul(2.002, x[0]), gy);
}

static ad_var squared(ad_var x, struct box *box)
{
    struct ad_custom operation = {.size = sizeof operation,
                                  .name = "square",
                                  .rows = 1,
                                  .value = square,
                                  .adjoint = square_adjoint,
                                  .user = box};
    return ad_custom(1, &x, &operation);
}

static void test_faults(void **state)
{
    (void)state;
    static const enum ad_status expected[N_FAULTS] = {
        [FAILS] = AD_E_NONFINITE, [BEHIND] = AD_E_ARGUMENT, [BEFORE] = AD_E_ARGUMENT};
    double at[COLS], g[COLS], value;
    for (int c = 0; c < COLS; c++)
        at[c] = 0.001 * c;
    for (int of_adjoint = 0; of_adjoint < 2; of_adjoint++)
        for (int fault = RIGHT; fault <= BEFORE; fault++) {
            struct box box = {.factor = 3};
            *(of_adjoint ? &box.adjoint : &box.value) = (enum fault)fault;
            ad_tape *t = ad_tape_new(AD_F64);
            ad_var x = ad_input(t, 1, COLS, "x"), y = ad_sum(squared(x, &box)), slope;
            struct ad_error error = {0};
            assert_int_equal(ad_grad(y, 1, &x, &slope), AD_OK);
            assert_int_equal(
                ad_gradient(1, &x, (const double *[]){at}, y, &value, (double *const[]){g}, &error),
                expected[fault]);
            ad_program *all = compile(t, 2, (ad_var[]){slope, y});
            ad_set(all, x, at);
            ad_run(all);
            assert_int_equal(ad_program_error(all)->status, expected[fault]);
            if (fault) {
                assert_non_null(strstr(ad_program_error(all)->message, "\"square\""));
                assert_non_null(
                    strstr(ad_program_error(all)->message, of_adjoint ? "adjoint" : "value"));
                assert_non_null(strstr(error.message, "\"square\"): "));
                assert_non_null(strstr(error.message, of_adjoint ? "adjoint" : "value"));
                error = (struct ad_error){0};
                assert_int_equal(ad_run_checked(all, &error), expected[fault]);
            }
            /* and nothing of it stays */
            box.adjoint = box.value = RIGHT;
            ad_run(all);
            assert_int_equal(ad_program_error(all)->status, AD_OK);
            ad_get(all, slope, g);
            assert_close(g[COLS - 1], 6 * at[COLS - 1], 1e-15, 0);
            ad_program_free(all);
            ad_tape_free(t);
        }
}

/* NaN of a callback, and what it leaves out, come out of the run. */
static void test_not_finite(void **state)
{
    (void)state;
    struct box box = {.factor = 1, .value = MAKES_NAN, .adjoint = LEAVES};
    double at[5] = {1, 2, 3, 4, 5}, g[5], y_at[5];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 5, "x"), y = squared(x, &box), slope;
    struct ad_error error = {0};
    ad_grad(y, 1, &x, &slope);
    ad_program *p = compile(t, 2, (ad_var[]){y, slope});
    ad_set(p, x, at);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
    ad_get(p, y, y_at);
    ad_get(p, slope, g);
    assert_true(y_at[3] == 16 && isnan(y_at[4]) && isnan(g[2]) && g[3] == 8);
    assert_int_equal(ad_run_checked(p, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "custom"));
    ad_program_free(p);
    /* no NaN comes back through a branch that is not taken */
    box.value = RIGHT;
    ad_var taken = ad_sum(ad_select(ad_lt(x, 2.5), squared(ad_recip(ad_sub(x, 3.0)), &box), x));
    box.adjoint = RIGHT;
    ad_grad(taken, 1, &x, &slope);
    p = compile(t, 1, &slope);
    ad_set(p, x, at);
    ad_run(p);
    ad_get(p, slope, g);
    assert_true(g[2] == 1 && g[3] == 1);
    assert_close(g[0], -2 / -8.0, 1e-14, 0);
    ad_program_free(p);
    ad_tape_free(t);
}

static void test_checks_find(void **state)
{
    (void)state;
    struct box box = {.factor = 1};
    double at[5] = {1, 2, 3, 4, 5};
    const double *where[] = {at};
    struct ad_check report;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 5, "x"), y = ad_sum(squared(x, &box));
    assert_int_equal(ad_check_gradient(y, 1, &x, where, 1e-8, 0, &report), AD_OK);
    assert_true(report.passed);
    box.adjoint = WRONG_ADJOINT;
    assert_int_equal(ad_check_gradient(y, 1, &x, where, 1e-8, 0, &report), AD_OK);
    assert_false(report.passed);
    box.adjoint = RIGHT;
    const struct ad_custom operation = {.size = sizeof operation,
                                        .name = "square",
                                        .rows = 1,
                                        .value = square,
                                        .adjoint = square_adjoint,
                                        .recorded = wrong_recorded,
                                        .user = &box};
    y = ad_sum(ad_custom(1, &x, &operation));
    assert_int_equal(ad_check_gradient(y, 1, &x, where, 1e-8, 0, &report), AD_OK);
    assert_true(report.passed);
    assert_int_equal(ad_check_second(y, 1, &x, where, 1e-6, 0, &report), AD_OK);
    assert_false(report.passed);
    ad_tape_free(t);
}

/* What `user` points to may change: nothing was computed when compiling, or is left out. */
static void test_user_changes(void **state)
{
    (void)state;
    struct box box = {.factor = 1};
    double got, at = 3;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_hold(ad_input(t, 1, 1, "x"));
    ad_var y = ad_add(squared(x, &box), squared(ad_scalar(t, 2), &box));
    ad_program *p = compile(t, 1, &y);
    ad_set(p, x, &at);
    ad_run(p);
    ad_get(p, y, &got);
    assert_true(got == 13);
    box.factor = 10;
    assert_int_equal(ad_rerun(p), AD_OK);
    ad_get(p, y, &got);
    assert_true(got == 130);
    ad_program_free(p);
    ad_tape_free(t);
}

/* ---- what is refused ---- */

static void none_recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)x, (void)y, (void)gy, (void)gx;
}

static enum ad_status refused(size_t n, const ad_var x[], const struct ad_custom *operation)
{
    ad_tape *t = x[0].tape;
    ad_custom(n, x, operation);
    enum ad_status status = ad_tape_error(t)->status;
    ad_tape_reset(t);
    return status;
}

static void test_refused(void **state)
{
    (void)state;
    struct box box = {.factor = 1};
    ad_tape *t = ad_tape_new(AD_F64);
    struct ad_custom f = {
        .size = sizeof f, .name = "square", .rows = 1, .value = square, .user = &box};
    ad_var many[17];
    ad_custom(1, NULL, &f);
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, NULL), AD_E_ARGUMENT);
    f.value = NULL;
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, &f), AD_E_ARGUMENT);
    f.value = square;
    f.rows = 0;
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, &f), AD_E_ARGUMENT);
    f.rows = 1;
    assert_int_equal(refused(2, (ad_var[]){ad_input(t, 1, 5, "x"), ad_input(t, 2, 4, "y")}, &f),
                     AD_E_SHAPE);
    for (int k = 0; k < 17; k++)
        many[k] = ad_input(t, 1, 5, "x");
    assert_int_equal(refused(17, many, &f), AD_E_ARGUMENT);
    f.rows = SIZE_MAX;
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, &f), AD_E_SHAPE);

    /* derivatives that are not there */
    f.rows = 1;
    ad_var x = ad_input(t, 1, 5, "x"), y = ad_custom(1, &x, &f), g;
    assert_int_equal(ad_grad(y, 1, &x, &g), AD_E_ARGUMENT);
    assert_non_null(strstr(ad_tape_error(t)->message, "\"square\""));
    ad_tape_reset(t);
    x = ad_input(t, 1, 5, "x");
    assert_int_equal(ad_grad(squared(x, &box), 1, &x, &g), AD_OK);
    assert_int_equal(ad_grad(g, 1, &x, &g), AD_E_ARGUMENT);
    assert_non_null(strstr(ad_tape_error(t)->message, "\"square\""));
    assert_non_null(strstr(ad_tape_error(t)->message, "second"));
    ad_tape_reset(t);
    f.recorded = none_recorded;
    x = ad_input(t, 1, 5, "x");
    assert_int_equal(ad_grad(ad_custom(1, &x, &f), 1, &x, &g), AD_E_TAPE);
    ad_tape_reset(t);

    /* ad_gradient cannot record */
    double at[5] = {1, 2, 3, 4, 5}, slope[5], value[5];
    struct ad_error error = {0};
    x = ad_input(t, 1, 5, "x");
    f.recorded = wrong_recorded;
    y = ad_custom(1, &x, &f);
    assert_int_equal(
        ad_gradient(1, &x, (const double *[]){at}, y, value, (double *[]){slope}, &error),
        AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(ad_evaluate(1, &x, (const double *[]){at}, y, value, &error), AD_OK);
    assert_true(value[4] == 25);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_faults),      cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_checks_find), cmocka_unit_test(test_user_changes),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("faults of one's own operations", tests, NULL, NULL);
}
