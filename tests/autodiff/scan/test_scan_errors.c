/* Loops that are refused, and errors that name the step. */
#include "scan_cases.h"
#include "tests/mentions.h"

#include <string.h>

static void test_errors_name_the_step(void **state)
{
    (void)state;
    enum { STEPS = 5 };
    struct scan_made m = scan_make(scan_case_named("systems"), AD_F64, STEPS, 2, false);
    ad_program *p = compile(m.tape, 1, &m.y);
    double in[4 * 3 * STEPS] = {0}, value;
    const double start[] = {1, 2, 3, 4, 5, 6}, w[] = {2, 1, 1, 2};
    const double *at[] = {start, in, w};
    for (int row = 0; row < 4; row++) /* step 3, column 1: w + 0.1 in is singular */
        in[row * 3 * STEPS + 3 * 3 + 1] = row == 0 || row == 3 ? -10 : 0;
    for (int k = 0; k < 3; k++)
        ad_set(p, m.x[k], at[k]);
    ad_run(p);
    const char *message = ad_program_error(p)->message;
    assert_int_equal(ad_program_error(p)->status, AD_E_NONFINITE);
    assert_non_null(strstr(message, "step 3"));
    assert_non_null(strstr(message, "column 1"));
    struct ad_error error = {0};
    assert_int_equal(ad_evaluate(3, m.x, at, m.y, &value, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "step 3"));
    memset(in, 0, sizeof in);
    ad_set(p, m.x[1], in);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
    ad_program_free(p);
    ad_tape_free(m.tape);
}

static void test_checked(void **state)
{
    (void)state;
    struct scan_made m = scan_make(scan_case_named("map"), AD_F64, 6, 0, false);
    ad_program *p = compile(m.tape, 1, &m.y);
    scan_set_all(p, &m, 3);
    struct ad_error error = {0};
    assert_int_equal(ad_run_checked(p, &error), AD_OK);
    double *x = ad_data(p, m.x[0]);
    x[18 + 3 * 4 + 2] = 1e6; /* row 1 of step 4 */
    assert_int_equal(ad_run_checked(p, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "step 4"));
    assert_non_null(strstr(error.message, "exp"));
    assert_non_null(strstr(error.message, "row 1, column 2"));
    ad_program_free(p);
    ad_tape_free(m.tape);
}

/* The message has these names, at least that of the operation. */
static void refused(const struct ad_body *of, enum ad_type type, size_t steps, size_t cols,
                    enum ad_status status, const char *names)
{
    ad_tape *tape = ad_tape_new(type);
    ad_var s = ad_input(tape, 3, 2, "s"), in = ad_input(tape, 3, cols, "in"), last, out;
    ad_var w[] = {ad_input(tape, 3, 3, "w"), ad_input(tape, 3, 1, "b")};
    assert_int_equal(ad_scan(tape, of, steps, &s, &in, w, &last, &out), status);
    assert_int_equal(ad_tape_error(tape)->status, status);
    assert_mentions(ad_tape_error(tape)->message, status == AD_OK ? "" : "scan");
    assert_mentions(ad_tape_error(tape)->message, names);
    ad_tape_free(tape);
}

static void test_refusals(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    struct scan_vars v;
    const struct ad_body of = scan_body(scan_case_named("layer"), body, &v);
    struct ad_body wrong = of;
    ad_var foreign = ad_input(other, 3, 2, "x"), constant = ad_scalar(body, 1),
           narrow = ad_col(v.state[0], 0);
    refused(&of, AD_F64, 4, 8, AD_OK, "");
    refused(&of, AD_F64, 4, 9, AD_E_SHAPE, "input of steps 0 8");
    refused(&of, AD_F64, 0, 8, AD_E_ARGUMENT, "0 steps");
    refused(&of, AD_F64, (size_t)1 << 40, 8, AD_E_ARGUMENT, "steps");
    refused(&of, AD_F32, 4, 8, AD_E_ARGUMENT, "type");
    refused(NULL, AD_F64, 4, 8, AD_E_ARGUMENT, "body");
    wrong.state = &foreign;
    refused(&wrong, AD_F64, 4, 8, AD_E_TAPE, "state 0");
    wrong.state = &constant;
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT, "state 0");
    wrong.state = v.in; /* twice */
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT, "input of a step 0 before");
    wrong = of;
    wrong.next = &narrow;
    refused(&wrong, AD_F64, 4, 8, AD_E_SHAPE, "next state 0");
    wrong = of;
    wrong.n_shared = 1; /* an input nobody sets */
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT, "operation 4");
    wrong = of;
    wrong.n_state = 0; /* nor this one */
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT, "operation 1");
    wrong = of;
    wrong.next = NULL;
    refused(&wrong, AD_F64, 4, 8, AD_E_TAPE, "next state 0");
    ad_matmul(foreign, false, foreign, false);
    wrong.tape = other;
    refused(&wrong, AD_F64, 4, 8, AD_E_SHAPE, "body"); /* the error of the body */
    assert_int_equal(ad_scan(NULL, &of, 1, NULL, NULL, NULL, NULL, NULL), AD_E_TAPE);
    ad_tape_free(body);
    ad_tape_free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_errors_name_the_step),
        cmocka_unit_test(test_checked),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests_name("scan errors", tests, NULL, NULL);
}
