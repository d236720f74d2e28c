/* G2: a NULL that is not allowed is an error or ignored, in every function of the tape. */
#include "tests/close.h"
#include "autodiff/autodiff.h"
#include "autodiff/lbfgs.h"
#include "autodiff/optim.h"

static ad_tape *tape;
static ad_var x, y;

static int start(void **state)
{
    (void)state;
    tape = ad_tape_new(AD_F64);
    x = ad_input(tape, 4, 1, "x");
    y = ad_sum(ad_square(x));
    return 0;
}

static int end(void **state)
{
    (void)state;
    ad_tape_free(tape);
    return 0;
}

static void test_no_tape(void **state)
{
    (void)state;
    ad_var nothing = {0};
    assert_null(ad_tape_new((enum ad_type)7));
    ad_tape_reset(NULL);
    ad_tape_free(NULL);
    assert_true(ad_tape_size(NULL) == 0 && ad_tape_bytes(NULL) == 0);
    assert_true(ad_rows(nothing) == 0 && ad_cols(nothing) == 0);
    assert_int_not_equal(ad_tape_error(NULL)->status, AD_OK);
    assert_null(ad_input(NULL, 1, 1, "x").tape);
    assert_null(ad_const(NULL, 1, 1, (double[]){1}).tape);
    assert_null(ad_concat_rows(2, NULL).tape);
    assert_null(ad_concat_cols(2, NULL).tape);
    ad_program *program = NULL;
    assert_int_equal(ad_compile(NULL, 1, &y, &program), AD_E_TAPE);
    assert_int_equal(ad_compile(tape, 1, &y, NULL), AD_E_ARGUMENT);
    assert_int_equal(ad_tape_error(tape)->status, AD_OK);
}

/* Each call leaves its error in a tape of its own. */
static void test_recording(void **state)
{
    const size_t at[1] = {0};
    struct ad_check report;
    double value = 3;
    const double *values[1] = {NULL};
    ad_var g;
    ad_program *program;
    for (int k = 0; k < 12; k++) {
        start(state);
        k == 0    ? (void)ad_const(tape, 1, 1, NULL)
        : k == 1  ? (void)ad_gather_rows(x, 1, NULL)
        : k == 2  ? (void)ad_scatter_rows(x, NULL, 5)
        : k == 3  ? (void)ad_place(tape, 8, 1, 1, NULL, at, at)
        : k == 4  ? (void)ad_place(tape, 8, 1, 1, &x, NULL, at)
        : k == 5  ? (void)ad_grad(y, 1, NULL, &g)
        : k == 6  ? (void)ad_grad(y, 1, &x, NULL)
        : k == 7  ? (void)ad_compile(tape, 1, NULL, &program)
        : k == 8  ? (void)ad_check_gradient(y, 1, &x, NULL, 1, 0, &report)
        : k == 9  ? (void)ad_check_gradient(y, 1, &x, values, 1, 0, &report)
        : k == 10 ? (void)ad_check_second(y, 1, &x, values, 1, 0, &report)
                  : (void)ad_check_second(y, 1, &x, values, 1, 0, NULL);
        if (ad_tape_error(tape)->status != AD_E_ARGUMENT)
            fail_msg("call %d: status %d", k, ad_tape_error(tape)->status);
        end(state);
    }
    start(state);
    struct ad_error error = {0};
    assert_int_equal(ad_evaluate(1, NULL, values, y, &value, &error), AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(ad_evaluate(1, &x, values, y, &value, &error), AD_E_ARGUMENT);
    assert_int_not_equal(ad_gradient(1, &x, NULL, y, &value, NULL, NULL), AD_OK);
    assert_true(value == 3);
    end(state);
}

static void test_programs(void **state)
{
    (void)state;
    double values[4] = {1, 2, 3, 4}, value = 0;
    struct ad_error error = {0};
    ad_program *program;
    assert_int_equal(ad_compile(tape, 1, &y, &program), AD_OK);
    assert_int_equal(ad_set(program, x, values), AD_OK);
    assert_int_equal(ad_set(program, x, NULL), AD_E_ARGUMENT);
    ad_run(program);
    assert_int_equal(ad_get(program, y, NULL), AD_E_ARGUMENT);
    assert_int_equal(ad_get(program, y, &value), AD_OK);
    assert_true(value == 30);
    ad_program_free(program);
    ad_run(NULL);
    ad_set_threads(NULL, 2);
    ad_native_lazy(NULL);
    ad_program_free(NULL);
    assert_null(ad_data(NULL, x));
    assert_true(isnan(ad_run_timed(NULL)) && ad_program_info(NULL).nodes == 0);
    assert_int_not_equal(ad_set(NULL, x, values), AD_OK);
    assert_int_not_equal(ad_get(NULL, y, &value), AD_OK);
    assert_int_equal(ad_rerun(NULL), AD_E_ARGUMENT);
    assert_int_equal(ad_run_checked(NULL, &error), AD_E_ARGUMENT);
    assert_int_equal(ad_program_error(NULL)->status, AD_E_ARGUMENT);
    assert_false(ad_native(NULL, 1e9, NULL));
    error = (struct ad_error){0};
    assert_false(ad_native(NULL, 1e9, &error));
    assert_true(error.status == AD_E_ARGUMENT && ad_native_note(NULL)[0]);
}

static double parabola(void *context, double *at, double *g)
{
    (void)context;
    g[0] = 2 * at[0];
    return at[0] * at[0];
}

static void test_optimisers(void **state)
{
    (void)state;
    struct ad_optimiser_settings settings = ad_optimiser_defaults(AD_SGD);
    ad_optimiser *o = ad_optimiser_new(&settings, AD_F64, 1, NULL);
    ad_lbfgs *m = ad_lbfgs_new(1);
    double w = 1, g = 1, value = 1;
    size_t size = 7;
    ad_optimiser_step(NULL, &w, &g);
    ad_optimiser_step(o, NULL, &g);
    ad_optimiser_step(o, &w, NULL);
    ad_optimiser_set_rate(NULL, 1);
    assert_true(w == 1 && *ad_optimiser_steps(o) == 0);
    assert_null(ad_optimiser_steps(NULL));
    assert_null(ad_optimiser_state(NULL, &size));
    assert_true(size == 0 && ad_optimiser_state(o, NULL));
    ad_optimiser_set_rate(o, -1); /* would climb */
    ad_optimiser_step(o, &w, &g);
    assert_true(isnan(w));
    ad_optimiser_free(o);
    w = 1;
    ad_lbfgs_precondition(NULL, NULL, NULL);
    assert_false(ad_lbfgs_step(NULL, parabola, NULL, 1, &w, &g, &value));
    assert_false(ad_lbfgs_step(m, NULL, NULL, 1, &w, &g, &value));
    assert_false(ad_lbfgs_step(m, parabola, NULL, 1, NULL, &g, &value));
    assert_true(w == 1 && !ad_lbfgs_pairs(NULL) && !ad_lbfgs_state(NULL, &size) && size == 0);
    assert_non_null(ad_lbfgs_state(m, NULL));
    ad_lbfgs_free(m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_no_tape, start, end),
        cmocka_unit_test(test_recording),
        cmocka_unit_test_setup_teardown(test_programs, start, end),
        cmocka_unit_test(test_optimisers),
    };
    return cmocka_run_group_tests_name("misuse", tests, NULL, NULL);
}
