/* Every elementwise operation of ops.def: values against scalar libm, first and second order
   against differences, f32 against f64; all ways of broadcasting, sizes that cross the executor's
   blocks. */
#include "references.h"
#include "refused.h"
#include "support.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the table ---- */

struct op {
    const char *name;
    enum ad_op op;
    int arity;
    double lo, hi;
    double (*reference)(double, double, double);
};

static const struct op ops[] = {
#define AD_UNARY(name, value, dx, lo, hi) {#name, AD_OP_##name, 1, lo, hi, name##_reference},
#define AD_BINARY(name, value, da, db, lo, hi) {#name, AD_OP_##name, 2, lo, hi, name##_reference},
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    {#name, AD_OP_##name, 3, lo, hi, name##_reference},
#include "autodiff/ops.def"
};
enum { N_OPS = sizeof ops / sizeof ops[0] };

/* ---- arguments ---- */

enum kind { FULL, SCALAR, COLUMN, ROW, N_KINDS };

static const size_t sizes[][2] = {{1, 1}, {3, 7}, {5, 131}, {2, 1000}};
enum { N_SIZES = sizeof sizes / sizeof sizes[0] };

/* Every kind of each argument against every kind of its neighbour. */
static size_t combinations(int arity) { return arity == 1 ? 1 : N_KINDS * N_KINDS; }

static enum kind kind_of(int arity, size_t combination, int input)
{
    static const enum kind third[] = {FULL, ROW, SCALAR, COLUMN};
    if (arity == 1)
        return FULL;
    if (input == 2)
        return third[(combination + combination / N_KINDS) % N_KINDS];
    return (enum kind)(input ? combination / N_KINDS : combination % N_KINDS);
}

static bool kinked(enum ad_op op)
{
    switch (op) {
    case AD_OP_abs:
    case AD_OP_sign:
    case AD_OP_step:
    case AD_OP_relu:
    case AD_OP_min:
    case AD_OP_max:
    case AD_OP_lt:
    case AD_OP_le:
    case AD_OP_eq:
    case AD_OP_ne:
        return true;
    default:
        return false;
    }
}

/* Kinks (at 0, or where both arguments are equal) stay away from every value: input 0 lies around
   odd multiples of 1/16, input 1 around even ones. Conditions of select are 0 or something else. */
static double avoid_kinks(const struct op *op, int input, double x)
{
    if (op->op == AD_OP_select && input == 0)
        return x < 0 ? 0 : x;
    if (!kinked(op->op))
        return x;
    double cell = floor(x * 8), jitter = x * 8 - cell;
    return (float)((cell + (input ? 0.0 : 0.5) + 0.3 * jitter) / 8);
}

struct arguments {
    size_t rows, cols; /* of the result */
    size_t shape[3][2];
    double *at[3];
};

static struct arguments draw(const struct op *op, size_t size, size_t combination)
{
    struct arguments a = {.rows = 1, .cols = 1};
    uint64_t state = 1000 * (uint64_t)op->op + 100 * size + combination;
    for (int k = 0; k < op->arity; k++) {
        enum kind kind = kind_of(op->arity, combination, k);
        size_t rows = kind == FULL || kind == COLUMN ? sizes[size][0] : 1;
        size_t cols = kind == FULL || kind == ROW ? sizes[size][1] : 1;
        a.shape[k][0] = rows;
        a.shape[k][1] = cols;
        a.rows = rows > a.rows ? rows : a.rows;
        a.cols = cols > a.cols ? cols : a.cols;
        a.at[k] = random_values(&state, rows * cols, op->lo, op->hi);
        for (size_t i = 0; i < rows * cols; i++)
            a.at[k][i] = avoid_kinks(op, k, a.at[k][i]);
    }
    return a;
}

static void release(struct arguments *a)
{
    for (int k = 0; k < 3; k++)
        free(a->at[k]);
}

static double element(const struct arguments *a, int k, size_t r, size_t c)
{
    if (!a->at[k])
        return 0;
    size_t rows = a->shape[k][0], cols = a->shape[k][1];
    return a->at[k][(rows == 1 ? 0 : r) * cols + (cols == 1 ? 0 : c)];
}

static ad_var record(ad_tape *tape, const struct op *op, const struct arguments *a, ad_var x[3])
{
    for (int k = 0; k < op->arity; k++)
        x[k] = ad_input(tape, a->shape[k][0], a->shape[k][1], NULL);
    if (op->arity == 1)
        return ad_unary(op->op, x[0]);
    if (op->arity == 2)
        return ad_binary(op->op, AD_ARG(x[0]), AD_ARG(x[1]));
    return ad_ternary(op->op, AD_ARG(x[0]), AD_ARG(x[1]), AD_ARG(x[2]));
}

/* powi takes its exponent as a number: tested below. */
static bool applies(const struct op *op) { return op->op != AD_OP_powi; }

typedef void test(const struct op *op, const struct arguments *a);

static void for_each_op(test *f, size_t largest)
{
    for (size_t i = 0; i < N_OPS; i++)
        for (size_t s = 0; s < N_SIZES && applies(&ops[i]); s++)
            for (size_t c = 0; c < combinations(ops[i].arity); c++) {
                struct arguments a = draw(&ops[i], s, c);
                if (a.rows * a.cols <= largest)
                    f(&ops[i], &a);
                release(&a);
            }
}

/* ---- values ---- */

static void compare_values(const struct op *op, const struct arguments *a, enum ad_type type,
                           double rtol, double atol)
{
    ad_tape *tape = ad_tape_new(type);
    ad_var x[3], y = record(tape, op, a, x);
    double *v = evaluate(y, (size_t)op->arity, x, (const double *const *)a->at);
    assert_int_equal(ad_rows(y), a->rows);
    assert_int_equal(ad_cols(y), a->cols);
    for (size_t r = 0; r < a->rows; r++)
        for (size_t c = 0; c < a->cols; c++) {
            double in[] = {element(a, 0, r, c), element(a, 1, r, c), element(a, 2, r, c)};
            double expected = op->reference(in[0], in[1], in[2]), got = v[r * a->cols + c];
            if (!is_close(got, expected, rtol, atol))
                fail_msg("%s(%.17g, %.17g, %.17g) is %.17g, not %.17g", op->name, in[0], in[1],
                         in[2], got, expected);
        }
    free(v);
    ad_tape_free(tape);
}

/* libmvec promises 4 ulp. */
static void values_f64(const struct op *op, const struct arguments *a)
{
    compare_values(op, a, AD_F64, 1e-15, 4e-16);
}

static void values_f32(const struct op *op, const struct arguments *a)
{
    compare_values(op, a, AD_F32, 6e-7, 2e-7);
}

static void all_values(void)
{
    for_each_op(values_f64, SIZE_MAX);
    for_each_op(values_f32, SIZE_MAX);
}

static void test_values(void **state)
{
    (void)state;
    for_each_isa(all_values);
}

/* ---- derivatives ---- */

/* Its derivative is no limit of differences: test_reductions. */
static bool has_differences(const struct op *op) { return op->op != AD_OP_detach; }

static void first_order(const struct op *op, const struct arguments *a)
{
    if (!has_differences(op))
        return;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[3], y = weighted_sum(record(tape, op, a, x));
    assert_gradient(op->name, y, (size_t)op->arity, x, (const double *const *)a->at, 1e-8, 9);
    ad_tape_free(tape);
}

static void second_order(const struct op *op, const struct arguments *a)
{
    if (!has_differences(op))
        return;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[3], y = weighted_sum(record(tape, op, a, x));
    assert_second(op->name, y, (size_t)op->arity, x, (const double *const *)a->at, 1e-7, 5);
    ad_tape_free(tape);
}

static void test_first_order(void **state)
{
    (void)state;
    for_each_op(first_order, SIZE_MAX);
}

static void test_second_order(void **state)
{
    (void)state;
    for_each_op(second_order, 1000);
}

/* Third order: the second-order check of one entry's gradient. */
static void third_order(const struct op *op, const struct arguments *a)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[3], g[3], y = weighted_sum(record(tape, op, a, x));
    ad_grad(y, (size_t)op->arity, x, g);
    ad_var slope = weighted_sum(g[0]);
    for (int k = 1; k < op->arity; k++)
        slope = ad_add(slope, weighted_sum(g[k]));
    assert_second(op->name, slope, (size_t)op->arity, x, (const double *const *)a->at, 1e-6, 3);
    ad_tape_free(tape);
}

