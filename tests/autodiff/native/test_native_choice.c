/* When a program is compiled, and when it stays interpreted and why. */
#include "tests/native.h"
#include "tests/autodiff/programs/world.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdlib.h>

/* Programs that would not run long are not compiled. */
static void test_few_runs(void **state)
{
    (void)state;
    native_need_compiler();
    struct ad_error note = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 43, "x"), y = ad_sum(ad_sin(x));
    ad_program *p = compile(tape, 1, &y);
    assert_false(ad_native(p, 1, &note));
    assert_mentions(note.message, "runs");
    ad_program_free(p);
    ad_tape_free(tape);
}

/* Nobody says how often it will run: after enough runs it is compiled, and goes on as before, in
   the middle of runs again with a held input, in a segment of more than one part that holds sums.
 */
static void test_in_time(void **state)
{
    enum { N = 3000, MOST = 20000, TERMS = 60 };
    (void)state;
    native_need_compiler();
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var h = ad_hold(ad_input(tape, 1, N, "h")), x = ad_input(tape, 1, 1, "x");
    ad_var y = ad_sin(h), total = ad_scalar(tape, 0), out[2];
    for (size_t k = 0; k < TERMS; k++) {
        y = ad_add(ad_mul(0.5, y), ad_mul(x, ad_recip(ad_add(1.5, ad_square(y)))));
        total = ad_add(total, ad_mul(1.0 + (double)k, ad_mean(y)));
    }
    out[0] = total;
    assert_int_equal(ad_grad(total, 1, &x, &out[1]), AD_OK);
    ad_program *p = compile(tape, 2, out), *interpreted = compile(tape, 2, out);
    double *held = malloc(N * sizeof *held);
    assert_non_null(held);
    for (size_t k = 0; k < N; k++)
        held[k] = 0.01 * (double)k;
    ad_set(p, h, held);
    ad_set(interpreted, h, held);
    assert_true(ad_program_info(p).instructions > 512); /* of a part */
    assert_mentions(ad_native_note(p), "requested");
    ad_native_lazy(p);
    assert_mentions(ad_native_note(p), "runs");
    size_t runs = 0, after = 0;
    for (; runs < MOST && after < 3; runs++) {
        double at = 0.1 + 0.001 * (double)(runs % 100);
        ad_set(p, x, &at);
        assert_int_equal(runs ? ad_rerun(p) : (ad_run(p), AD_OK), AD_OK);
        after += !*ad_native_note(p);
        if (after == 0 && runs % 16)
            continue;
        ad_set(interpreted, x, &at);
        ad_run(interpreted);
        for (size_t k = 0; k < 2; k++)
            assert_same_values(interpreted, p, out[k], 1e-13, "in time");
    }
    assert_int_equal(after, 3);
    assert_true(runs > 4);
    free(held);
    ad_program_free(p);
    ad_program_free(interpreted);
    ad_tape_free(tape);
}

/* A compiler would take minutes. */
static void test_large_programs_stay_interpreted(void **state)
{
    (void)state;
    struct ad_error note = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 10, "x"), y = x;
    for (size_t k = 0; k < 40000; k++)
        y = ad_add(ad_mul(0.5, y), x);
    ad_program *p = compile(tape, 1, &y);
    assert_false(ad_native(p, INFINITY, &note));
    assert_mentions(note.message, "80000 instructions");
    ad_program_free(p);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_runs),
        cmocka_unit_test(test_in_time),
        cmocka_unit_test(test_large_programs_stay_interpreted),
    };
    return cmocka_run_group_tests_name("choice of machine code", tests, native_open_cache,
                                       native_remove_cache);
}
