/* Passes over columns (autodiff/compile/passes.c): arrays are the same to the last bit for all
   sizes of blocks and numbers of threads, sums for all numbers of threads; what only a pass reads
   needs no memory; a value that is not finite is found. */
#include "tests/autodiff/support.h"
#include "tests/native.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BODIES = 3, ROWS = 2 * BODIES };

/* The gradient of an action: bodies that attract each other, pendulums, velocities by differences
   along columns, their product with a vector by another gradient. */
struct action {
    ad_tape *tape;
    ad_var x, u, out[4]; /* sum, gradient, product, energy by columns */
    ad_program *program;
    size_t cols;
};

static ad_var lagrangian(ad_var x, ad_var v)
{
    static const uint32_t first[] = {0, 1, 0, 1, 2, 3}, second[] = {2, 3, 4, 5, 4, 5};
    ad_var d = ad_sub(ad_gather_rows(x, ROWS, first), ad_gather_rows(x, ROWS, second));
    ad_var near = ad_recip(ad_sqrt(ad_add(ad_square(d), 0.1)));
    ad_var y = ad_add(ad_sum_rows(near), ad_sum_rows(ad_square(v)));
    for (size_t k = 0; k < ROWS; k++)
        y = ad_add(y, ad_mul(ad_mul(ad_row(v, k), ad_row(v, (k + 1) % ROWS)),
                             ad_cos(ad_sub(ad_row(x, k), ad_row(x, 0)))));
    return y;
}

static struct action action(size_t cols, const char *columns)
{
    struct action a = {.tape = ad_tape_new(AD_F64), .cols = cols};
    uint64_t state = 7;
    ad_var g;
    setenv("LEASTACTION_COLUMNS", columns, 1);
    a.x = ad_input(a.tape, ROWS, cols, "x");
    a.u = ad_input(a.tape, ROWS, cols, "u");
    a.out[3] = lagrangian(a.x, ad_diff(a.x, 3.0, true));
    a.out[0] = ad_mean(a.out[3]);
    assert_int_equal(ad_grad(a.out[0], 1, &a.x, &g), AD_OK);
    a.out[1] = g;
    assert_int_equal(ad_grad(ad_dot(g, a.u), 1, &a.x, &a.out[2]), AD_OK);
    a.program = compile(a.tape, 4, a.out);
    for (int k = 0; k < 2; k++) {
        double *values = random_values(&state, ROWS * cols, -1, 1);
        assert_int_equal(ad_set(a.program, k ? a.u : a.x, values), AD_OK);
        free(values);
    }
    unsetenv("LEASTACTION_COLUMNS");
    return a;
}

static void action_free(struct action *a)
{
    ad_program_free(a->program);
    ad_tape_free(a->tape);
}

static void assert_equal(const struct action *a, const struct action *b, bool sums)
{
    size_t n = ROWS * a->cols * sizeof(double);
    assert_memory_equal(ad_data(a->program, a->out[1]), ad_data(b->program, b->out[1]), n);
    assert_memory_equal(ad_data(a->program, a->out[2]), ad_data(b->program, b->out[2]), n);
    assert_memory_equal(ad_data(a->program, a->out[3]), ad_data(b->program, b->out[3]), n / ROWS);
    double s = *(const double *)ad_data(a->program, a->out[0]);
    double t = *(const double *)ad_data(b->program, b->out[0]);
    assert_close(s, t, sums ? 0 : 1e-14, 0);
}

static void compare_blocks(bool native)
{
    static const char *const columns[] = {"16", "32", "48", "100", "500"};
    static const size_t cols[] = {64, 97, 333, 1000, 2051};
    for (size_t c = 0; c < LENGTH(cols); c++) {
        struct action first = action(cols[c], columns[0]);
        if (native)
            native_make(first.program);
        ad_run(first.program);
        for (size_t k = 0; k < (native ? 2 : LENGTH(columns)); k++) {
            if (cols[c] < 2 * strtoul(columns[k], NULL, 10))
                continue; /* a single block is no pass */
            struct action a = action(cols[c], columns[k]);
            if (native)
                native_make(a.program);
            for (size_t threads = 1; threads < 4; threads++) {
                ad_set_threads(a.program, threads);
                ad_run(a.program);
                assert_equal(&a, &first, k == 0);
            }
            action_free(&a);
        }
        action_free(&first);
    }
}

static void test_blocks_and_threads(void **state)
{
    (void)state;
    compare_blocks(false);
}

static void test_blocks_and_threads_native(void **state)
{
    (void)state;
    native_need_compiler();
    compare_blocks(true);
}

/* Rounding aside, the same as without passes, whose segments see whole rows. */
static void test_same_as_without(void **state)
{
    (void)state;
    struct action a = action(1003, "64"), b = action(1003, "0");
    ad_run(a.program);
    ad_run(b.program);
    for (size_t k = 0; k < 4; k++) {
        const double *x = ad_data(a.program, a.out[k]), *y = ad_data(b.program, b.out[k]);
        for (size_t i = 0; i < ad_rows(a.out[k]) * ad_cols(a.out[k]); i++)
            assert_close(x[i], y[i], 1e-12, 1e-15);
    }
    assert_true(ad_program_info(a.program).value_bytes < ad_program_info(b.program).value_bytes);
    action_free(&a);
    action_free(&b);
}

