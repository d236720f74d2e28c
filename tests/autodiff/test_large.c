/* Deep and large tapes, wide products. */
#include "support.h"

#include <malloc.h>
#include <stdlib.h>

/* Heap in use, large mapped blocks included. */
static size_t heap_bytes(void)
{
#ifndef __GLIBC_PREREQ
#define __GLIBC_PREREQ(major, minor) 0
#endif
#if __GLIBC_PREREQ(2, 33)
    struct mallinfo2 m = mallinfo2();
    return m.uordblks + m.hblkhd;
#else
    return 0;
#endif
}

/* Recursion would need a stack far beyond what a process has. */
static void test_a_deep_chain(void **state)
{
    (void)state;
    enum { DEPTH = 1000000 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, NULL), y = x, g;
    for (int k = 0; k < DEPTH / 2; k++)
        y = ad_sin(ad_add(y, 0.25));
    assert_true(ad_tape_size(t) >= DEPTH);
    assert_int_equal(ad_grad(y, 1, &x, &g), AD_OK);
    double at = 0.3, value = at, slope = 1;
    for (int k = 0; k < DEPTH / 2; k++) {
        slope *= cos(value + 0.25);
        value = sin(value + 0.25);
    }
    ad_program *p = compile(t, 2, (ad_var[]){y, g});
    ad_set(p, x, &at);
    ad_run(p);
    double got;
    ad_get(p, y, &got);
    assert_close(got, value, 1e-12, 0);
    ad_get(p, g, &got);
    assert_close(got, slope, 1e-9, 1e-300);
    ad_program_free(p);
    ad_tape_free(t);
}

/* A million nodes: memory by the library's own account and by the heap. */
static void test_a_million_nodes(void **state)
{
    (void)state;
    enum { NODES = 1000000 };
    size_t before = heap_bytes();
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, NULL), y = x, z = ad_cos(x);
    while (ad_tape_size(t) < NODES) {
        y = ad_mul(ad_sin(y), z);
        z = ad_add(z, y);
    }
    ad_program *p = compile(t, 1, &z);
    struct ad_program_info info = ad_program_info(p);
    size_t heap = heap_bytes() - before, nodes = ad_tape_size(t);
    assert_true(info.nodes > NODES - 1000);
    assert_true(ad_tape_bytes(t) + info.bytes < 200 * nodes);
    if (before)
        assert_true(heap < 200 * nodes + info.value_bytes);
    print_message("%zu nodes: %.0f bytes a node on the tape, %.0f in the program, "
                  "%.0f on the heap\n",
                  nodes, (double)ad_tape_bytes(t) / (double)nodes,
                  (double)info.bytes / (double)nodes, (double)heap / (double)nodes);
    double at = 0.7, got;
    ad_set(p, x, &at);
    ad_run(p);
    ad_get(p, z, &got);
    assert_true(isfinite(got));
    ad_program_free(p);
    ad_tape_free(t);
}

/* Rows of few and of more numbers times wide matrices, given either way, alone and added. */
static void test_rows_times_wide_matrices(void **state)
{
    (void)state;
    enum { COLS = 301, MOST = 9 };
    uint64_t seed = 5;
    double *row = random_values(&seed, MOST, -1, 1);
    double *wide = random_values(&seed, MOST * COLS, -1, 1), got[COLS];
    for (int type = AD_F32; type <= AD_F64; type++)
        for (size_t k = 1; k <= MOST; k++)
            for (int way = 0; way < 4; way++) {
                const bool ta = way & 1, tb = way & 2;
                ad_tape *t = ad_tape_new((enum ad_type)type);
                ad_var a = ad_input(t, ta ? k : 1, ta ? 1 : k, NULL);
                ad_var b = ad_input(t, tb ? COLS : k, tb ? k : COLS, NULL);
                ad_var c = ad_matmul(a, ta, b, tb), y = ad_add(c, ad_matmul(a, ta, b, tb));
                ad_program *p = compile(t, 1, &y);
                ad_set(p, a, row);
                ad_set(p, b, wide);
                ad_run(p);
                ad_get(p, y, got);
                for (size_t j = 0; j < COLS; j++) {
                    double sum = 0;
                    for (size_t l = 0; l < k; l++)
                        sum += 2 * row[l] * wide[tb ? j * k + l : l * COLS + j];
                    assert_close(got[j], sum, 0, type == AD_F32 ? 1e-5 : 1e-14);
                }
                ad_program_free(p);
                ad_tape_free(t);
            }
    free(row);
    free(wide);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_deep_chain),
        cmocka_unit_test(test_a_million_nodes),
        cmocka_unit_test(test_rows_times_wide_matrices),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
