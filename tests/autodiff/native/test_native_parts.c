/* Segments too long for one function, against the interpreter: every loop order, values read long
   after they were computed, sums in the middle, chunks for threads. */
#include "autodiff/native/native.h"
#include "tests/native.h"
#include "tests/autodiff/programs/world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* ---- what compiling costs ---- */

/* The logarithm of a mixture's likelihood, row by row, and its gradient. */
static ad_program *mixture(size_t gaussians)
{
    enum { D = 10, CORNER = D * (D - 1) / 2, POINTS = 100 };
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, D, POINTS, "x"), in[] = {ad_input(tape, gaussians, 1, "weights"),
                                                       ad_input(tape, gaussians * D, 1, "means"),
                                                       ad_input(tape, gaussians * D, 1, "scales"),
                                                       ad_input(tape, gaussians * CORNER, 1, "l")};
    ad_var sum = ad_scalar(tape, 0), out[5];
    for (size_t k = 0; k < gaussians; k++) {
        ad_var z = ad_sub(x, ad_slice_rows(in[1], k * D, D)), square = ad_scalar(tape, 0);
        for (size_t i = 0, at = k * CORNER; i < D; at += i++) {
            ad_var y = ad_mul(ad_exp(ad_row(in[2], k * D + i)), ad_row(z, i));
            if (i)
                y = ad_add(
                    y, ad_sum_rows(ad_mul(ad_slice_rows(in[3], at, i), ad_slice_rows(z, 0, i))));
            square = ad_add(square, ad_square(y));
        }
        ad_var scales = ad_sum(ad_slice_rows(in[2], k * D, D));
        sum = ad_add(sum, ad_exp(ad_sub(ad_add(ad_row(in[0], k), scales), ad_mul(0.5, square))));
    }
    out[0] = ad_sum(ad_log(sum));
    assert_int_equal(ad_grad(out[0], 4, in, out + 1), AD_OK);
    ad_program *p = compile(tape, 5, out);
    ad_tape_free(tape);
    return p;
}

static size_t longest_function(const char *source)
{
    size_t longest = 0;
    for (const char *end; (end = strstr(source, "\n}\n")); source = end + 3)
        longest = (size_t)(end - source) > longest ? (size_t)(end - source) : longest;
    return longest;
}

/* C4: a compiler takes time by the length of what it reads, and more where functions are long. */
static void test_source_is_linear(void **state)
{
    static const size_t gaussians[] = {5, 10, 20, 62};
    double first = 0;
    (void)state;
    for (size_t k = 0; k < sizeof gaussians / sizeof *gaussians; k++) {
        ad_program *p = mixture(gaussians[k]);
        struct native native = {0};
        char *source = ad_native_source(p, &native);
        assert_non_null(source);
        double each = (double)native.bytes / (double)ad_program_info(p).instructions;
        first = k ? first : each;
        assert_true(each > 40 && each < 1.1 * first && first < 180);
        assert_true(longest_function(source) < 64 << 10);
        assert_true(native.bytes < strlen(source));
        free(source);
        free(native.segments);
        ad_program_free(p);
    }
}

/* Sums over rows between sines with their cosines: one loop after the other. */
static ad_program *chain(size_t links)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var q = ad_input(tape, 20, 100, "q"), y = q, g;
    for (size_t k = 0; k < links; k++) {
        y = ad_add(y, ad_mul(0.1 * (double)k, ad_sum_rows(ad_square(y))));
        y = ad_add(ad_sin(y), ad_mul(0.5, ad_cos(y)));
    }
    assert_int_equal(ad_grad(ad_sum(y), 1, &q, &g), AD_OK);
    ad_program *p = compile(tape, 1, &g);
    ad_tape_free(tape);
    return p;
}

/* C4: the price by which programs are compiled or not is that of their source, of which loops and
   sines take more of a compiler's time than their length tells: 20 links took 1.0 s, said 0.5 s. */
static void check_price(ad_program *p, double least_loops, double least_sincos)
{
    struct native native = {0};
    free(ad_native_source(p, &native));
    free(native.segments);
    assert_true((double)native.loops >= least_loops);
    assert_true((double)native.sincos >= least_sincos);
    double expected = 0.15 + 6.5e-6 * (double)native.bytes + 2.5e-3 * (double)native.loops +
                      2e-3 * (double)native.sincos;
    double price = 0;
    for (double runs = 1; price < 0.9 * expected; runs *= 1.2) {
        struct ad_error note = {0};
        assert_false(ad_native(p, runs, &note));
        const char *about = strstr(note.message, "about ");
        assert_non_null(about);
        price = strtod(about + strlen("about "), NULL);
    }
    assert_true(price < 1.1 * expected);
    ad_program_free(p);
}

static void test_price(void **state)
{
    (void)state;
    native_need_compiler();
    check_price(mixture(5), 1, 0);
    check_price(chain(20), 40, 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_and_columns),
        cmocka_unit_test(test_chunks),
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_sums_on_the_way),
        cmocka_unit_test(test_source_is_linear),
        cmocka_unit_test(test_price),
    };
    return cmocka_run_group_tests(tests, native_open_quick, native_remove_cache);
}
