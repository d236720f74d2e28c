/* When a program is compiled, and when it stays interpreted and why. */
#include "tests/native.h"
#include "tests/autodiff/programs/world.h"
#include "tests/mentions.h"
#include "tests/ranks.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

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
   On so few columns machine code is surely faster. */
static void test_in_time(void **state)
{
    enum { N = 16, MOST = 400000, TERMS = 26 };
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
        if (after == 0 && runs % 512)
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

/* From now on CC is the system's, whose functions lose some time first. */
static void use_slow_compiler(void)
{
    const char *cc = getenv("CC");
    struct path header = files_write_text(
        "slow.h", "#define HOOK __attribute__((no_instrument_function, visibility(\"hidden\")))\n"
                  "HOOK void __cyg_profile_func_exit(void *f, void *c) { (void)f; (void)c; }\n"
                  "HOOK void __cyg_profile_func_enter(void *f, void *c)\n"
                  "{ (void)f; (void)c; for (volatile int i = 0; i < 300000; i++); }\n");
    struct path name = files_temporary("slow-cc");
    FILE *script = fopen(name.text, "w");
    assert_non_null(script);
    fprintf(script, "#!/bin/sh\nexec %s -finstrument-functions -include %s \"$@\"\n",
            cc && *cc ? cc : "cc", header.text);
    fclose(script);
    assert_int_equal(chmod(name.text, 0700), 0);
    setenv("CC", name.text, 1);
}

static int doubled(void *calls, size_t cols, const double *const x[], double *y)
{
    for (size_t c = 0; c < cols; c++)
        y[c] = 2 * x[0][c];
    ++*(size_t *)calls;
    return 0;
}

/* Runs and reruns give the bits of the interpreter, and each calls a user's function once. */
static void run_both(ad_program *p, ad_program *interpreted, ad_var x, ad_var y, size_t *calls)
{
    for (int k = 0; k < 4; k++) {
        double at = 0.3 + 0.1 * k, value[2];
        ad_program *both[] = {p, interpreted};
        for (int i = 0; i < 2; i++) {
            size_t before = *calls;
            ad_set(both[i], x, &at);
            assert_int_equal(k % 2 ? ad_rerun(both[i]) : (ad_run(both[i]), AD_OK), AD_OK);
            assert_int_equal(*calls, before + 1);
            ad_get(both[i], y, &value[i]);
        }
        assert_memory_equal(&value[0], &value[1], sizeof value[0]);
    }
}

/* Machine code that is measured to be slower is not taken, by this program and by later ones, and
   the values are those of the interpreter; unless it is asked for in any case. */
static void test_slower_is_not_taken(void **state)
{
    enum { N = 60, TERMS = 20 };
    (void)state;
    native_need_compiler();
    use_slow_compiler();
    struct ad_error note = {0};
    size_t calls = 0;
    const struct ad_custom twice = {
        .size = sizeof twice, .name = "twice", .rows = 1, .value = doubled, .user = &calls};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var h = ad_hold(ad_input(tape, 1, N, "h")), x = ad_input(tape, 1, 1, "x");
    ad_var y = ad_mul(x, ad_exp(h)), square = ad_matmul(h, true, h, false);
    for (size_t k = 0; k < TERMS; k++)
        y = ad_add(ad_mul(0.5, y), ad_mul(x, ad_sin(y)));
    y = ad_custom(1, &y, &twice);
    y = ad_sum(ad_exp(ad_mul(0.01, ad_matmul(ad_sin(y), false, square, false))));
    ad_program *p = compile(tape, 1, &y), *interpreted = compile(tape, 1, &y);
    double held[N];
    for (size_t k = 0; k < N; k++)
        held[k] = 0.01 * (double)k;
    ad_set(interpreted, h, held);
    ad_set(p, h, held);
    assert_true(ad_native(p, 1e9, NULL)); /* not measured yet */
    run_both(p, interpreted, x, y, &calls);
    assert_mentions(ad_native_note(p), "slower");
    ad_program_free(p);
    p = compile(tape, 1, &y); /* the same in a later program, from the cache */
    ad_set(p, h, held);
    assert_false(ad_native(p, 1e9, &note));
    assert_mentions(note.message, "slower");
    run_both(p, interpreted, x, y, &calls);
    native_make(p);
    ad_run(p);
    assert_string_equal(ad_native_note(p), "");
    assert_same_values(interpreted, p, y, 1e-13, "in any case");
    ad_program_free(p);
    ad_program_free(interpreted);
    ad_tape_free(tape);
}

/* Rank by rank the same: on all where all can, on none where one has nothing to compile. */
struct ranked {
    bool lacks; /* rank 2: its machine code */
    bool native[3];
    double value[3];
    struct ad_error error[3];
};

static void run_ranked(void *context, struct ad_ranks *ranks)
{
    enum { N = 16 };
    struct ranked *r = context;
    const size_t k = ranks->rank;
    double at[N];
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, N, 1, "x"), y = ad_dot(x, ad_sin(x));
    if (r->lacks && k == 2)
        y = ad_matmul(x, true, x, false);
    ad_program *p = compile(tape, 1, &y);
    for (size_t i = 0; i < N; i++)
        at[i] = 0.1 * (double)i;
    ad_native_ranks(ranks, p, k == 0 ? 1e9 : 1, &r->error[k]);
    ad_set(p, x, at);
    ad_run(p);
    ad_get(p, y, &r->value[k]);
    r->native[k] = !*ad_native_note(p);
    ad_program_free(p);
    ad_tape_free(tape);
}

static void test_ranks_agree(void **state)
{
    (void)state;
    native_need_compiler();
    for (int lacks = 0; lacks < 2; lacks++) {
        struct ranked r = {.lacks = lacks};
        with_ranks(3, run_ranked, &r);
        for (size_t k = 0; k < 3; k++) {
            assert_int_equal(r.error[k].status, AD_OK);
            assert_int_equal(r.native[k], !lacks);
        }
        assert_true(r.value[0] == r.value[1] && r.value[0] > 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_runs),
        cmocka_unit_test(test_in_time),
        cmocka_unit_test(test_ranks_agree),
        cmocka_unit_test(test_large_programs_stay_interpreted),
        cmocka_unit_test(test_slower_is_not_taken), /* last: changes CC */
    };
    return cmocka_run_group_tests_name("choice of machine code", tests, native_open_cache,
                                       native_remove_cache);
}
