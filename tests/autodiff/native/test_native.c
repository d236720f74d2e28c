/* The native back end against the interpreter: every operation, random programs, segments split for
   threads, reruns. */
#include "tests/native.h"
#include "tests/autodiff/programs/world.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Copies of a program that are interpreted and compiled. */
struct twins {
    ad_program *interpreted, *compiled;
};

static struct twins make_twins(ad_tape *tape, size_t n, const ad_var out[])
{
    struct twins t = {compile(tape, n, out), compile(tape, n, out)};
    native_make(t.compiled);
    return t;
}

static void free_twins(struct twins *t)
{
    ad_program_free(t->interpreted);
    ad_program_free(t->compiled);
}

static void assert_equal_outputs(const struct twins *t, size_t n, const ad_var out[],
                                 double tolerance, const char *name)
{
    for (size_t k = 0; k < n; k++)
        assert_same_values(t->interpreted, t->compiled, out[k], tolerance, name);
}

/* ---- every operation ---- */

struct entry {
    const char *name;
    int arity;
    double lo, hi;
};

static const struct entry entries[AD_N_OPS] = {
#define AD_UNARY(name, value, dx, lo, hi) [AD_OP_##name] = {#name, 1, lo, hi},
#define AD_BINARY(name, value, da, db, lo, hi) [AD_OP_##name] = {#name, 2, lo, hi},
#define AD_TERNARY(name, value, da, db, dc, lo, hi) [AD_OP_##name] = {#name, 3, lo, hi},
#include "autodiff/ops.def"
};

enum { N_ROWS = 3, N_VALUES = N_ROWS * 37 };

/* Values in the domain of the operation, and the places where operations choose: 0, equal operands,
   infinities, NaN. */
static void draw(uint64_t *state, double lo, double hi, size_t n, double *x)
{
    static const double special[] = {0, -0.0, 1, INFINITY, -INFINITY, NAN};
    for (size_t i = 0; i < n; i++)
        x[i] = i % 11 == 5 ? special[below(state, 6)] : (float)uniform(state, lo, hi);
}

static ad_var record(enum ad_op op, const ad_var x[3], double number)
{
    if (op == AD_OP_powi)
        return ad_pow(x[0], number);
    if (entries[op].arity == 1)
        return ad_unary(op, x[0]);
    if (entries[op].arity == 2)
        return ad_binary(op, AD_ARG(x[0]), AD_ARG(x[1]));
    return ad_ternary(op, AD_ARG(x[0]), AD_ARG(x[1]), AD_ARG(x[2]));
}

/* All operations on rows x cols values, in one program. */
static void every_operation(enum ad_type type, size_t rows, size_t cols)
{
    uint64_t state = 17;
    ad_tape *tape = ad_tape_new(type);
    ad_var out[2 * AD_N_OPS], x[AD_N_OPS][3];
    const char *name[2 * AD_N_OPS];
    size_t n = 0;
    for (int op = 0; op < AD_N_OPS; op++)
        for (int k = 0; k < entries[op].arity; k++)
            x[op][k] = ad_input(tape, rows, cols, NULL);
    for (int op = 0; op < AD_N_OPS; op++) {
        if (!entries[op].arity)
            continue;
        name[n] = name[n + 1] = entries[op].name;
        out[n] = record((enum ad_op)op, x[op], -7);
        out[n + 1] = ad_sum_cols(ad_abs(out[n])); /* sums that cancel keep no digits */
        n += 2;
    }
    struct twins t = make_twins(tape, n, out);
    for (int op = 0; op < AD_N_OPS; op++)
        for (int k = 0; k < entries[op].arity; k++) {
            double values[N_VALUES];
            draw(&state, entries[op].lo, entries[op].hi, rows * cols, values);
            ad_set(t.interpreted, x[op][k], values);
            ad_set(t.compiled, x[op][k], values);
        }
    ad_run(t.interpreted);
    ad_run(t.compiled);
    for (size_t k = 0; k < n; k++)
        assert_same_values(t.interpreted, t.compiled, out[k], type == AD_F32 ? 1e-6 : 2e-15,
                           name[k]);
    free_twins(&t);
    ad_tape_free(tape);
}

static void operations_on_this_isa(void)
{
    for (int type = AD_F32; type <= AD_F64; type++) {
        every_operation((enum ad_type)type, N_ROWS, 37); /* no multiple of any vector */
        every_operation((enum ad_type)type, N_ROWS, 1);
    }
}

static void test_every_operation(void **state)
{
    (void)state;
    native_need_compiler();
    for_each_isa(operations_on_this_isa);
}

/* ---- random programs ---- */

static const size_t widths[] = {1, 2, 3, 7, 31, 64, 100, 129, 600, 2000};

