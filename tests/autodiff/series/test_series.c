/* Power series of recordings, against derivatives of any order by repeated gradients, and against
   values beside the point. */
#include "autodiff/series.h"
#include "autodiff/derivatives.h"
#include "tests/close.h"

#include <stdlib.h>
#include <string.h>

enum { ORDER = 6, LONG = 16 };

static const struct range {
    double low, high;
} ranges[AD_N_OPS] = {
#define AD_UNARY(name, value, dx, lo, hi) [AD_OP_##name] = {lo, hi},
#define AD_BINARY(name, value, da, db, lo, hi) [AD_OP_##name] = {lo, hi},
#define AD_TERNARY(name, value, da, db, dc, lo, hi) [AD_OP_##name] = {lo, hi},
#include "autodiff/ops.def"
};

static double draw(uint64_t *seed, double low, double high)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(*seed >> 11) / 9007199254740992.0;
}

/* a polynomial of s around a point of the operation's range */
static ad_var polynomial(ad_var s, const double *c)
{
    ad_var y = ad_add(ad_mul(0.0, s), c[ORDER]);
    for (size_t k = ORDER; k-- > 0;)
        y = ad_add(ad_mul(y, s), c[k]);
    return y;
}

static ad_var record(enum ad_op op, const ad_var x[3])
{
    const size_t arity = op == AD_OP_select ? 3 : op >= AD_OP_add ? 2 : 1;
    if (op == AD_OP_powi)
        return ad_pow(x[0], 3.0);
    return arity == 1   ? ad_unary(op, x[0])
           : arity == 2 ? ad_binary(op, AD_ARG(x[0]), AD_ARG(x[1]))
                        : ad_select(x[0], x[1], x[2]);
}

/* Derivatives 0 to ORDER at s = 0, over factorials. */
static void derivatives(enum ad_op op, double c[3][ORDER + 1], double *expected)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(tape, 1, 1, "s"), x[3];
    double factorial = 1, zero = 0;
    const double *at = &zero;
    for (size_t k = 0; k < 3; k++)
        x[k] = polynomial(s, c[k]);
    ad_var y = record(op, x);
    for (size_t k = 0; k <= ORDER; k++) {
        assert_int_equal(ad_evaluate(1, &s, &at, y, &expected[k], NULL), AD_OK);
        expected[k] /= factorial;
        factorial *= (double)(k + 1);
        if (k < ORDER)
            assert_int_equal(ad_grad(ad_add(y, ad_mul(0.0, s)), 1, &s, &y), AD_OK);
    }
    ad_tape_free(tape);
}

static void test_every_elementwise_operation(void **state)
{
    (void)state;
    uint64_t seed = 11;
    for (enum ad_op op = AD_OP_copy; op < AD_N_OPS; op++) {
        if (op == AD_OP_detach) /* its value moves, its gradient is 0 by definition */
            continue;
        double c[3][ORDER + 1], expected[ORDER + 1];
        for (size_t k = 0; k < 3; k++)
            for (size_t j = 0; j <= ORDER; j++) {
                double middle = (ranges[op].low + ranges[op].high) / 2;
                double half = (ranges[op].high - ranges[op].low) / 2;
                c[k][j] = j == 0 ? middle + half * draw(&seed, -0.9, 0.9) : draw(&seed, -0.4, 0.4);
            }
        derivatives(op, c, expected);
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var x[3];
        for (size_t k = 0; k < 3; k++)
            x[k] = ad_input(tape, 1, 1, "x");
        ad_var y = record(op, x);
        ad_series *series;
        assert_int_equal(ad_series_new(1, &y, 3, x, ORDER, &series), AD_OK);
        for (size_t j = 0; j <= ORDER; j++) {
            for (size_t k = 0; k < 3; k++)
                ad_series_input(series, k, 0)[j] = c[k][j];
            ad_series_advance(series, j);
        }
        const double *got = ad_series_output(series, 0, 0);
        double size = 0;
        for (size_t j = 0; j <= ORDER; j++)
            size = fmax(size, fabs(expected[j]));
        for (size_t j = 0; j <= ORDER; j++)
            if (!is_close(got[j], expected[j], 1e-11, 1e-12 * size))
                fail_msg("%s: coefficient %zu is %.17g, expected %.17g", ad_op_name(op), j, got[j],
                         expected[j]);
        ad_series_free(series);
        ad_tape_free(tape);
    }
}

/* ---- all that moves and sums: a function of a matrix, at x(s) beside the point ---- */

static ad_var moved(ad_var x) /* [3 x 4] -> [1 x 1] or wider */
{
    const uint32_t rows[] = {2, 0, 2}, cols[] = {1, 1, 3, 0};
    ad_var a = ad_sin(ad_gather_rows(x, 3, rows)), b = ad_gather_cols(ad_exp(x), 4, cols);
    ad_var c = ad_matmul(a, true, b, false);                        /* [4 x 4] */
    ad_var d = ad_concat_rows(2, (ad_var[]){c, ad_cumsum_cols(x)}); /* [7 x 4] */
    ad_var e = ad_add(ad_scatter_rows(ad_slice_rows(d, 1, 3), rows, 4), ad_slice_cols(c, 2, 1));
    ad_var f = ad_mul(ad_sum_rows(ad_reshape(e, 2, 8)), ad_broadcast(ad_sum(x), 1, 8));
    ad_var g = ad_mul(ad_scatter_cols(x, cols, 5), 0.5); /* [3 x 5] */
    return ad_add(ad_sum(ad_div(f, 7.0)),
                  ad_mul(ad_sum_cols(g), ad_sum_cols(ad_diff(x, 1.5, false))));
}

