/* Errors of recording, by operation, number and label: invalid variables, sizes beyond any memory.
 */
#include "refused.h"
#include "support.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- every operation on one variable ---- */

typedef ad_var operation(ad_var x);

#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    static ad_var op_##name(ad_var x) { return ad_##name(x); }
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    static ad_var op_##name(ad_var x)                                                              \
    {                                                                                              \
        return ad_binary(AD_OP_##name, AD_ARG(x), ad_arg_number(1.5));                             \
    }                                                                                              \
    static ad_var right_##name(ad_var x)                                                           \
    {                                                                                              \
        return ad_binary(AD_OP_##name, ad_arg_number(1.5), AD_ARG(x));                             \
    }
#include "autodiff/ops.def"

static ad_var op_select(ad_var x) { return ad_select(x, 1.0, 2.0); }

static ad_var op_sum(ad_var x) { return ad_sum(x); }

static ad_var op_sum_rows(ad_var x) { return ad_sum_rows(x); }

static ad_var op_sum_cols(ad_var x) { return ad_sum_cols(x); }

static ad_var op_mean(ad_var x) { return ad_mean(x); }

static ad_var op_dot(ad_var x) { return ad_dot(x, x); }

static ad_var op_matmul(ad_var x) { return ad_matmul(x, true, x, false); }

static ad_var op_transpose(ad_var x) { return ad_transpose(x); }

static ad_var op_row(ad_var x) { return ad_row(x, 0); }

static ad_var op_col(ad_var x) { return ad_col(x, 0); }

static ad_var op_slice_rows(ad_var x) { return ad_slice_rows(x, 0, 1); }

static ad_var op_slice_cols(ad_var x) { return ad_slice_cols(x, 0, 1); }

static ad_var op_reshape(ad_var x) { return ad_reshape(x, 1, 12); }

static ad_var op_broadcast(ad_var x) { return ad_broadcast(x, 3, 4); }

static ad_var op_gather(ad_var x) { return ad_gather_rows(x, 1, (uint32_t[]){0}); }

static ad_var op_scatter(ad_var x) { return ad_scatter_rows(x, (uint32_t[]){0, 0, 0}, 1); }

static ad_var op_gather_cols(ad_var x) { return ad_gather_cols(x, 1, (uint32_t[]){0}); }

static ad_var op_scatter_cols(ad_var x) { return ad_scatter_cols(x, (uint32_t[]){0, 0, 0, 0}, 1); }

static ad_var op_solve(ad_var x) { return ad_solve(x, x, AD_LU); }

static ad_var op_inverse(ad_var x) { return ad_inverse(x, AD_CHOLESKY); }

static ad_var op_product(ad_var x) { return ad_product(x, x, 1); }

static ad_var op_logdet(ad_var x) { return ad_logdet(x, AD_LU); }

static ad_var op_concat_rows(ad_var x) { return ad_concat_rows(2, (ad_var[]){x, x}); }

static ad_var op_concat_cols(ad_var x) { return ad_concat_cols(2, (ad_var[]){x, x}); }

static ad_var op_diff(ad_var x) { return ad_diff(x, 1, false); }

static ad_var op_diff_adjoint(ad_var x) { return ad_diff_adjoint(x, 1, false, 5); }

static ad_var op_hold(ad_var x) { return ad_hold(x); }

static const struct {
    const char *name;
    operation *record;
} operations[] = {
#define AD_UNARY(name, value, dx, lo, hi) {#name, op_##name},
#define AD_BINARY(name, value, da, db, lo, hi) {#name, op_##name}, {#name, right_##name},
#include "autodiff/ops.def"
    {"select", op_select},
    {"sum", op_sum},
    {"sum_rows", op_sum_rows},
    {"sum_cols", op_sum_cols},
    {"mean", op_mean},
    {"dot", op_dot},
    {"matmul", op_matmul},
    {"transpose", op_transpose},
    {"slice", op_row},
    {"slice", op_col},
    {"slice", op_slice_rows},
    {"slice", op_slice_cols},
    {"reshape", op_reshape},
    {"broadcast", op_broadcast},
    {"gather", op_gather},
    {"scatter", op_scatter},
    {"gather_cols", op_gather_cols},
    {"scatter_cols", op_scatter_cols},
    {"cumsum", ad_cumsum_rows},
    {"solve", op_solve},
    {"inverse", op_inverse},
    {"logdet", op_logdet},
    {"product", op_product},
    {"cumsum", ad_cumsum_cols},
    {"max_rows", ad_max_rows},
    {"max_cols", ad_max_cols},
    {"min_rows", ad_min_rows},
    {"min_cols", ad_min_cols},
    {"arg_max_rows", ad_arg_max_rows},
    {"arg_max_cols", ad_arg_max_cols},
    {"log_sum_exp_rows", ad_log_sum_exp_rows},
    {"log_sum_exp_cols", ad_log_sum_exp_cols},
    {"softmax_rows", ad_softmax_rows},
    {"softmax_cols", ad_softmax_cols},
    {"concat_rows", op_concat_rows},
    {"concat_cols", op_concat_cols},
    {"diff", op_diff},
    {"diff_adjoint", op_diff_adjoint},
    {"hold", op_hold},
};

enum { N_OPERATIONS = sizeof operations / sizeof operations[0] };

/* A23 */
static void test_never_recorded(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    for (size_t k = 0; k < N_OPERATIONS; k++) {
        ad_tape_reset(t);
        ad_var near = ad_input(t, 3, 4, "near"), none = operations[k].record((ad_var){0});
        none = ad_atan2(none, ad_square((ad_var){0})); /* the first is named */
        assert_null(none.tape);
        ad_var y = ad_add(near, none), g;
        assert_refused(t, AD_E_TAPE, operations[k].name, "near");
        ad_program *p;
        assert_int_equal(ad_grad(y, 1, &near, &g), AD_E_TAPE);
        assert_int_equal(ad_compile(t, 1, &y, &p), AD_E_TAPE);
        assert_null(p);
        ad_tape_reset(t); /* seen by ad_grad and ad_compile alone */
        near = ad_input(t, 3, 4, "near");
        assert_int_equal(ad_grad(none, 1, &near, &g), AD_E_TAPE);
        assert_refused(t, AD_E_TAPE, operations[k].name, "near");
        ad_tape_reset(t);
        near = ad_input(t, 3, 4, "near");
        assert_int_equal(ad_compile(t, 1, &none, &p), AD_E_TAPE);
        assert_refused(t, AD_E_TAPE, operations[k].name, "near");
    }
    ad_tape_free(t);
}

/* A23: beside variables that are. */
static void test_never_recorded_beside_others(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    static const char *const names[] = {"add",         "mul",         "atan2",  "select", "select",
                                        "select",      "matmul",      "matmul", "dot",    "dot",
                                        "concat_rows", "concat_cols", "place",  "grad"};
    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
        ad_tape_reset(t);
        ad_var x = ad_input(t, 3, 3, "near"), none = {0}, g[2];
        switch (k) {
        case 0:
            ad_add(x, none);
            break;
        case 1:
            ad_mul(none, x);
            break;
        case 2:
            ad_atan2(x, none);
            break;
        case 3:
            ad_select(none, x, x);
            break;
        case 4:
            ad_select(x, none, 1.0);
            break;
        case 5:
            ad_select(x, 1.0, none);
            break;
        case 6:
            ad_matmul(none, false, x, false);
            break;
        case 7:
            ad_matmul(x, false, none, false);
            break;
        case 8:
            ad_dot(x, none);
            break;
        case 9:
            ad_dot(none, x);
            break;
        case 10:
            ad_concat_rows(2, (ad_var[]){none, x});
            break;
        case 11:
            ad_concat_cols(2, (ad_var[]){x, none});
            break;
        case 12:
            ad_place(t, 3, 3, 1, &none, (size_t[]){0}, (size_t[]){0});
            break;
        default:
            ad_grad(ad_sum(x), 2, (ad_var[]){x, none}, g);
            break;
        }
        assert_refused(t, AD_E_TAPE, names[k], "near");
    }
    ad_tape_free(t);
}

/* A23: of nothing at all. */
static void test_concat_of_nothing(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    static const char *const names[] = {"concat_rows", "concat_cols"};
    for (int k = 0; k < 2; k++) {
        ad_tape_reset(t);
        ad_var x = ad_input(t, 3, 3, "near");
        ad_mul(x, k ? ad_concat_cols(0, NULL) : ad_concat_rows(0, NULL));
        assert_refused(t, AD_E_TAPE, names[k], "near");
    }
    ad_tape_free(t);
}

static void test_no_tape(void **state)
{
    (void)state;
    double one = 1;
    ad_var none = {0}, g;
    assert_null(ad_input(NULL, 1, 1, "x").tape);
    assert_null(ad_const(NULL, 1, 1, &one).tape);
    assert_null(ad_scalar(NULL, 1).tape);
    assert_null(ad_place(NULL, 1, 1, 0, NULL, NULL, NULL).tape);
    assert_null(ad_refuse(NULL, AD_E_SHAPE, "x").tape);
    assert_null(ad_label(none, "x").tape);
    assert_int_equal(ad_grad(none, 1, &none, &g), AD_E_TAPE);
    assert_int_equal(ad_tape_error(NULL)->status, AD_E_MEMORY);
}

/* ---- of another tape, of an earlier recording ---- */

/* G3 */
static void test_earlier_recording(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    for (size_t k = 0; k < N_OPERATIONS; k++) {
        ad_tape_reset(t);
        ad_var old = ad_exp(ad_input(t, 3, 4, "old")), g;
        ad_tape_reset(t);
        assert_int_equal(ad_rows(old), 0);
        assert_int_equal(ad_cols(old), 0);
        ad_var x = ad_sin(ad_input(t, 3, 4, "near"));
        operations[k].record(old);
        assert_refused(t, AD_E_TAPE, operations[k].name, "near");
        ad_tape_reset(t);
        x = ad_sin(ad_input(t, 3, 4, "near"));
        assert_int_equal(ad_grad(ad_sum(x), 1, &old, &g), AD_E_TAPE);
        ad_tape_reset(t);
        ad_input(t, 3, 4, "near");
        ad_label(old, "again");
        assert_refused(t, AD_E_TAPE, "label", "near");
        ad_tape_reset(t); /* shorter than `old` says */
        ad_program *p;
        assert_int_equal(ad_compile(t, 1, &old, &p), AD_E_TAPE);
        assert_null(p);
    }
    ad_tape_free(t);
}

static void assert_freed(const ad_tape *t)
{
    assert_int_equal(ad_tape_error(t)->status, AD_E_TAPE);
    assert_mentions(ad_tape_error(t)->message, "freed");
}

/* Variables of a freed tape, and the tape: errors until 64 more are freed. */
static void test_freed_tape(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 4, "x"), old = ad_exp(x), g;
    ad_program *p;
    double value = 7;
    struct ad_error error = {0};
    ad_tape_free(t);
    for (int k = 1; k < 64; k++) {
        ad_tape *live = ad_tape_new(AD_F64);
        ad_var near = ad_input(live, 3, 4, "near");
        ad_add(near, old);
        assert_freed(live);
        ad_tape_free(live);
    }
    for (size_t k = 0; k < N_OPERATIONS; k++) {
        ad_tape *live = ad_tape_new(AD_F64);
        ad_var y = operations[k].record(old);
        assert_freed(y.tape);
        assert_int_equal(ad_compile(live, 1, &y, &p), AD_E_TAPE);
        ad_tape_free(live);
        t = ad_tape_new(AD_F64);
        old = ad_exp(ad_input(t, 3, 4, "x"));
        ad_tape_free(t);
    }
    assert_int_equal(ad_rows(old), 0);
    assert_int_equal(ad_grad(old, 1, &old, &g), AD_E_TAPE);
    assert_int_equal(ad_evaluate(0, NULL, NULL, old, &value, &error), AD_E_TAPE);
    assert_mentions(error.message, "freed");
    assert_true(value == 7);
    ad_tape_reset(t);
    ad_tape_free(t);
    assert_freed(t);
    ad_input(t, 1, 1, "x");
    ad_const(t, 1, 2, (double[]){1, 2});
    ad_place(t, 8, 1, 1, &old, (size_t[]){0}, (size_t[]){0});
    assert_int_equal(ad_tape_size(t), 0);
    assert_int_equal(ad_compile(t, 0, NULL, &p), AD_E_TAPE);
    assert_false(ad_tape_same(t, NULL));
}