static void test_third_order(void **state)
{
    (void)state;
    for_each_op(third_order, 21);
}

static double *gradient_of_first(const struct op *op, const struct arguments *a, enum ad_type type)
{
    ad_tape *tape = ad_tape_new(type);
    ad_var x[3], g[3], y = weighted_sum(record(tape, op, a, x));
    assert_int_equal(ad_grad(y, (size_t)op->arity, x, g), AD_OK);
    double *v = evaluate(g[0], (size_t)op->arity, x, (const double *const *)a->at);
    ad_tape_free(tape);
    return v;
}

static void both_types(const struct op *op, const struct arguments *a)
{
    double *wide = gradient_of_first(op, a, AD_F64), *narrow = gradient_of_first(op, a, AD_F32);
    size_t n = a->shape[0][0] * a->shape[0][1];
    size_t terms = 1; /* of the sum that is the gradient of what is broadcast, each of order 1 */
    double largest = 0;
    for (int k = 0; k < op->arity; k++)
        terms = a->shape[k][0] * a->shape[k][1] > terms ? a->shape[k][0] * a->shape[k][1] : terms;
    double rounding = 4 * FLT_EPSILON * sqrt((double)terms);
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(wide[i]));
    for (size_t i = 0; i < n; i++)
        if (!is_close(narrow[i], wide[i], 0, 2e-5 * largest + rounding))
            fail_msg("%s: gradient %zu is %.9g in f32, %.9g in f64", op->name, i, narrow[i],
                     wide[i]);
    free(wide);
    free(narrow);
}