/* Sines and cosines have code of their own: near multiples of pi/2, where they cancel, and far. */
static void test_circle(void **state)
{
    (void)state;
    const double quarter = 1.5707963267948966;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x"), y[2] = {ad_sin(x), ad_cos(x)};
    ad_series *s;
    uint64_t seed = 11;
    assert_int_equal(ad_series_new(2, y, 1, &x, 1, &s), AD_OK);
    for (size_t k = 0; k < 20000; k++) {
        double at = draw(&seed, -1, 1) * (k % 3 == 0 ? 4 : k % 3 == 1 ? 1.2e5 : 1e9);
        if (k % 5 == 0)
            at = rint(at / quarter) * quarter * (1 + draw(&seed, -4, 4) * 0x1p-52);
        *ad_series_input(s, 0, 0) = at;
        ad_series_advance(s, 0);
        const long double exact[2] = {sinl(at), cosl(at)};
        for (size_t j = 0; j < 2; j++)
            assert_true(fabsl(*ad_series_output(s, j, 0) - exact[j]) <=
                        0x1p-53L * fabsl(exact[j]) * 2);
    }
    ad_series_free(s);
    ad_tape_free(tape);
}

static void test_what_moves_and_sums(void **state)
{
    (void)state;
    uint64_t seed = 5;
    enum { N = 12 };
    double c[LONG + 1][N] = {{0}};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 3, 4, "x"), y = moved(x);
    assert_int_equal(ad_tape_error(tape)->status, AD_OK);
    ad_series *series;
    assert_int_equal(ad_series_new(1, &y, 1, &x, LONG, &series), AD_OK);
    for (size_t k = 0; k <= LONG; k++) {
        for (size_t i = 0; i < N; i++) {
            c[k][i] = k < 3 ? draw(&seed, -0.5, 0.5) : 0;
            ad_series_input(series, 0, i)[k] = c[k][i];
        }
        ad_series_advance(series, k);
    }
    const double beside[] = {0, 0.05, -0.1};
    for (size_t p = 0; p < LENGTH(beside); p++) {
        double at[N], values[3];
        const double *values_of_x = at, s = beside[p];
        for (size_t i = 0; i < N; i++)
            at[i] = c[0][i] + s * (c[1][i] + s * c[2][i]);
        assert_int_equal(ad_evaluate(1, &x, &values_of_x, y, values, NULL), AD_OK);
        for (size_t i = 0; i < ad_rows(y); i++) {
            double sum = 0;
            for (size_t k = LONG + 1; k-- > 0;)
                sum = sum * s + ad_series_output(series, 0, i)[k];
            assert_close(sum, values[i], 1e-13, 1e-14);
        }
    }
    ad_series_free(series);
    ad_tape_free(tape);
}

/* ---- differential equations: the next coefficient of x from the last of f ---- */

static void solve(ad_var x, ad_var f, double start, size_t order, double *c)
{
    ad_series *series;
    assert_int_equal(ad_series_new(1, &f, 1, &x, order, &series), AD_OK);
    c[0] = start;
    for (size_t k = 0; k < order; k++) {
        ad_series_input(series, 0, 0)[k] = c[k];
        ad_series_advance(series, k);
        c[k + 1] = ad_series_output(series, 0, 0)[k] / (double)(k + 1);
    }
    ad_series_free(series);
}

static void test_differential_equations(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x");
    double c[31], factorial = 1;
    solve(x, x, 1, 30, c); /* exp s */
    for (size_t k = 0; k <= 30; factorial *= (double)++k)
        assert_close(c[k], 1 / factorial, 1e-15, 0);
    solve(x, ad_add(1.0, ad_square(x)), 0, 9, c); /* tan s */
    const double tangent[] = {0, 1, 0, 1.0 / 3, 0, 2.0 / 15, 0, 17.0 / 315, 0, 62.0 / 2835};
    for (size_t k = 0; k <= 9; k++)
        assert_close(c[k], tangent[k], 1e-15, 1e-17);
    solve(x, ad_square(x), 1, 30, c); /* 1 / (1 - s) */
    for (size_t k = 0; k <= 30; k++)
        assert_close(c[k], 1, 1e-14, 0);
    ad_tape_free(tape);
}

/* ---- machine code: the bits of the interpreter ---- */

/* Coefficients of x' = rates(x) interpreted and as machine code, and how far a sum of them is from
   finite: 0 is all. */
