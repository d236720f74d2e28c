/* Outputs of every kind: inputs, constants, views and gradients; their storage. */
#include "support.h"

#include <stdlib.h>

static void test_unusual_outputs(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    double v[] = {1, 2, 3, 4, 5, 6}, c[] = {0.5, 1.5}, got[6];
    ad_var x = ad_input(t, 2, 3, "x"), constant = ad_const(t, 2, 1, c), row = ad_row(x, 1);
    ad_var shape = ad_reshape(x, 3, 2), wide = ad_broadcast(constant, 2, 3);
    ad_var out[] = {x, constant, row, row, shape, wide, ad_col(shape, 1), ad_transpose(row)};
    ad_program *p = compile(t, sizeof out / sizeof out[0], out);
    double *storage[8];
    for (int k = 0; k < 8; k++) {
        storage[k] = ad_data(p, out[k]);
        assert_non_null(storage[k]);
    }
    assert_ptr_equal(storage[2], storage[3]);
    for (int round = 0; round < 2; round++) {
        assert_int_equal(ad_set(p, x, v), AD_OK);
        ad_run(p);
        const double expected[8][6] = {{v[0], v[1], v[2], v[3], v[4], v[5]},
                                       {0.5, 1.5},
                                       {v[3], v[4], v[5]},
                                       {v[3], v[4], v[5]},
                                       {v[0], v[1], v[2], v[3], v[4], v[5]},
                                       {0.5, 0.5, 0.5, 1.5, 1.5, 1.5},
                                       {v[1], v[3], v[5]},
                                       {v[3], v[4], v[5]}};
        for (int k = 0; k < 8; k++) {
            size_t n = ad_rows(out[k]) * ad_cols(out[k]);
            assert_int_equal(ad_get(p, out[k], got), AD_OK);
            assert_memory_equal(got, expected[k], n * sizeof *got);
            assert_memory_equal(storage[k], expected[k], n * sizeof *got);
        }
        for (int i = 0; i < 6; i++)
            v[i] += 10;
    }
    ad_program_free(p);
    ad_tape_free(t);
}

/* ad_data is the storage itself, for both types; writing there is setting. */
static void test_data_is_the_storage(void **state)
{
    (void)state;
    for (enum ad_type type = AD_F32; type <= AD_F64; type++) {
        ad_tape *t = ad_tape_new(type);
        ad_var x = ad_input(t, 2, 129, NULL), y = ad_mul(3.0, x);
        ad_program *p = compile(t, 1, &y);
        void *in = ad_data(p, x), *out = ad_data(p, y);
        for (size_t i = 0; i < 2 * 129; i++) {
            double value = 0.25 * (double)i;
            if (type == AD_F32)
                ((float *)in)[i] = (float)value;
            else
                ((double *)in)[i] = value;
        }
        ad_run(p);
        assert_ptr_equal(in, ad_data(p, x));
        assert_ptr_equal(out, ad_data(p, y));
        for (size_t i = 0; i < 2 * 129; i++) {
            double got = type == AD_F32 ? (double)((float *)out)[i] : ((double *)out)[i];
            assert_true(got == 0.75 * (double)i);
        }
        ad_program_free(p);
        ad_tape_free(t);
    }
}

static void test_inputs_start_at_zero(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 100, NULL), y = ad_sum(ad_cos(x));
    assert_close(evaluate_scalar(y, 0, NULL, NULL), 300, 0, 0);
    ad_tape_free(t);
}

static void test_gradient_of_what_does_not_depend(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 3, NULL), other = ad_input(t, 3, 1, NULL), g[2];
    ad_var y = ad_sum(ad_sin(x)), late;
    assert_int_equal(ad_grad(y, 2, (ad_var[]){other, x}, g), AD_OK);
    late = ad_input(t, 1, 4, NULL);
    ad_var h;
    assert_int_equal(ad_grad(y, 1, &late, &h), AD_OK);
    assert_int_equal(ad_rows(g[0]), 3);
    assert_int_equal(ad_cols(h), 4);
    double *zero = evaluate(g[0], 0, NULL, NULL), *none = evaluate(h, 0, NULL, NULL);
    for (int i = 0; i < 3; i++)
        assert_true(zero[i] == 0 && none[i] == 0);
    free(zero);
    free(none);
    ad_tape_free(t);
}

/* y itself, the same x twice, and an x that is no input. */
static void test_gradient_by_inner_values(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 3, NULL), inner = ad_square(x), y = ad_sin(inner), g[4];
    double v[] = {1, 2, 3, 4, 5, 6}, got[6];
    assert_int_equal(ad_grad(y, 4, (ad_var[]){y, inner, x, x}, g), AD_OK);
    ad_program *p = compile(t, 4, g);
    ad_set(p, x, v);
    ad_run(p);
    for (int i = 0; i < 6; i++) {
        ad_get(p, g[0], got);
        assert_true(got[i] == 1);
        ad_get(p, g[1], got);
        assert_close(got[i], cos(v[i] * v[i]), 1e-14, 0);
        ad_get(p, g[2], got);
        assert_close(got[i], 2 * v[i] * cos(v[i] * v[i]), 1e-14, 0);
        ad_get(p, g[3], got);
        assert_close(got[i], 2 * v[i] * cos(v[i] * v[i]), 1e-14, 0);
    }
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unusual_outputs),
        cmocka_unit_test(test_data_is_the_storage),
        cmocka_unit_test(test_inputs_start_at_zero),
        cmocka_unit_test(test_gradient_of_what_does_not_depend),
        cmocka_unit_test(test_gradient_by_inner_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
