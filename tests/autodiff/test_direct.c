/* Direct evaluation against compiled programs: values and gradients of random programs and of every
   operation of the table, what it refuses, zeros behind branches, and programs of scalars. */
#include "autodiff/internal.h"
#include "tests/autodiff/programs/world.h"

#include <stdlib.h>
#include <string.h>

/* ---- random programs ---- */

static double **rooms(size_t n, const ad_var x[])
{
    double **room = malloc((n + 1) * sizeof *room);
    assert_non_null(room);
    for (size_t k = 0; k < n; k++)
        assert_non_null(room[k] = calloc(ad_rows(x[k]) * ad_cols(x[k]) + 1, sizeof **room));
    return room;
}

static void free_rooms(size_t n, double **room)
{
    for (size_t k = 0; k < n; k++)
        free(room[k]);
    free(room);
}

/* Value and gradient of y both ways. */
static void compare(ad_var y, size_t n, const ad_var x[], const double *const at[],
                    double tolerance, uint64_t seed)
{
    struct ad_error error = {0};
    double **direct = rooms(n, x), value, again;
    ad_var g[MAX_INPUTS + 1];
    if (ad_gradient(n, x, at, y, &value, direct, &error) != AD_OK)
        fail_msg("program %llu: %s", (unsigned long long)seed, error.message);
    assert_int_equal(ad_evaluate(n, x, at, y, &again, &error), AD_OK);
    assert_true(again == value || (again != again && value != value));
    assert_int_equal(ad_grad(y, n, x, g), AD_OK);
    g[n] = y;
    ad_program *p = compile(y.tape, n + 1, g);
    for (size_t k = 0; k < n; k++)
        assert_int_equal(ad_set(p, x[k], at[k]), AD_OK);
    ad_run(p);
    for (size_t k = 0; k <= n; k++) {
        size_t size = ad_rows(g[k]) * ad_cols(g[k]);
        double *compiled = malloc(size * sizeof *compiled), largest = 0;
        assert_non_null(compiled);
        assert_int_equal(ad_get(p, g[k], compiled), AD_OK);
        for (size_t i = 0; i < size; i++)
            largest = fmax(largest, fabs(compiled[i]));
        for (size_t i = 0; i < size; i++)
            if (!is_close(k < n ? direct[k][i] : value, compiled[i], tolerance,
                          tolerance * largest))
                fail_msg("program %llu, input %zu, element %zu: %.17g, compiled %.17g",
                         (unsigned long long)seed, k, i, k < n ? direct[k][i] : value, compiled[i]);
        free(compiled);
    }
    ad_program_free(p);
    free_rooms(n, direct);
}

static void random_program(enum ad_type type, uint64_t seed, double tolerance)
{
    static const size_t widths[] = {1, 2, 3, 7, 31};
    struct world w;
    const double *at[MAX_INPUTS];
    world_init(&w, type, seed, 1, widths[seed % 5], 6 + 5 * (seed % 11), true);
    for (size_t k = 0; k < w.n_inputs; k++)
        at[k] = w.m[k].v;
    ad_var y = weighted_sum(w.var[w.n - 1]);
    for (size_t k = 0; k < w.n_inputs; k++)
        y = ad_add(y, ad_mul(1e-3, ad_mean(ad_sin(w.var[k]))));
    compare(y, w.n_inputs, w.var, at, tolerance, seed);
    world_release(&w);
}

static void test_random_programs(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 600; seed++)
        random_program(AD_F64, seed, 1e-9);
    for (uint64_t seed = 0; seed < 200; seed++)
        random_program(AD_F32, seed, 3e-3);
}

/* ---- the table ---- */

struct row {
    enum ad_op op;
    int arity;
    double lo, hi;
};

static const struct row rows[] = {
#define AD_UNARY(name, value, dx, lo, hi) {AD_OP_##name, 1, lo, hi},
#define AD_BINARY(name, value, da, db, lo, hi) {AD_OP_##name, 2, lo, hi},
#define AD_TERNARY(name, value, da, db, dc, lo, hi) {AD_OP_##name, 3, lo, hi},
#include "autodiff/ops.def"
};

