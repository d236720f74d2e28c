/* Products, gathers of columns and concatenations in passes over columns: the same to rounding as
   without passes, and to the last bit for all numbers of threads; what only a pass reads needs no
   memory; a product that is not finite is found. */
#include "tests/autodiff/support.h"
#include "tests/native.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Two layers of one matrix, which so has two gradients, a shift that columns look up, and rows that
   a sum by classes and a gradient of slices combine. */
enum { CLASSES = 3, UNITS = 6, TABLE = 5, N_PRODUCTS_OUT = 5 };

struct network {
    ad_tape *tape;
    ad_var x, weight, table, out[N_PRODUCTS_OUT]; /* sum, three gradients, a row of columns */
    ad_program *program;
};

static struct network network(enum ad_type type, size_t cols, const char *columns)
{
    static const uint32_t classes[UNITS] = {2, 0, 1, 1, 0, 2};
    struct network a = {.tape = ad_tape_new(type)};
    uint64_t state = 11;
    uint32_t *looked_up = malloc(cols * sizeof *looked_up);
    assert_non_null(looked_up);
    for (size_t k = 0; k < cols; k++)
        looked_up[k] = (uint32_t)(k * k % TABLE);
    setenv("LEASTACTION_COLUMNS", columns, 1);
    a.x = ad_input(a.tape, UNITS, cols, "x");
    a.weight = ad_input(a.tape, UNITS, UNITS, "weight");
    a.table = ad_input(a.tape, UNITS, TABLE, "table");
    ad_var shift = ad_gather_cols(a.table, cols, looked_up);
    ad_var hidden = ad_tanh(ad_add(ad_matmul(a.weight, false, a.x, false), shift));
    ad_var y = ad_sin(ad_matmul(a.weight, true, ad_mul(hidden, shift), false));
    ad_var top = ad_mul(ad_slice_rows(y, 0, 2), ad_slice_rows(hidden, 3, 2));
    a.out[4] = ad_add(ad_log_sum_exp_rows(ad_scatter_rows(y, classes, CLASSES)), ad_sum_rows(top));
    a.out[0] = ad_mean(a.out[4]);
    assert_int_equal(ad_grad(a.out[0], 3, (ad_var[]){a.weight, a.x, a.table}, a.out + 1), AD_OK);
    a.program = compile(a.tape, N_PRODUCTS_OUT, a.out);
    for (int k = 0; k < 3; k++) {
        ad_var in = k == 0 ? a.x : k == 1 ? a.weight : a.table;
        double *values = random_values(&state, ad_rows(in) * ad_cols(in), -1, 1);
        assert_int_equal(ad_set(a.program, in, values), AD_OK);
        free(values);
    }
    unsetenv("LEASTACTION_COLUMNS");
    free(looked_up);
    return a;
}

static void network_free(struct network *a)
{
    ad_program_free(a->program);
    ad_tape_free(a->tape);
}

static void assert_networks(const struct network *a, const struct network *b, double tolerance)
{
    for (size_t k = 0; k < N_PRODUCTS_OUT; k++) {
        size_t n = ad_rows(a->out[k]) * ad_cols(a->out[k]);
        double *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y);
        assert_true(x && y && ad_get(a->program, a->out[k], x) == AD_OK &&
                    ad_get(b->program, b->out[k], y) == AD_OK);
        for (size_t i = 0; i < n; i++)
            assert_close(x[i], y[i], tolerance, tolerance);
        free(x);
        free(y);
    }
}

/* The same to rounding as without passes, and to the last bit for all numbers of threads. */
static void compare_products(enum ad_type type, bool native, double tolerance)
{
    static const char *const columns[] = {"16", "48", "500"};
    static const size_t cols[] = {64, 333, 2051};
    for (size_t c = 0; c < LENGTH(cols); c++) {
        struct network whole = network(type, cols[c], "0");
        ad_run(whole.program);
        for (size_t k = 0; k < (native ? 2 : LENGTH(columns)); k++) {
            struct network a = network(type, cols[c], columns[k]);
            struct network b = network(type, cols[c], columns[k]);
            if (native) {
                native_make(a.program);
                native_make(b.program);
            }
            ad_run(a.program);
            assert_networks(&a, &whole, tolerance);
            for (size_t threads = 2; threads < 5; threads++) {
                ad_set_threads(b.program, threads);
                ad_run(b.program);
                assert_networks(&b, &a, 0);
            }
            network_free(&a);
            network_free(&b);
        }
        network_free(&whole);
    }
}

static void test_products(void **state)
{
    (void)state;
    compare_products(AD_F64, false, 1e-12);
    compare_products(AD_F32, false, 1e-4);
}

static void test_products_native(void **state)
{
    (void)state;
    native_need_compiler();
    compare_products(AD_F64, true, 1e-12);
}

/* Little beyond inputs, gradients and one adjoint; a checked run, whose products are in windows,
   says where they overflow. */
