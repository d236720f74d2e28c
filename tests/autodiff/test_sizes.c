/* Sizes that no memory holds, or that do not go together, are refused by name, number and label. */
#include "refused.h"
#include "support.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t sizes[] = {
    ((size_t)1 << 31) - 1,
    (size_t)1 << 31,
    ((size_t)1 << 31) + 1,
    UINT32_MAX - 1,
    UINT32_MAX,
    (size_t)1 << 32,
    ((size_t)1 << 32) + 1,
    ((size_t)1 << 32) + 3,
    ((size_t)1 << 63) - 1,
    (size_t)1 << 63,
    ((size_t)1 << 63) + 1,
    ((size_t)1 << 63) + 3,
    SIZE_MAX - 1,
    SIZE_MAX,
    0,
};

enum { N_SIZES = sizeof sizes / sizeof sizes[0] };

/* Recorded as large as it was to be, or refused; never smaller. */
static void assert_size(ad_tape *t, ad_var y, size_t rows, size_t cols, const char *op)
{
    bool fits =
        rows && cols && rows <= INT32_MAX && cols <= INT32_MAX && rows * cols <= (size_t)1 << 46;
    if (!fits) {
        assert_refused(t, AD_E_SHAPE, op, "near");
    } else {
        assert_tape_ok(t);
        assert_int_equal(ad_rows(y), rows);
        assert_int_equal(ad_cols(y), cols);
    }
    ad_tape_reset(t);
}

static ad_var near_input(ad_tape *t, size_t rows, size_t cols)
{
    return ad_input(t, rows, cols, "near");
}

static ad_var tall(ad_tape *t, size_t rows) { return ad_broadcast(near_input(t, 1, 1), rows, 1); }

static ad_var wide(ad_tape *t, size_t cols) { return ad_broadcast(near_input(t, 1, 1), 1, cols); }

/* E3: sizes a caller says. */
static void test_sizes_said(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    const uint32_t zero[3] = {0, 0, 0};
    for (size_t i = 0; i < N_SIZES; i++)
        for (size_t j = 0; j < 4; j++) {
            size_t n = sizes[i], m = j < 2 ? j + 1 : sizes[(i + j) % N_SIZES];
            near_input(t, 1, 1);
            assert_size(t, ad_input(t, n, m, NULL), n, m, "input");
            near_input(t, 1, 1);
            assert_size(t, ad_broadcast(near_input(t, 1, 1), n, m), n, m, "broadcast");
            near_input(t, 1, 1);
            assert_size(t, ad_place(t, n, m, 0, NULL, NULL, NULL), n, m, "place");
            near_input(t, 1, 1);
            assert_size(t, ad_place(t, m, n, 0, NULL, NULL, NULL), m, n, "place");
            if (n <= INT32_MAX)
                continue;
            near_input(t, 1, 1);
            ad_const(t, n, m, NULL); /* nothing is read */
            assert_refused(t, AD_E_SHAPE, "constant", "near");
            ad_tape_reset(t);
            ad_reshape(near_input(t, 3, 4), n, m);
            assert_refused(t, AD_E_SHAPE, "reshape", "near");
            ad_tape_reset(t);
            ad_gather_rows(near_input(t, 3, 4), n, NULL);
            assert_refused(t, AD_E_SHAPE, "gather", "near");
            ad_tape_reset(t);
            ad_diff_adjoint(near_input(t, 3, 4), 1, j & 1, n);
            assert_refused(t, AD_E_SHAPE, "diff_adjoint", "near");
            ad_tape_reset(t);
            ad_place(t, 3, 4, 1, (ad_var[]){near_input(t, 2, 2)}, &n, (size_t[]){0});
            assert_refused(t, AD_E_SHAPE, "place", "near");
            ad_tape_reset(t);
            ad_place(t, 3, 4, 1, (ad_var[]){near_input(t, 2, 2)}, (size_t[]){0}, &n);
            assert_refused(t, AD_E_SHAPE, "place", "near");
            ad_tape_reset(t);
        }
    for (size_t i = 0; i < N_SIZES; i++)
        assert_size(t, ad_scatter_rows(near_input(t, 3, 4), zero, sizes[i]), sizes[i], 4,
                    "scatter");
    ad_tape_free(t);
}

/* E3, E11: slices, whose last row or column may wrap, or be one too many. */
static void test_slices(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    enum { ROWS = 3, COLS = 4 };
    for (size_t i = 0; i < N_SIZES + 7; i++)
        for (size_t j = 0; j < N_SIZES + 7; j++) {
            size_t first = i < N_SIZES ? sizes[i] : i - N_SIZES;
            size_t count = j < N_SIZES ? sizes[j] : j - N_SIZES;
            for (int cols = 0; cols < 2; cols++) {
                size_t n = cols ? COLS : ROWS;
                bool fits = count >= 1 && first <= n && count <= n - first;
                ad_var x = near_input(t, ROWS, COLS);
                ad_var y = cols ? ad_slice_cols(x, first, count) : ad_slice_rows(x, first, count);
                if (fits) {
                    assert_tape_ok(t);
                    assert_int_equal(cols ? ad_cols(y) : ad_rows(y), count);
                } else {
                    assert_refused(t, AD_E_SHAPE, "slice", "near");
                }
                ad_tape_reset(t);
                x = near_input(t, ROWS, COLS);
                if (cols)
                    ad_col(x, first);
                else
                    ad_row(x, first);
                assert_int_equal(ad_tape_error(t)->status, first < n ? AD_OK : AD_E_SHAPE);
                ad_tape_reset(t);
            }
        }
    ad_tape_free(t);
}