static ad_var record(const struct row *row, const ad_var x[3])
{
    if (row->op == AD_OP_powi)
        return ad_binary(row->op, AD_ARG(x[0]), AD_ARG(-5.0));
    return row->arity == 1   ? ad_unary(row->op, x[0])
           : row->arity == 2 ? ad_binary(row->op, AD_ARG(x[0]), AD_ARG(x[1]))
                             : ad_ternary(row->op, AD_ARG(x[0]), AD_ARG(x[1]), AD_ARG(x[2]));
}

/* Scalars, and a matrix with a row and a column. */
static void test_every_operation(void **state)
{
    (void)state;
    static const size_t shapes[2][3][2] = {{{1, 1}, {1, 1}, {1, 1}}, {{3, 4}, {1, 4}, {3, 1}}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        for (int s = 0; s < 2; s++) {
            uint64_t random = 7 + k;
            ad_tape *t = ad_tape_new(AD_F64);
            ad_var x[3];
            double *at[3];
            for (int i = 0; i < 3; i++) {
                x[i] = ad_input(t, shapes[s][i][0], shapes[s][i][1], NULL);
                at[i] = random_values(&random, shapes[s][i][0] * shapes[s][i][1], rows[k].lo,
                                      rows[k].hi);
            }
            compare(weighted_sum(record(&rows[k], x)), 3, x, (const double *const *)at, 1e-12, k);
            for (int i = 0; i < 3; i++)
                free(at[i]);
            ad_tape_free(t);
        }
}

/* A loop of scalars that no compiler could be asked for in time: 1e6 operations. x -> sin x,
   summed; its derivative by the product of cosines. */
static void test_long_chain(void **state)
{
    (void)state;
    enum { LENGTH = 1000000 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, "x"), y = x;
    double at = 0.9, value, gradient, is = at, slope = 1;
    for (int k = 0; k < LENGTH; k++) {
        y = ad_sin(y);
        slope *= cos(is);
        is = sin(is);
    }
    struct ad_error error = {0};
    assert_int_equal(
        ad_gradient(1, &x, (const double *[]){&at}, y, &value, (double *[]){&gradient}, &error),
        AD_OK);
    assert_close(value, is, 1e-13, 0);
    assert_close(gradient, slope, 1e-9, 0);
    ad_tape_free(t);
}

/* Recorded further, run again: places of the nodes are added, not made anew. */
static void test_recorded_further(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, "x"), y = ad_square(x), m;
    double at = 3, value, g;
    struct ad_error error = {0};
    for (int round = 0; round < 3; round++) {
        assert_int_equal(
            ad_gradient(1, &x, (const double *[]){&at}, y, &value, (double *[]){&g}, &error),
            AD_OK);
        m = ad_broadcast(ad_mul(y, x), 2, 3); /* other shapes from here on */
        y = ad_sum(m);
    }
    assert_close(value, 36 * 81, 1e-15, 0); /* 6 x (6 x x^3) */
    assert_close(g, 36 * 4 * 27, 1e-15, 0);
    ad_tape_reset(t);
    x = ad_input(t, 1, 1, "x");
    assert_int_equal(ad_evaluate(1, &x, (const double *[]){&at}, ad_exp(x), &value, &error), AD_OK);
    assert_close(value, exp(3), 1e-15, 0);
    ad_tape_free(t);
}

static double value_at(ad_var y, ad_var x, double at, double *slope)
{
    double value;
    struct ad_error error = {0};
    assert_int_equal(
        ad_gradient(1, &x, (const double *[]){&at}, y, &value, (double *[]){slope}, &error), AD_OK);
    return value;
}

/* A recording of scalars that grows between its runs, and another one after a reset. */
static void test_scalars_recorded_further(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    double slope, value;
    for (int round = 0; round < 2; round++) {
        ad_var x = ad_input(t, 1, 1, "x"), y = round ? ad_exp(x) : ad_sin(x);
        for (int n = 0; n < 300; n++) {
            y = round ? ad_select(ad_lt(y, 40.0), ad_add(y, x), ad_sub(y, x)) : ad_mul(y, x);
            if (n % 7 == 0)
                value_at(y, x, 1.01, &slope);
        }
        value = value_at(y, x, 1.01, &slope);
        double p = pow(1.01, 300);
        double expected = sin(1.01) * p, slopes = cos(1.01) * p + 300 * sin(1.01) * p / 1.01;
        if (round) {
            int ups = 0;
            for (int n = 0; n < 300; n++)
                ups += exp(1.01) + ups * 1.01 < 40.0 ? 1 : -1;
            expected = exp(1.01) + 1.01 * ups;
            slopes = exp(1.01) + ups;
        }
        assert_close(value, expected, 1e-12, 0);
        assert_close(slope, slopes, 1e-12, 0);
        ad_tape_reset(t);
    }
    ad_tape_free(t);
}