static void random_program(enum ad_type type, uint64_t seed, double tolerance)
{
    struct world w;
    char name[48];
    snprintf(name, sizeof name, "program %llu", (unsigned long long)seed);
    world_init(&w, type, seed, 1, widths[seed % LENGTH(widths)], 40, false);
    struct twins t = make_twins(w.tape, w.n, w.var);
    for (size_t k = 0; k < w.n_inputs; k++) {
        ad_set(t.interpreted, w.var[k], w.m[k].v);
        ad_set(t.compiled, w.var[k], w.m[k].v);
    }
    ad_run(t.interpreted);
    for (size_t threads = 1; threads < 4; threads += 2) {
        ad_set_threads(t.compiled, threads);
        ad_run(t.compiled);
        assert_equal_outputs(&t, w.n, w.var, tolerance, name);
    }
    free_twins(&t);
    world_release(&w);
}

static void test_random_programs(void **state)
{
    (void)state;
    native_need_compiler();
    for (uint64_t seed = 0; seed < LENGTH(widths); seed++)
        random_program(AD_F64, seed, 1e-12);
}

/* ---- pairs: gathers and scatters, small, large, split for threads ---- */

/* 1/(1 + d^2) over all pairs of rows, and its gradient. */
static void pair_law(enum ad_type type, size_t bodies, size_t cols, double tolerance)
{
    size_t pairs = bodies * (bodies - 1) / 2, k = 0;
    uint32_t *first = malloc(2 * pairs * sizeof *first), *second = first + pairs;
    assert_non_null(first);
    for (uint32_t i = 0; i < bodies; i++)
        for (uint32_t j = i + 1; j < bodies; j++, k++) {
            first[k] = i;
            second[k] = j;
        }
    ad_tape *tape = ad_tape_new(type);
    ad_var x = ad_input(tape, bodies, cols, "x"), out[3];
    ad_var d = ad_sub(ad_gather_rows(x, pairs, first), ad_gather_rows(x, pairs, second));
    ad_var u = ad_recip(ad_add(1.0, ad_square(d)));
    out[0] = ad_sum(u);
    out[1] = ad_sum_rows(u);
    assert_int_equal(ad_grad(out[0], 1, &x, &out[2]), AD_OK);
    struct twins t = make_twins(tape, 3, out);
    uint64_t state = 5;
    double *values = random_values(&state, bodies * cols, -2, 2);
    ad_set(t.interpreted, x, values);
    ad_set(t.compiled, x, values);
    ad_run(t.interpreted);
    ad_run(t.compiled);
    assert_equal_outputs(&t, 3, out, tolerance, "pairs");
    double *alone = malloc(bodies * cols * sizeof *alone);
    double *split = malloc(bodies * cols * sizeof *split);
    ad_get(t.compiled, out[2], alone);
    ad_set_threads(t.compiled, 3);
    ad_run(t.compiled);
    ad_get(t.compiled, out[2], split);
    assert_memory_equal(alone, split, bodies * cols * sizeof *alone);
    free(alone);
    free(split);
    free(values);
    free(first);
    free_twins(&t);
    ad_tape_free(tape);
}

static void test_pairs(void **state)
{
    static const struct {
        size_t bodies, cols;
    } sizes[] = {{3, 1}, {3, 2}, {40, 1}, {7, 100}, {50, 100}, {50, 37}, {300, 5}, {1200, 1}};
    (void)state;
    native_need_compiler();
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        pair_law(AD_F64, sizes[k].bodies, sizes[k].cols, 1e-13);
        if (k % 3 == 0) /* the smallest, the widest, the longest rows */
            pair_law(AD_F32, sizes[k].bodies, sizes[k].cols, 2e-5);
    }
}

/* A sum over rows that shares its memory with scatters into one row. */
static void sums_and_scatters(size_t rows, size_t cols)
{
    uint32_t list[60] = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, rows, cols, "x");
    ad_var y = ad_sub(ad_add(ad_scatter_rows(ad_sin(x), list, 1), ad_sum_rows(ad_cos(x))),
                      ad_sum_rows(ad_square(x)));
    struct twins t = make_twins(tape, 1, &y);
    uint64_t state = 29;
    double *values = random_values(&state, rows * cols, -2, 2);
    ad_set(t.interpreted, x, values);
    ad_set(t.compiled, x, values);
    ad_run(t.interpreted);
    ad_run(t.compiled);
    assert_equal_outputs(&t, 1, &y, 1e-13, "sums and scatters");
    free(values);
    free_twins(&t);
    ad_tape_free(tape);
}

static void test_sums_and_scatters(void **state)
{
    (void)state;
    native_need_compiler();
    sums_and_scatters(20, 1);
    sums_and_scatters(37, 1);
    sums_and_scatters(20, 33);
    sums_and_scatters(60, 16);
}

/* ---- time differences ---- */