static void test_gradient_f32_is_f64(void **state)
{
    (void)state;
    for_each_op(both_types, SIZE_MAX);
}

static void test_names(void **state)
{
    (void)state;
    for (size_t i = 0; i < N_OPS; i++)
        assert_string_equal(ad_op_name(ops[i].op), ops[i].name);
}

/* ---- operations by number ---- */

/* A24 */
static void test_operations_by_number(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    static const int arity[] = {
#define AD_STRUCTURE(name, arity) 0,
#define AD_UNARY(name, value, dx, lo, hi) 1,
#define AD_BINARY(name, value, da, db, lo, hi) 2,
#define AD_TERNARY(name, value, da, db, dc, lo, hi) 3,
#include "autodiff/ops.def"
        0, 0, 0};
    static const int beyond[] = {999, -1, AD_N_OPS};
    for (int k = 0; k < AD_N_OPS + 3; k++)
        for (int n = 1; n <= 3; n++) {
            int op = k < AD_N_OPS ? k : beyond[k - AD_N_OPS];
            ad_tape_reset(t);
            ad_var x = ad_input(t, 3, 4, "near"), g;
            ad_arg a = ad_arg_var(x), number = ad_arg_number(2);
            size_t before = ad_tape_size(t);
            ad_var y = n == 1   ? ad_unary((enum ad_op)op, x)
                       : n == 2 ? ad_binary((enum ad_op)op, a, number)
                                : ad_ternary((enum ad_op)op, a, number, a);
            if (n == arity[k]) {
                assert_tape_ok(t);
                continue;
            }
            assert_int_equal(ad_tape_size(t), before);
            assert_refused(t, AD_E_ARGUMENT, ad_op_name((enum ad_op)op), "near");
            char expected[24];
            snprintf(expected, sizeof expected, "expected %d", arity[k]);
            assert_int_equal(strstr(ad_tape_error(t)->message, expected) != NULL, arity[k] > 0);
            assert_int_equal(ad_grad(y, 1, &x, &g), AD_E_ARGUMENT);
        }
    ad_tape_free(t);
}

/* A24: products stand for a power that is known, and whole. */
static void test_powers_by_products(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 4, "x");
    const double whole[] = {2, 3, 4, 5};
    ad_binary(AD_OP_powi, AD_ARG(x), ad_arg_number(5));
    ad_binary(AD_OP_powi, AD_ARG(x), ad_arg_var(ad_scalar(t, -32)));
    assert_tape_ok(t);
    for (int k = 0; k < 5; k++) {
        ad_tape_reset(t);
        x = ad_input(t, 1, 4, "near");
        ad_arg power = k == 0   ? ad_arg_var(x)
                       : k == 1 ? ad_arg_number(2.5)
                       : k == 2 ? ad_arg_number(33)
                       : k == 3 ? ad_arg_var(ad_const(t, 1, 4, whole))
                                : ad_arg_number(NAN);
        ad_binary(AD_OP_powi, AD_ARG(x), power);
        assert_refused(t, AD_E_ARGUMENT, "powi", "near");
    }
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_first_order),
        cmocka_unit_test(test_second_order),
        cmocka_unit_test(test_third_order),
        cmocka_unit_test(test_gradient_f32_is_f64),
        cmocka_unit_test(test_operations_by_number),
        cmocka_unit_test(test_powers_by_products),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