static void test_products_memory(void **state)
{
    enum { COLS = 30000, ROWS_OUT = 2 * UNITS + 1 };
    (void)state;
    struct network a = network(AD_F64, COLS, "256");
    struct ad_error error = {0};
    size_t bytes = ad_program_info(a.program).value_bytes;
    double *weight = ad_data(a.program, a.weight), *x = ad_data(a.program, a.x);
    /* the adjoint of the shift, which is scattered to the columns of the table, and a row more */
    assert_in_range(bytes, 1, (ROWS_OUT + UNITS + 1) * COLS * sizeof(double));
    weight[2 * UNITS + 3] = x[3 * COLS + 20777] = 1e200;
    assert_int_equal(ad_run_checked(a.program, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "matmul"));
    assert_non_null(strstr(error.message, "at row 2, column 20777"));
    network_free(&a);
}

/* A gradient that is a sum over columns and a product that adds columns up: the product may not
   accumulate onto what is complete after the pass alone. */
static void test_product_beside_a_sum(void **state)
{
    enum { ROWS = 3, COLS = 300 };
    (void)state;
    uint64_t random = 7;
    double *x = random_values(&random, ROWS * COLS, -1, 1),
           *b = random_values(&random, COLS, -1, 1);
    double w[ROWS] = {0.3, -0.5, 0.7};
    for (int swapped = 0; swapped < 2; swapped++) {
        setenv("LEASTACTION_COLUMNS", "16", 1);
        ad_tape *t = ad_tape_new(AD_F64);
        ad_var in[] = {ad_input(t, ROWS, 1, "w"), ad_input(t, ROWS, COLS, "x"),
                       ad_input(t, 1, COLS, "b")};
        ad_var weighted = ad_sum(ad_mul(ad_sin(in[1]), ad_mul(in[1], in[0])));
        ad_var product = ad_sum(ad_mul(ad_cos(in[1]), ad_matmul(in[0], false, in[2], false)));
        ad_var gradient;
        ad_grad(swapped ? ad_add(product, weighted) : ad_add(weighted, product), 1, in, &gradient);
        double *got = evaluate(gradient, 3, in, (const double *const[]){w, x, b});
        for (size_t r = 0; r < ROWS; r++) {
            double sum = 0;
            for (size_t c = 0; c < COLS; c++)
                sum += sin(x[r * COLS + c]) * x[r * COLS + c] + cos(x[r * COLS + c]) * b[c];
            assert_close(got[r], sum, 1e-12, 0);
        }
        free(got);
        ad_tape_free(t);
        unsetenv("LEASTACTION_COLUMNS");
    }
    free(x);
    free(b);
}

/* Two products into the same memory, the second at the end of a long pass: a block may not add the
   first before the block before it has added the second. */
static void test_products_in_turn(void **state)
{
    enum { COLS = 4000, LAYERS = 12, THREADS = 4, RUNS = 5 };
    (void)state;
    uint64_t random = 5;
    double *values = random_values(&random, UNITS * COLS, -1, 1), got[UNITS * UNITS],
           first[UNITS * UNITS];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, UNITS, COLS, "x"), weight = ad_slice_cols(x, 0, UNITS), deep = x;
    for (size_t k = 0; k < LAYERS; k++)
        deep = ad_sin(ad_add(ad_matmul(weight, k % 2, deep, false), ad_log(ad_add(2.0, x))));
    ad_var y = ad_add(ad_matmul(ad_cos(x), false, x, true), ad_matmul(deep, false, x, true));
    setenv("LEASTACTION_COLUMNS", "100", 1);
    ad_program *p = compile(t, 1, &y);
    unsetenv("LEASTACTION_COLUMNS");
    assert_int_equal(ad_set(p, x, values), AD_OK);
    ad_run(p);
    assert_int_equal(ad_get(p, y, first), AD_OK);
    ad_set_threads(p, THREADS);
    for (int run = 0; run < RUNS; run++) {
        ad_run(p);
        assert_int_equal(ad_get(p, y, got), AD_OK);
        assert_memory_equal(got, first, sizeof got);
    }
    ad_program_free(p);
    ad_tape_free(t);
    free(values);
}

/* Values of two widths that depend on each other nowhere: those of one form one pass, whatever
   order they were recorded in. */
static void test_widths_apart(void **state)
{
    enum { COLS = 30000, LAYERS = 8 };
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var weight = ad_input(t, UNITS, UNITS, "weight"),
           y[] = {ad_input(t, UNITS, COLS, "x"), ad_input(t, UNITS, COLS / 2, "u")};
    for (size_t k = 0; k < LAYERS; k++)
        for (size_t w = 0; w < 2; w++)
            y[w] = ad_tanh(ad_matmul(weight, false, y[w], false));
    ad_var sums[] = {ad_mean(y[0]), ad_mean(y[1])};
    ad_program *p = compile(t, 2, sums);
    size_t inputs = UNITS * (COLS + COLS / 2) * sizeof(double);
    assert_in_range(ad_program_info(p).value_bytes, inputs, inputs * 11 / 10);
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_products),         cmocka_unit_test(test_products_native),
        cmocka_unit_test(test_products_memory),  cmocka_unit_test(test_product_beside_a_sum),
        cmocka_unit_test(test_products_in_turn), cmocka_unit_test(test_widths_apart),
    };
    return cmocka_run_group_tests(tests, native_share_cache, native_remove_cache);
}