/* E4: where numbers of nodes agree, before and after tapes are reset, freed, made in their place.
 */
static void test_program_knows_its_variables(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 2, "x"), y = ad_square(x);
    ad_var strange = ad_input(other, 40, 50, "x");
    assert_int_equal(x.id, strange.id);
    ad_program *p = compile(t, 1, &y);
    double v[2] = {3, 4}, w[2000] = {0};
    for (int round = 0; round < 3; round++) {
        assert_int_equal(ad_set(p, strange, w), AD_E_TAPE);
        assert_int_equal(ad_get(p, strange, w), AD_E_TAPE);
        assert_null(ad_data(p, strange));
        assert_int_equal(ad_set(p, (ad_var){0}, w), AD_E_TAPE);
        assert_int_equal(ad_set(NULL, x, w), AD_E_TAPE);
        assert_int_equal(ad_set(p, x, v), AD_OK);
        ad_run(p);
        assert_int_equal(ad_get(p, y, w), AD_OK);
        assert_true(w[0] == 9 && w[1] == 16);
        assert_non_null(ad_data(p, x));
        if (round == 0) {
            ad_tape_reset(t);
        } else {
            ad_tape_free(t);
            t = ad_tape_new(AD_F64);
        }
        strange = ad_input(t, 40, 50, "x");
        assert_int_equal(x.id, strange.id);
    }
    ad_program_free(p);
    ad_tape_free(t);
    ad_tape_free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_never_recorded),
        cmocka_unit_test(test_never_recorded_beside_others),
        cmocka_unit_test(test_concat_of_nothing),
        cmocka_unit_test(test_no_tape),
        cmocka_unit_test(test_earlier_recording),
        cmocka_unit_test(test_freed_tape),
        cmocka_unit_test(test_program_knows_its_variables),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