/* Beyond path and gradient: 0.3 times as much at most. */
static void test_memory(void **state)
{
    enum { COLS = 50000 };
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, ROWS, COLS, "x");
    ad_var out[] = {ad_mean(lagrangian(x, ad_diff(x, 3.0, true))), {0}};
    assert_int_equal(ad_grad(out[0], 1, &x, &out[1]), AD_OK);
    ad_program *p = compile(tape, 2, out);
    assert_in_range(ad_program_info(p).value_bytes, 1, 2 * ROWS * COLS * sizeof(double) * 13 / 10);
    ad_program_free(p);
    ad_tape_free(tape);
}

/* In a window, where no memory is left to look at afterwards. */
static void test_nonfinite(void **state)
{
    (void)state;
    struct action a = action(1000, "32");
    double *x = ad_data(a.program, a.x);
    struct ad_error error = {0};
    x[3 * 1000 + 777] = INFINITY;
    assert_int_equal(ad_run_checked(a.program, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "\"x\""));
    error = (struct ad_error){0};
    x[3 * 1000 + 777] = 1e200; /* its square is the first that is infinite */
    assert_int_equal(ad_run_checked(a.program, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "inf at row"));
    assert_non_null(strstr(error.message, "column 77"));
    error = (struct ad_error){0};
    x[3 * 1000 + 777] = 0.5;
    assert_int_equal(ad_run_checked(a.program, &error), AD_OK);
    action_free(&a);
}

/* ---- neighbours of computed values ---- */

enum { CHAINS = 3, DEEPEST = 7 }; /* deeper than one pass has columns beyond its blocks */

/* Each step reads the columns to the right and to the left of what the step before computed. */
static ad_var chain(ad_var y, size_t depth, size_t number)
{
    for (size_t k = 0; k < depth; k++) {
        bool right = (k + number) % 2;
        ad_var d = right ? ad_diff(y, 0.75, true) : ad_diff_adjoint(y, 0.75, true, ad_cols(y));
        y = ad_add(ad_sin(d), ad_mul(y, 0.5 + (double)number));
    }
    return y;
}

static double difference(const double y[], size_t n, size_t i, bool right)
{
    if (right)
        return 0.75 * (i + 1 < n ? y[i + 1] - y[i] : y[n - 1] - y[n - 2]);
    double left = i ? y[i - 1] : 0,
           own = i + 1 < n ? y[i] : 0; /* the last difference counts twice */
    left += i + 1 == n ? y[n - 1] : 0;
    own += i + 2 == n ? y[n - 1] : 0;
    return 0.75 * (left - own);
}

static void plain_chain(double y[], size_t n, size_t depth, size_t number)
{
    double *next = malloc(n * sizeof *next);
    for (size_t k = 0; k < depth; k++) {
        for (size_t i = 0; i < n; i++)
            next[i] = sin(difference(y, n, i, (k + number) % 2)) + y[i] * (0.5 + (double)number);
        memcpy(y, next, n * sizeof *y);
    }
    free(next);
}

static void compare_chains(const char *columns, size_t depth, size_t cols)
{
    uint64_t state = 11;
    setenv("LEASTACTION_COLUMNS", columns, 1);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, ROWS, cols, "x"), out[CHAINS];
    for (size_t k = 0; k < CHAINS; k++)
        out[k] = chain(ad_cos(x), depth, k);
    ad_program *p = compile(tape, CHAINS, out);
    unsetenv("LEASTACTION_COLUMNS");
    double *at = random_values(&state, ROWS * cols, -1, 1), *y = malloc(cols * sizeof *y);
    assert_int_equal(ad_set(p, x, at), AD_OK);
    for (size_t threads = 1; threads < 4; threads += 2) {
        ad_set_threads(p, threads);
        ad_run(p);
        for (size_t k = 0; k < CHAINS * ROWS; k++) {
            const double *got = (const double *)ad_data(p, out[k / ROWS]) + k % ROWS * cols;
            for (size_t i = 0; i < cols; i++)
                y[i] = cos(at[k % ROWS * cols + i]);
            plain_chain(y, cols, depth, k / ROWS);
            for (size_t i = 0; i < cols; i++)
                assert_close(got[i], y[i], 1e-12, 1e-12);
        }
    }
    free(y);
    free(at);
    ad_program_free(p);
    ad_tape_free(tape);
}

static void test_neighbours_of_computed_values(void **state)
{
    static const char *const columns[] = {"16", "32", "48"};
    (void)state;
    for (size_t depth = 1; depth <= DEEPEST; depth++)
        for (size_t k = 0; k < LENGTH(columns); k++)
            compare_chains(columns[k], depth, 97 + 60 * k + depth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks_and_threads),
        cmocka_unit_test(test_blocks_and_threads_native),
        cmocka_unit_test(test_same_as_without),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_nonfinite),
        cmocka_unit_test(test_neighbours_of_computed_values),
    };
    return cmocka_run_group_tests(tests, native_share_cache, native_remove_cache);
}
