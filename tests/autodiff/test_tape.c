/* Recording: errors and their stickiness, variables of other tapes, reset and reuse. */
#include "support.h"
#include "tests/mentions.h"

#include <string.h>

/* ---- errors ---- */

static void assert_error(ad_tape *tape, enum ad_status status, const char *op, const char *shape)
{
    const struct ad_error *e = ad_tape_error(tape);
    assert_int_equal(e->status, status);
    assert_mentions(e->message, op);
    assert_mentions(e->message, shape);
    ad_tape_reset(tape);
    assert_int_equal(ad_tape_error(tape)->status, AD_OK);
}

static void test_shape_errors(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    const uint32_t beyond[] = {0, 3};
    ad_add(ad_input(t, 3, 7, NULL), ad_input(t, 3, 8, NULL));
    assert_error(t, AD_E_SHAPE, "add", "3 x 8");
    ad_atan2(ad_input(t, 2, 5, NULL), ad_input(t, 3, 1, NULL));
    assert_error(t, AD_E_SHAPE, "atan2", "2 x 5");
    ad_select(ad_input(t, 2, 5, NULL), ad_input(t, 2, 1, NULL), ad_input(t, 3, 1, NULL));
    assert_error(t, AD_E_SHAPE, "select", "3 x 1");
    ad_matmul(ad_input(t, 3, 7, NULL), false, ad_input(t, 7, 2, NULL), true);
    assert_error(t, AD_E_SHAPE, "matmul", "3 x 7");
    ad_slice_rows(ad_input(t, 3, 7, NULL), 2, 2);
    assert_error(t, AD_E_SHAPE, "slice", "3 x 7");
    ad_slice_cols(ad_input(t, 3, 7, NULL), 1, SIZE_MAX);
    assert_error(t, AD_E_SHAPE, "slice", "3 x 7");
    ad_col(ad_input(t, 3, 7, NULL), 7);
    assert_error(t, AD_E_SHAPE, "slice", "3 x 7");
    ad_reshape(ad_input(t, 3, 7, NULL), 4, 5);
    assert_error(t, AD_E_SHAPE, "reshape", "4 x 5");
    ad_broadcast(ad_input(t, 3, 7, NULL), 6, 7);
    assert_error(t, AD_E_SHAPE, "broadcast", "6 x 7");
    ad_gather_rows(ad_input(t, 3, 7, NULL), 2, beyond);
    assert_error(t, AD_E_SHAPE, "gather", "3");
    ad_scatter_rows(ad_input(t, 2, 7, NULL), beyond, 3);
    assert_error(t, AD_E_SHAPE, "scatter", "3");
    ad_diff(ad_input(t, 3, 1, NULL), 1, false);
    assert_error(t, AD_E_SHAPE, "diff", "3 x 1");
    ad_concat_rows(2, (ad_var[]){ad_input(t, 3, 7, NULL), ad_input(t, 3, 6, NULL)});
    assert_error(t, AD_E_SHAPE, "", "");
    ad_place(t, 4, 4, 1, (ad_var[]){ad_input(t, 3, 3, NULL)}, (size_t[]){2}, (size_t[]){0});
    assert_error(t, AD_E_SHAPE, "place", "4 x 4");
    ad_input(t, 0, 5, NULL);
    assert_error(t, AD_E_SHAPE, "input", "0 x 5");
    ad_input(t, SIZE_MAX / 2, 5, NULL);
    assert_error(t, AD_E_SHAPE, "input", "");
    ad_tape_free(t);
}

/* The first error is kept, everything after passes through, ad_grad and ad_compile return it. */
static void test_errors_are_sticky(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 7, NULL), g;
    ad_var wrong = ad_mul(x, ad_input(t, 2, 7, NULL));
    ad_var y = ad_sum(ad_exp(ad_matmul(wrong, false, ad_row(wrong, 90), false)));
    assert_int_equal(ad_grad(y, 1, &x, &g), AD_E_SHAPE);
    ad_program *p = (ad_program *)t;
    assert_int_equal(ad_compile(t, 1, &y, &p), AD_E_SHAPE);
    assert_null(p);
    assert_mentions(ad_tape_error(t)->message, "mul");
    assert_null(strchr(ad_tape_error(t)->message, '\n'));
    ad_tape_free(t);
}

static void test_variables_of_two_tapes(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 4, NULL), y = ad_input(other, 1, 4, NULL), g;
    ad_add(x, y);
    assert_error(t, AD_E_TAPE, "add", "tape");
    x = ad_input(t, 4, 4, NULL);
    ad_matmul(x, false, ad_input(other, 4, 4, NULL), false);
    assert_error(t, AD_E_TAPE, "matmul", "tape");
    ad_concat_rows(2, (ad_var[]){ad_input(t, 1, 4, NULL), y});
    assert_error(t, AD_E_TAPE, "", "tape");
    x = ad_sum(ad_input(t, 4, 4, NULL));
    assert_int_equal(ad_grad(x, 1, &y, &g), AD_E_TAPE);
    assert_error(t, AD_E_TAPE, "grad", "tape");
    ad_program *p;
    assert_int_equal(ad_compile(t, 1, &y, &p), AD_E_TAPE);
    assert_null(p);
    ad_tape_free(t);
    ad_tape_free(other);
}

