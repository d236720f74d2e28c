/* Held inputs: ad_rerun gives what ad_run gives, to the last bit. */
#include "autodiff/autodiff.h"
#include "autodiff/exec/program.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>

enum { BODIES = 7, COLS = 300, PAIRS = BODIES * (BODIES - 1) / 2 };

/* A pair law, its gradient by x, and the product of its second derivatives with u: gathers,
   scatters, sums, products and concatenations on either side of the border. */
struct law {
    ad_tape *tape;
    ad_program *program;
    ad_var x, u, g, product, joined, squares;
};

static struct law record(bool hold)
{
    struct law l = {.tape = ad_tape_new(AD_F64)};
    uint32_t first[PAIRS], second[PAIRS];
    size_t n = 0;
    for (uint32_t i = 0; i < BODIES; i++)
        for (uint32_t j = i + 1; j < BODIES; j++, n++) {
            first[n] = i;
            second[n] = j;
        }
    l.x = ad_input(l.tape, BODIES, COLS, "x");
    l.u = ad_input(l.tape, BODIES, 1, "u");
    if (hold)
        ad_hold(l.x);
    ad_var d = ad_sub(ad_gather_rows(l.x, PAIRS, first), ad_gather_rows(l.x, PAIRS, second));
    ad_var V = ad_sum_rows(ad_exp(ad_neg(ad_square(d))));
    ad_grad(V, 1, &l.x, &l.g);
    ad_grad(ad_dot(l.g, l.u), 1, &l.x, &l.product);
    l.joined = ad_concat_rows(2, (ad_var[]){ad_sin(l.x), l.product});
    l.squares = ad_add(ad_matmul(l.x, false, l.x, true), ad_matmul(l.u, false, l.u, true));
    const ad_var out[] = {l.g, l.product, l.joined, l.squares};
    assert_int_equal(ad_compile(l.tape, 4, out, &l.program), AD_OK);
    return l;
}

static void law_free(struct law *l)
{
    ad_program_free(l->program);
    ad_tape_free(l->tape);
}

static void set(struct law *l, ad_var x, double phase)
{
    double values[BODIES * COLS];
    for (size_t k = 0; k < ad_rows(x) * ad_cols(x); k++)
        values[k] = sin(phase + 1.7 * (double)k);
    ad_set(l->program, x, values);
}

static void assert_same(struct law *a, ad_var x, struct law *b, ad_var y)
{
    assert_memory_equal(ad_data(a->program, x), ad_data(b->program, y),
                        ad_rows(x) * ad_cols(x) * sizeof(double));
}

static void assert_near(struct law *a, ad_var x, struct law *b, ad_var y)
{
    const double *p = ad_data(a->program, x), *q = ad_data(b->program, y);
    for (size_t k = 0; k < ad_rows(x) * ad_cols(x); k++)
        assert_close(p[k], q[k], 1e-14, 1e-14);
}

static void rerun_is_run(void **state)
{
    (void)state;
    struct law held = record(true), fresh = record(true), plain = record(false);
    for (int point = 0; point < 3; point++) {
        set(&held, held.x, point);
        set(&fresh, fresh.x, point);
        set(&plain, plain.x, point);
        for (int seed = 0; seed < 4; seed++) {
            set(&held, held.u, 10 + seed);
            set(&fresh, fresh.u, 10 + seed);
            set(&plain, plain.u, 10 + seed);
            if (seed == 0)
                ad_run(held.program);
            else
                assert_int_equal(ad_rerun(held.program), AD_OK);
            ad_run(fresh.program);
            assert_same(&held, held.g, &fresh, fresh.g);
            assert_same(&held, held.product, &fresh, fresh.product);
            assert_same(&held, held.joined, &fresh, fresh.joined);
            assert_same(&held, held.squares, &fresh, fresh.squares);
            ad_run(plain.program); /* sums in another order */
            assert_near(&held, held.product, &plain, plain.product);
        }
    }
    law_free(&held);
    law_free(&fresh);
    law_free(&plain);
}

/* A25: nothing runs, and the reason is said, where held inputs have decided nothing yet. */
static void rerun_comes_after_run(void **state)
{
    (void)state;
    struct law a = record(true), b = record(true);
    set(&a, a.x, 0);
    set(&a, a.u, 10);
    assert_int_equal(ad_rerun(a.program), AD_E_ARGUMENT);
    assert_int_equal(ad_program_error(a.program)->status, AD_E_ARGUMENT);
    assert_mentions(ad_program_error(a.program)->message, "ad_run");
    ad_run(a.program);
    assert_int_equal(ad_rerun(a.program), AD_OK);
    assert_int_equal(ad_program_error(a.program)->status, AD_OK);
    set(&a, a.x, 1);
    assert_int_equal(ad_rerun(a.program), AD_E_ARGUMENT);
    assert_mentions(ad_program_error(a.program)->message, "held");
    set(&b, b.x, 0); /* what stands is of the inputs before */
    set(&b, b.u, 10);
    ad_run(b.program);
    assert_same(&a, a.product, &b, b.product);
    ad_run_timed(a.program);
    assert_int_equal(ad_rerun(a.program), AD_OK);
    set(&a, a.u, 11);
    assert_int_equal(ad_rerun(a.program), AD_OK);
    law_free(&a);
    law_free(&b);
}

static void rerun_skips_work(void **state)
{
    (void)state;
    struct law held = record(true), plain = record(false);
    const ad_program *p = held.program;
    assert_true(p->n_held_segments > p->n_constant_segments);
    assert_true(p->n_held_segments < p->n_segments);
    assert_int_equal(plain.program->n_held_segments, plain.program->n_constant_segments);
    law_free(&held);
    law_free(&plain);
}

static void only_inputs_are_held(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_hold(ad_sin(ad_input(tape, 2, 2, "x")));
    assert_int_equal(ad_tape_error(tape)->status, AD_E_ARGUMENT);
    assert_mentions(ad_tape_error(tape)->message, "sin");
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rerun_is_run),
        cmocka_unit_test(rerun_comes_after_run),
        cmocka_unit_test(rerun_skips_work),
        cmocka_unit_test(only_inputs_are_held),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
