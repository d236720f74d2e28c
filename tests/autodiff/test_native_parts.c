/* Segments that are too long for one function, against the interpreter: every way of walking them,
   values that are read long after they were computed, sums in the middle, chunks for threads. */
#include "tests/native.h"
#include "world.h"

#include <stdlib.h>

enum { LENGTH = 80, BODIES = 6, PAIRS = BODIES * (BODIES - 1) / 2 };

/* Each value depends on the one before and on one of long ago; none grows. */
static ad_var long_chain(ad_var x, ad_var also)
{
    ad_var y[LENGTH] = {x, also};
    for (size_t k = 2; k < LENGTH; k++) {
        ad_var before = y[k - 1], old = y[k > 40 ? k - 40 : k / 2];
        y[k] = ad_sub(ad_recip(ad_add(1.5, ad_square(before))), ad_mul(0.4, old));
    }
    return ad_add(y[LENGTH - 1], ad_mul(0.1, ad_mul(y[LENGTH / 2], y[LENGTH / 3])));
}

/* A value and its gradient, so that the chain is walked back, too. */
static void assert_equal_compiled(ad_var x, ad_var y, ad_var also, double tolerance)
{
    ad_var out[] = {ad_sum(y), ad_sum_cols(y), ad_sum_rows(y), also, also};
    enum { N = sizeof out / sizeof *out };
    assert_int_equal(ad_grad(ad_sum(ad_mul(also, ad_sum(y))), 1, &x, &out[N - 1]), AD_OK);
    ad_program *interpreted = compile(x.tape, N, out), *compiled = compile(x.tape, N, out);
    assert_true(ad_program_info(compiled).instructions > 800); /* of which few stand alone */
    native_make(compiled);
    uint64_t state = 11;
    double *values = random_values(&state, ad_rows(x) * ad_cols(x), -1, 1);
    ad_set(interpreted, x, values);
    ad_set(compiled, x, values);
    ad_run(interpreted);
    for (size_t threads = 1; threads < 4; threads += 2) {
        ad_set_threads(compiled, threads);
        ad_run(compiled);
        for (size_t k = 0; k < N; k++)
            assert_same_values(interpreted, compiled, out[k], tolerance, "long chain");
    }
    free(values);
    ad_program_free(interpreted);
    ad_program_free(compiled);
}

static void elementwise(enum ad_type type, size_t rows, size_t cols, double tolerance)
{
    ad_tape *tape = ad_tape_new(type);
    ad_var x = ad_input(tape, rows, cols, "x");
    ad_var also = cols > 1 ? ad_diff(x, 0.3, true) : ad_sin(x);
    assert_equal_compiled(x, long_chain(x, also), also, tolerance);
    ad_tape_free(tape);
}

static void test_rows_and_columns(void **state)
{
    (void)state;
    native_need_compiler();
    elementwise(AD_F64, 1, 37, 1e-12);
    elementwise(AD_F64, 3, 20, 1e-12);
    elementwise(AD_F32, 2, 37, 1e-4);
    elementwise(AD_F64, 41, 1, 1e-12);
}

static void test_chunks(void **state)
{
    (void)state;
    native_need_compiler();
    elementwise(AD_F64, 1, 3001, 1e-12);
}

/* A pair law of many operations. */
static void pairs(enum ad_type type, size_t cols, double tolerance)
{
    uint32_t first[PAIRS], second[PAIRS];
    size_t k = 0;
    for (uint32_t i = 0; i < BODIES; i++)
        for (uint32_t j = i + 1; j < BODIES; j++, k++) {
            first[k] = i;
            second[k] = j;
        }
    ad_tape *tape = ad_tape_new(type);
    ad_var x = ad_input(tape, BODIES, cols, "x");
    ad_var a = ad_gather_rows(x, PAIRS, first), b = ad_gather_rows(x, PAIRS, second);
    ad_var y = long_chain(ad_sub(a, b), ad_mul(a, b));
    assert_equal_compiled(x, y, ad_scatter_rows(y, first, BODIES), tolerance);
    ad_tape_free(tape);
}

static void test_pairs(void **state)
{
    (void)state;
    native_need_compiler();
    pairs(AD_F64, 37, 1e-12);
    pairs(AD_F64, 1, 1e-12);
    pairs(AD_F32, 5, 1e-4);
}

/* A1: a sum of each value, in a segment of several parts: what a sum reads may be overwritten by
   later instructions. */
static void test_sums_on_the_way(void **state)
{
    enum { COORDINATES = 10 };
    static const size_t cols[] = {1, 37, 104, 2500};
    (void)state;
    native_need_compiler();
    for (size_t n = 0; n < sizeof cols / sizeof *cols; n++) {
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var x = ad_input(tape, COORDINATES, cols[n], "x"), L = ad_scalar(tape, 0), out[3];
        for (size_t i = 0; i < COORDINATES; i++)
            for (size_t j = 0; j < i; j++) {
                ad_var d = ad_sub(ad_row(x, i), ad_row(x, j));
                L = ad_add(L, ad_recip(ad_sqrt(ad_add(0.5, ad_square(d)))));
                L = ad_add(L, ad_mul(1e-3, ad_mul(d, ad_sum(d))));
            }
        out[0] = ad_sum(L);
        out[2] = ad_sum_cols(L);
        assert_int_equal(ad_grad(out[0], 1, &x, &out[1]), AD_OK);
        ad_program *interpreted = compile(tape, 3, out), *compiled = compile(tape, 3, out);
        assert_true(ad_program_info(compiled).instructions > 800);
        native_make(compiled);
        uint64_t random = 31;
        double *values = random_values(&random, COORDINATES * cols[n], -1, 1);
        ad_set(interpreted, x, values);
        ad_set(compiled, x, values);
        ad_run(interpreted);
        ad_run(compiled);
        for (size_t k = 0; k < 3; k++)
            assert_same_values(interpreted, compiled, out[k], 1e-12, "sums on the way");
        free(values);
        ad_program_free(interpreted);
        ad_program_free(compiled);
        ad_tape_free(tape);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_and_columns),
        cmocka_unit_test(test_chunks),
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_sums_on_the_way),
    };
    return cmocka_run_group_tests(tests, native_open_cache, native_remove_cache);
}