static void test_setting_and_getting_strangers(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 4, NULL), unused = ad_input(t, 1, 4, NULL);
    ad_var inner = ad_sin(x), y = ad_sum(inner);
    ad_program *p = compile(t, 1, &y);
    double v[4] = {1, 2, 3, 4};
    assert_int_equal(ad_set(p, x, v), AD_OK);
    assert_int_equal(ad_set(p, unused, v), AD_OK);
    assert_int_equal(ad_set(p, inner, v), AD_E_TAPE);
    assert_int_equal(ad_set(p, y, v), AD_E_TAPE);
    assert_int_equal(ad_get(p, inner, v), AD_E_TAPE);
    assert_null(ad_data(p, inner));
    assert_non_null(ad_data(p, x));
    ad_program_free(p);
    ad_program_free(NULL);
    ad_tape_free(t);
    ad_tape_free(NULL);
}

static void test_fail_keeps_the_first(void **state)
{
    (void)state;
    struct ad_error e = {0};
    char text[600];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = 0;
    assert_int_equal(ad_fail(&e, AD_E_IO, "%s", text), AD_E_IO);
    assert_int_equal(strlen(e.message), sizeof e.message - 1);
    assert_int_equal(ad_fail(&e, AD_E_SHAPE, "second"), AD_E_IO);
    assert_true(e.message[0] == 'x');
}

/* ---- reuse ---- */

/* A reset tape keeps its memory; programs outlive it. */
static void test_reset_and_reuse(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    size_t bytes = 0;
    ad_program *kept = NULL;
    ad_var first_x = {0}, first_y = {0};
    for (int round = 0; round < 5; round++) {
        ad_var x = ad_input(t, 2, 3, "x"), y = x, g;
        for (int k = 0; k < 20000; k++)
            y = ad_sin(ad_add(y, 0.1 * round));
        assert_int_equal(ad_grad(ad_sum(y), 1, &x, &g), AD_OK);
        if (round == 0) {
            kept = compile(t, 1, &y);
            first_x = x;
            first_y = y;
        }
        if (round > 1)
            assert_int_equal(ad_tape_bytes(t), bytes);
        bytes = ad_tape_bytes(t);
        ad_tape_reset(t);
        assert_true(ad_tape_size(t) < 10);
    }
    ad_tape_free(t);
    double v[6] = {1, 2, 3, 4, 5, 6};
    assert_int_equal(ad_set(kept, first_x, v), AD_OK);
    ad_run(kept);
    assert_int_equal(ad_get(kept, first_y, v), AD_OK);
    double expected = 1;
    for (int k = 0; k < 20000; k++)
        expected = sin(expected);
    assert_close(v[0], expected, 1e-10, 0);
    ad_program_free(kept);
}

/* A gradient, and its gradient, cost a fixed number of nodes for each node, by however many inputs.
 */
static size_t nodes_of(size_t n, bool twice)
{
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[64], g[64], y = ad_scalar(t, 0.3);
    for (size_t k = 0; k < LENGTH(x); k++)
        x[k] = ad_input(t, 1, 1, NULL);
    for (size_t k = 0; k < n; k++)
        y = ad_sin(ad_add(ad_mul(y, x[k % LENGTH(x)]), ad_exp(x[(k + 7) % LENGTH(x)])));
    assert_int_equal(ad_grad(y, LENGTH(x), x, g), AD_OK);
    if (twice)
        assert_int_equal(ad_grad(ad_mul(g[3], g[5]), LENGTH(x), x, g), AD_OK);
    size_t nodes = ad_tape_size(t);
    ad_tape_free(t);
    return nodes;
}

static void test_cost_of_a_gradient(void **state)
{
    (void)state;
    for (int twice = 0; twice < 2; twice++) {
        double few = (double)nodes_of(500, twice), many = (double)nodes_of(4000, twice);
        assert_close(many / few, 8, 0.05, 0);
        assert_true(many < (twice ? 60 : 12) * 4 * 4000.0);
    }
}

static void test_inputs_are_zero_until_set(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 2, "x"), y = ad_add(ad_sum(x), ad_sum(ad_mul(x, 1e300)));
    double values[6] = {1, 1, 1, 1, 1, 1}, sum = 1;
    ad_program *p;
    assert_int_equal(ad_compile(t, 1, &y, &p), AD_OK);
    ad_run(p);
    ad_get(p, x, values);
    ad_get(p, y, &sum);
    for (size_t k = 0; k < 6; k++)
        assert_true(values[k] == 0);
    assert_true(sum == 0);
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_inputs_are_zero_until_set),
        cmocka_unit_test(test_cost_of_a_gradient),
        cmocka_unit_test(test_shape_errors),
        cmocka_unit_test(test_errors_are_sticky),
        cmocka_unit_test(test_variables_of_two_tapes),
        cmocka_unit_test(test_setting_and_getting_strangers),
        cmocka_unit_test(test_fail_keeps_the_first),
        cmocka_unit_test(test_reset_and_reuse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