/* A number is recorded once however often it is used; a constant of the caller's is a value of its
   own, and after a reset nothing is left of either. */
static void test_numbers(void **state)
{
    (void)state;
    double slope;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, "x"), y = ad_sin(x);
    size_t before = ad_tape_size(t);
    for (int k = 0; k < 10; k++)
        y = ad_max(ad_sub(2.5, ad_add(ad_mul(y, -0.75), 2.5)), -0.75); /* two numbers */
    assert_int_equal(ad_tape_size(t), before + 2 + 4 * 10);
    assert_close(value_at(y, x, 0.5, &slope), pow(0.75, 10) * sin(0.5), 1e-14, 0);
    assert_close(slope, pow(0.75, 10) * cos(0.5), 1e-14, 0);
    ad_var c = ad_scalar(t, 2.5), g;
    assert_int_equal(ad_grad(ad_max(ad_add(ad_sin(x), 2.5), c), 1, &c, &g), AD_OK);
    assert_true(value_at(g, x, -0.5, &slope) == 1);
    ad_tape_reset(t);
    x = ad_input(t, 1, 1, "x");
    for (int k = 0; k < 10; k++)
        ad_scalar(t, 7); /* where numbers were */
    y = ad_sub(ad_mul(ad_sin(x), -0.75), 2.5);
    assert_close(value_at(y, x, 0.5, &slope), -0.75 * sin(0.5) - 2.5, 1e-14, 0);
    /* zeros of both signs are two numbers */
    ad_var up = ad_atan2(0.0, ad_sin(x)), down = ad_atan2(-0.0, ad_sin(x));
    assert_true(value_at(up, x, -0.5, &slope) > 3 && value_at(down, x, -0.5, &slope) < -3);
    ad_tape_free(t);
}

/* Long recordings take their nodes by groups of blocks: so does a copy, and one after a reset. */
static void test_many_blocks(void **state)
{
    (void)state;
    enum { LENGTH = 250000 };
    ad_tape *t = ad_tape_new(AD_F64);
    for (int round = 0; round < 2; round++) {
        double slope, is = 0.9;
        ad_var x = ad_input(t, 1, 1, "x"), y = x;
        for (int k = 0; k < LENGTH; k++) {
            y = k % 2 ? ad_cos(y) : ad_add(y, 0.5);
            is = k % 2 ? cos(is) : is + 0.5;
        }
        assert_true(ad_tape_bytes(t) <
                    40 * ad_tape_size(t) + 24 * (size_t)(round ? LENGTH + 3 : 0));
        ad_tape *copy = ad_tape_copy(t);
        assert_non_null(copy);
        assert_close(value_at(y, x, 0.9, &slope), is, 1e-14, 0);
        x.tape = y.tape = copy;
        assert_close(value_at(ad_add(y, 1.0), x, 0.9, &slope), is + 1, 1e-14, 0);
        ad_tape_free(copy);
        ad_tape_reset(t);
    }
    ad_tape_free(t);
}

/* sqrt(0) behind a branch that is not taken. */
static void test_zeros_behind_branches(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, "x");
    ad_var y = ad_select(ad_gt(x, 0.0), ad_div(1.0, x), 0.0);
    double at = 0, value, g;
    struct ad_error error = {0};
    assert_int_equal(
        ad_gradient(1, &x, (const double *[]){&at}, y, &value, (double *[]){&g}, &error), AD_OK);
    assert_true(value == 0 && g == 0);
    ad_tape_free(t);
}