static void compare_flows(size_t n_x, const ad_var x[], const ad_var rates[], const double *start,
                          size_t n)
{
    ad_series *series;
    struct ad_error note = {0};
    double interpreted[LONG + 1][64], native[LONG + 1][64];
    assert_true(n <= 64);
    assert_int_equal(ad_series_new(n_x, rates, n_x, x, LONG, &series), AD_OK);
    memcpy(interpreted[0], start, n * sizeof *start);
    double *c = malloc((LONG + 1) * n * sizeof *c);
    memcpy(c, start, n * sizeof *start);
    for (size_t i = 0; i < n; i++)
        c[n + i] = start[i] * 0x1p-50;
    ad_series_flow_cut(series, n, LONG, c);
    for (size_t k = 0; k <= LONG; k++)
        memcpy(interpreted[k], c + k * n, n * sizeof *c);
    if (!ad_series_native(series, n, &note)) {
        print_message("[skipped: %s]\n", note.message);
    } else {
        memset(c + n, 0, LONG * n * sizeof *c);
        for (size_t i = 0; i < n; i++)
            c[n + i] = start[i] * 0x1p-50;
        ad_series_flow_cut(series, n, LONG, c);
        for (size_t k = 0; k <= LONG; k++) {
            memcpy(native[k], c + k * n, n * sizeof *c);
            for (size_t i = 0; i < n; i++) {
                assert_true(isfinite(interpreted[k][i]));
                if (native[k][i] != interpreted[k][i])
                    fail_msg("coefficient %zu of x[%zu]: %.17g, interpreted %.17g", k, i,
                             native[k][i], interpreted[k][i]);
            }
        }
    }
    double *plain = malloc((LONG + 1) * n * sizeof *plain);
    memset(c + n, 0, LONG * n * sizeof *c);
    memset(plain, 0xff,
           (LONG + 1) * n * sizeof *plain); /* NaN: rows behind the first are results */
    memcpy(plain, start, n * sizeof *start);
    ad_series_flow_cut(series, n, LONG, c);
    ad_series_flow(series, n, LONG, plain);
    assert_memory_equal(plain, c, (LONG + 1) * n * sizeof *c);
    free(plain);
    free(c);
    ad_series_free(series);
}

static void test_machine_code_of_every_operation(void **state)
{
    (void)state;
    enum { FIRST = AD_OP_copy, N = AD_N_OPS - FIRST };
    uint64_t seed = 3;
    double start[N];
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, N, 1, "x"), rates[N], all;
    for (size_t k = 0; k < N; k++) {
        const enum ad_op op = (enum ad_op)(FIRST + k);
        const double low = ranges[op].low, high = ranges[op].high, middle = (low + high) / 2;
        start[k] = middle + (high - low) / 2 * draw(&seed, -0.5, 0.5);
        /* operands near the middle of the range, which depend on each other */
        ad_var in[3];
        for (size_t j = 0; j < 3; j++)
            in[j] = ad_add(
                middle, ad_mul(0.2 * (high - low), ad_sin(ad_slice_rows(x, (k + j * 7) % N, 1))));
        rates[k] = ad_mul(0.1, record(op, in));
    }
    all = ad_concat_rows(N, rates);
    assert_int_equal(ad_tape_error(tape)->status, AD_OK);
    compare_flows(1, &x, &all, start, N);
    ad_tape_free(tape);
}

static void test_machine_code_of_a_random_program(void **state)
{
    (void)state;
    static const enum ad_op ops[] = {
        AD_OP_add,  AD_OP_sub,  AD_OP_mul, AD_OP_mul,   AD_OP_square,  AD_OP_sin,
        AD_OP_cos,  AD_OP_exp,  AD_OP_div, AD_OP_recip, AD_OP_sqrt,    AD_OP_hypot,
        AD_OP_tanh, AD_OP_mul0, AD_OP_max, AD_OP_pow,   AD_OP_sigmoid, AD_OP_atan2};
    enum { N = 6, STEPS = 60 };
    uint64_t seed = 3; /* of which gcc 12 gets lanes wrong */
    double start[N];
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, N, 1, "x"), value[N + STEPS], rate;
    for (size_t k = 0; k < N; k++) {
        value[k] = ad_slice_rows(x, k, 1);
        start[k] = draw(&seed, 0.3, 0.9);
    }
    for (size_t k = N; k < N + STEPS; k++) {
        const enum ad_op op = ops[(size_t)draw(&seed, 0, LENGTH(ops))];
        ad_var in[3];
        for (size_t j = 0; j < 3; j++) /* between 0.3 and 0.9 */
            in[j] = ad_add(0.6, ad_mul(0.3, ad_sin(value[(size_t)draw(&seed, 0, (double)k)])));
        value[k] = record(op, in);
    }
    rate = ad_concat_rows(N, value + STEPS);
    assert_int_equal(ad_tape_error(tape)->status, AD_OK);
    compare_flows(1, &x, &rate, start, N);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_machine_code_of_every_operation),
        cmocka_unit_test(test_machine_code_of_a_random_program),
        cmocka_unit_test(test_every_elementwise_operation),
        cmocka_unit_test(test_circle),
        cmocka_unit_test(test_what_moves_and_sums),
        cmocka_unit_test(test_differential_equations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