static void differences(size_t cols, bool repeat)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 3, cols, "x"), out[4];
    ad_var v = ad_diff(x, 2.5, repeat);
    out[0] = ad_mul(3.0, v);
    out[1] = ad_sum(ad_mul(ad_square(v), v));
    out[2] = ad_diff_adjoint(ad_square(v), 1.25, repeat, cols);
    assert_int_equal(ad_grad(out[1], 1, &x, &out[3]), AD_OK);
    struct twins t = make_twins(tape, 4, out);
    uint64_t state = 23;
    double *values = random_values(&state, 3 * cols, -2, 2);
    ad_set(t.interpreted, x, values);
    ad_set(t.compiled, x, values);
    ad_run(t.interpreted);
    ad_run(t.compiled);
    assert_equal_outputs(&t, 4, out, 1e-14, "differences");
    free(values);
    free_twins(&t);
    ad_tape_free(tape);
}

static void test_differences(void **state)
{
    static const size_t cols[] = {2, 3, 8, 9, 17, 100};
    (void)state;
    native_need_compiler();
    for (size_t k = 0; k < sizeof cols / sizeof *cols; k++) {
        differences(cols[k], false);
        differences(cols[k], true);
    }
}

/* ---- runs again ---- */

/* Run again, machine code leaves out what held inputs decide. */
static void test_held(void **state)
{
    (void)state;
    native_need_compiler();
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var a = ad_hold(ad_input(tape, 3, 40, "a")), b = ad_input(tape, 3, 40, "b");
    ad_var y = ad_sum_rows(ad_mul(ad_diff(ad_sin(ad_diff(a, 2, true)), 3, true), b));
    struct twins t = make_twins(tape, 1, &y);
    uint64_t random = 9;
    double *values = random_values(&random, 4 * 120, -2, 2);
    for (size_t k = 0; k < 4; k++) {
        for (ad_program **p = &t.interpreted; p <= &t.compiled; p++) {
            ad_set(*p, b, values + 120 * k);
            if (k == 0) {
                ad_set(*p, a, values + 240);
                ad_run(*p);
            }
            assert_int_equal(ad_rerun(*p), AD_OK);
        }
        assert_equal_outputs(&t, 1, &y, 1e-14, "held");
    }
    free(values);
    free_twins(&t);
    ad_tape_free(tape);
}

/* Segments of functions that are not inlined, as there are many: a compiler that takes one for free
   of effects leaves its call out (gcc 12 did so with stores of one column after the other). */
static void test_every_segment_is_called(void **state)
{
    enum { STAGES = 24, SIZE = 8 };
    (void)state;
    native_need_compiler();
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var in[4], column[2], row[2], y[STAGES];
    for (int k = 0; k < 2; k++) {
        in[k] = column[k] = ad_input(tape, SIZE, 1, NULL);
        in[2 + k] = row[k] = ad_input(tape, 1, SIZE, NULL);
    }
    for (size_t k = 0; k < STAGES; k++) {
        y[k] = ad_add(ad_mul(column[0], row[0]), ad_mul(column[1], row[1]));
        for (int i = 0; i < 2; i++) {
            column[i] = ad_matmul(y[k], false, column[i], false);
            row[i] = ad_matmul(row[i], false, y[k], false);
        }
    }
    struct twins t = make_twins(tape, STAGES, y);
    uint64_t random = 13;
    double *values = random_values(&random, SIZE + 4, -0.4, 0.4);
    for (ad_program **p = &t.interpreted; p <= &t.compiled; p++) {
        for (size_t k = 0; k < 4; k++)
            ad_set(*p, in[k], values + k);
        ad_run(*p);
    }
    assert_equal_outputs(&t, STAGES, y, 1e-12, "every segment");
    free(values);
    free_twins(&t);
    ad_tape_free(tape);
}

/* A product of two numbers is no matrix product, which machine code leaves to BLAS. */
static void test_product_of_numbers(void **state)
{
    (void)state;
    native_need_compiler();
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var a = ad_input(tape, 1, 1, NULL), b = ad_input(tape, 1, 1, NULL), out[3];
    out[0] = ad_matmul(a, true, b, false);
    assert_int_equal(ad_grad(out[0], 2, (ad_var[]){a, b}, out + 1), AD_OK);
    ad_program *p = compile(tape, 3, out);
    ad_set(p, a, (double[]){3});
    ad_set(p, b, (double[]){7});
    native_make(p);
    ad_run(p);
    double y[3];
    for (int k = 0; k < 3; k++)
        ad_get(p, out[k], &y[k]);
    assert_close(y[0], 21, 0, 0);
    assert_close(y[1], 7, 0, 0);
    assert_close(y[2], 3, 0, 0);
    ad_program_free(p);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_operation),
        cmocka_unit_test(test_random_programs),
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_sums_and_scatters),
        cmocka_unit_test(test_differences),
        cmocka_unit_test(test_held),
        cmocka_unit_test(test_every_segment_is_called),
        cmocka_unit_test(test_product_of_numbers),
    };
    return cmocka_run_group_tests(tests, native_share_cache, native_remove_cache);
}