/* Inputs of any size recorded behind y are of no concern to it. */
static void test_inputs_behind(void **state)
{
    (void)state;
    enum { ROWS = 500, COLS = 2000 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[2] = {ad_input(t, 3, 1, NULL)}, y = ad_sum(ad_square(x[0]));
    x[1] = ad_input(t, ROWS, COLS, NULL);
    double *large = malloc(ROWS * COLS * sizeof *large), small[3] = {1, 2, 4}, value, g[3];
    assert_non_null(large);
    for (size_t k = 0; k < ROWS * COLS; k++)
        large[k] = 7;
    const double *at[2] = {small, large};
    double *const gradient[2] = {g, large};
    struct ad_error error = {0};
    assert_int_equal(ad_evaluate(2, x, at, y, &value, &error), AD_OK);
    assert_true(value == 21);
    assert_int_equal(ad_gradient(2, x, at, y, &value, gradient, &error), AD_OK);
    assert_true(value == 21 && g[0] == 2 && g[1] == 4 && g[2] == 8);
    for (size_t k = 0; k < ROWS * COLS; k++)
        assert_true(large[k] == 0);
    free(large);
    ad_tape_free(t);
}

/* Long sums keep the digits of f32. */
static void test_sums_in_f32(void **state)
{
    (void)state;
    enum { TERMS = 100000 };
    static ad_var (*const over[])(ad_var) = {ad_sum, ad_sum_cols, ad_sum_rows};
    double *at = malloc(TERMS * sizeof *at), value;
    const double *const in[] = {at};
    assert_non_null(at);
    for (size_t i = 0; i < TERMS; i++)
        at[i] = 0.1;
    for (size_t k = 0; k < sizeof over / sizeof *over; k++) {
        ad_tape *t = ad_tape_new(AD_F32);
        ad_var x = ad_input(t, k == 2 ? TERMS : 1, k == 2 ? 1 : TERMS, "x");
        assert_int_equal(ad_evaluate(1, &x, in, over[k](x), &value, NULL), AD_OK);
        assert_close(value, 0.1 * TERMS, 1e-7, 0);
        ad_tape_free(t);
    }
    free(at);
}

static void test_refused(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, "x"), z = ad_input(t, 1, 1, "z"), y = ad_mul(x, z);
    ad_var foreign = ad_input(other, 1, 1, "x");
    double one = 1, value;
    const double *at[] = {&one, &one};
    struct ad_error e = {0};
    assert_int_equal(ad_evaluate(1, &x, at, y, &value, &e), AD_E_ARGUMENT); /* z has no value */
    e = (struct ad_error){0};
    assert_int_equal(ad_evaluate(1, &z, at, y, &value, &e), AD_E_ARGUMENT); /* nor has x */
    e = (struct ad_error){0};
    assert_int_equal(ad_evaluate(2, (ad_var[]){x, foreign}, at, y, &value, &e), AD_E_TAPE);
    e = (struct ad_error){0};
    assert_int_equal(ad_evaluate(2, (ad_var[]){x, y}, at, y, &value, &e), AD_E_ARGUMENT);
    e = (struct ad_error){0};
    assert_int_equal(ad_evaluate(2, (ad_var[]){x, z}, at, (ad_var){0}, &value, &e), AD_E_TAPE);
    e = (struct ad_error){0};
    ad_add(ad_broadcast(x, 2, 2), ad_broadcast(x, 3, 3));
    assert_int_equal(ad_evaluate(2, (ad_var[]){z, x}, at, y, &value, &e), AD_E_SHAPE);
    ad_tape_reset(t);
    e = (struct ad_error){0};
    assert_int_equal(ad_evaluate(2, (ad_var[]){x, z}, at, y, &value, &e), AD_E_TAPE);
    ad_tape_free(t);
    ad_tape_free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_inputs_behind),
        cmocka_unit_test(test_random_programs),
        cmocka_unit_test(test_every_operation),
        cmocka_unit_test(test_long_chain),
        cmocka_unit_test(test_recorded_further),
        cmocka_unit_test(test_zeros_behind_branches),
        cmocka_unit_test(test_sums_in_f32),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_many_blocks),
        cmocka_unit_test(test_scalars_recorded_further),
    };
    return cmocka_run_group_tests_name("direct evaluation", tests, NULL, NULL);
}