/* E3: sizes that come of two operands. */
static void test_sizes_of_operands(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    static const size_t large[] = {1u << 22, 1u << 23, 1u << 24, 1u << 30, INT32_MAX};
    static const enum ad_op binary[] = {
#define AD_BINARY(name, value, da, db, lo, hi) AD_OP_##name,
#include "autodiff/ops.def"
    };
    for (size_t i = 0; i < 5; i++)
        for (size_t j = 0; j < 5; j++) {
            size_t n = large[i], m = large[j];
            for (size_t k = 0; k < sizeof binary / sizeof binary[0]; k++) {
                if (binary[k] == AD_OP_powi)
                    continue;
                ad_var y = ad_binary(binary[k], ad_arg_var(tall(t, n)), ad_arg_var(wide(t, m)));
                assert_size(t, y, n, m, ad_op_name(binary[k]));
            }
            assert_size(t, ad_select(tall(t, n), wide(t, m), 0.0), n, m, "select");
            assert_size(t, ad_select(1.0, wide(t, m), tall(t, n)), n, m, "select");
            assert_size(t, ad_matmul(tall(t, n), false, wide(t, m), false), n, m, "matmul");
            assert_size(t, ad_matmul(wide(t, n), true, tall(t, m), true), n, m, "matmul");
            assert_size(t, ad_concat_rows(2, (ad_var[]){tall(t, n), tall(t, m)}), n + m, 1,
                        "concat_rows");
            assert_size(t, ad_concat_cols(2, (ad_var[]){wide(t, n), wide(t, m)}), 1, n + m,
                        "concat_cols");
            if (n * m <= (size_t)1 << 46)
                continue;
            ad_dot(tall(t, n), wide(t, m));
            assert_refused(t, AD_E_SHAPE, "dot", "near");
            ad_tape_reset(t);
        }
    assert_size(t, ad_transpose(tall(t, INT32_MAX)), 1, INT32_MAX, "transpose");
    assert_size(t, ad_diff(wide(t, INT32_MAX), 1, true), 1, INT32_MAX, "diff");
    assert_size(t, ad_diff_adjoint(wide(t, INT32_MAX), 1, false, (size_t)INT32_MAX + 1), 1,
                (size_t)INT32_MAX + 1, "diff_adjoint");
    ad_tape_free(t);
}

/* E3: more memory together than addresses there are. */
static void test_memory_that_wraps(void **state)
{
    (void)state;
    enum { N = 33000 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var *y = malloc(N * sizeof *y), x = ad_input(t, 1, 1, "x");
    ad_var large = ad_broadcast(x, 1 << 23, 1 << 23);
    for (int k = 0; k < N; k++)
        y[k] = ad_add(large, k + 1.0);
    assert_tape_ok(t);
    ad_program *p;
    assert_int_equal(ad_compile(t, N, y, &p), AD_E_MEMORY);
    assert_null(p);
    free(y);
    ad_tape_free(t);
}

/* C2: rows of an index list, and columns of the value. */
static void test_gather_shapes(void **state)
{
    (void)state;
    enum { N = 12497500 };
    ad_tape *t = ad_tape_new(AD_F64);
    uint32_t *rows = calloc(N, sizeof *rows);
    ad_var x = near_input(t, 3, 1);
    assert_non_null(rows);
    assert_size(t, ad_gather_rows(x, N, rows), N, 1, "gather");
    x = near_input(t, 3, 4);
    ad_gather_rows(x, 0, rows);
    assert_refused(t, AD_E_SHAPE, "gather", "0 x 4");
    free(rows);
    ad_tape_free(t);
}

/* C3: operands by label, or by the nearest before them. */
static void test_operands_are_named(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var theta = ad_input(t, 3, 7, "theta"), other = ad_input(t, 2, 7, NULL), y = ad_exp(other);
    for (int k = 0; k < 1000; k++)
        y = ad_sin(y);
    ad_label(ad_cos(y), "later");
    ad_add(theta, y);
    assert_refused(t, AD_E_SHAPE, "add", "3 x 7 \"theta\"");
    assert_mentions(ad_tape_error(t)->message, "2 x 7 sin 1003 \"theta\"");
    assert_null(strstr(ad_tape_error(t)->message, "later"));
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sizes_said),        cmocka_unit_test(test_slices),
        cmocka_unit_test(test_sizes_of_operands), cmocka_unit_test(test_memory_that_wraps),
        cmocka_unit_test(test_gather_shapes),     cmocka_unit_test(test_operands_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
