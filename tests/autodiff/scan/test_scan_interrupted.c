/* Loops that are interrupted: forward, back and again forward for the way back, in loops of loops,
   compiled and directly. */
#include "scan_cases.h"

struct asked {
    size_t times, last; /* how often so far; how often it may go on */
};

static bool proceed(void *context)
{
    struct asked *a = context;
    return a->times++ < a->last;
}

enum { STEPS = 50 };

struct loop_of {
    ad_tape *tape;
    ad_var x[2], y, g[2], second[2];
};

/* y after so many steps of y' = w sin(y), each of them a loop of three where `nested`. */
static struct loop_of record(struct asked *asked, size_t checkpoints, bool nested)
{
    struct loop_of l = {.tape = ad_tape_new(AD_F64)};
    ad_tape *body = ad_tape_new(AD_F64), *outer = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), w = ad_input(body, 1, 1, "w");
    ad_var next = ad_mul(w, ad_sin(s)), middle;
    struct ad_body b = {.size = sizeof b,
                        .tape = body,
                        .n_state = 1,
                        .state = &s,
                        .next = &next,
                        .n_shared = 1,
                        .shared = &w,
                        .checkpoints = checkpoints,
                        .proceed = proceed,
                        .context = asked};
    if (nested) {
        ad_var u = ad_input(outer, 1, 1, "u"), v = ad_input(outer, 1, 1, "v");
        ad_scan(outer, &b, 3, &u, NULL, &v, &middle, NULL);
        b = (struct ad_body){.size = sizeof(struct ad_body),
                             .tape = outer,
                             .n_state = 1,
                             .state = &u,
                             .next = &middle,
                             .n_shared = 1,
                             .shared = &v,
                             .checkpoints = checkpoints};
        s = u, next = middle, w = v;
        b.state = &s, b.shared = &w;
    }
    l.x[0] = ad_input(l.tape, 1, 1, "x");
    l.x[1] = ad_input(l.tape, 1, 1, "w");
    ad_scan(l.tape, &b, STEPS, &l.x[0], NULL, &l.x[1], &l.y, NULL);
    ad_grad(l.y, 2, l.x, l.g);
    ad_grad(l.g[1], 2, l.x, l.second);
    ad_tape_free(body);
    ad_tape_free(outer);
    return l;
}

/* Wherever it is interrupted, it ends there, without finite results, and runs again as before. */
static void test_compiled(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        struct asked asked = {0, SIZE_MAX};
        struct loop_of l = record(&asked, kind % 2 ? 3 : 0, kind / 2);
        const ad_var out[] = {l.y, l.g[0], l.g[1], l.second[0], l.second[1]};
        ad_program *p = compile(l.tape, 5, out);
        double first[5], now;
        ad_set(p, l.x[0], (double[]){0.7});
        ad_set(p, l.x[1], (double[]){1.8});
        ad_run(p);
        for (int k = 0; k < 5; k++)
            ad_get(p, out[k], &first[k]);
        const size_t all = asked.times;
        assert_true(all >= STEPS * (kind / 2 ? 3 : 1) * 2);
        for (size_t last = 0; last < all; last += 1 + all / 40) {
            asked = (struct asked){0, last};
            ad_run(p);
            assert_int_equal(ad_program_error(p)->status, AD_E_ACCURACY);
            assert_true(asked.times < last + 20); /* other loops are asked once each */
            int finite = 0;
            for (int k = 0; k < 5; k++) {
                ad_get(p, out[k], &now);
                assert_true(isnan(now) || now == first[k]);
                finite += !isnan(now);
            }
            assert_true(finite < 5);
            struct ad_error error = {0};
            assert_int_equal(ad_run_checked(p, &error), AD_E_ACCURACY);
            assert_int_equal(ad_rerun(p), AD_E_ARGUMENT);
        }
        asked = (struct asked){0, SIZE_MAX};
        ad_run(p);
        assert_int_equal(ad_program_error(p)->status, AD_OK);
        assert_int_equal(asked.times, all);
        for (int k = 0; k < 5; k++) {
            ad_get(p, out[k], &now);
            assert_true(now == first[k]);
        }
        ad_program_free(p);
        ad_tape_free(l.tape);
    }
}

static void test_direct(void **state)
{
    (void)state;
    for (int nested = 0; nested < 2; nested++) {
        struct asked asked = {0, SIZE_MAX};
        struct loop_of l = record(&asked, 3, nested);
        const double at[] = {0.7, 1.8}, *values[] = {&at[0], &at[1]};
        double y, is, gradient[2];
        struct ad_error error = {0};
        assert_int_equal(ad_gradient(2, l.x, values, l.g[1], &y,
                                     (double *[]){&gradient[0], &gradient[1]}, &error),
                         AD_OK);
        const size_t all = asked.times;
        for (size_t last = 0; last < all; last += 1 + all / 40) {
            asked = (struct asked){0, last};
            error = (struct ad_error){0};
            assert_int_equal(ad_gradient(2, l.x, values, l.g[1], &is,
                                         (double *[]){&gradient[0], &gradient[1]}, &error),
                             AD_E_ACCURACY);
            assert_true(asked.times < last + 20);
        }
        asked = (struct asked){0, SIZE_MAX};
        assert_int_equal(ad_evaluate(2, l.x, values, l.g[1], &is, NULL), AD_OK);
        assert_true(is == y);
        ad_tape_free(l.tape);
    }
}

/* A loop of constants runs when it is compiled. */
static void test_constant(void **state)
{
    (void)state;
    struct asked asked = {0, 10};
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), next = ad_sin(s), x = ad_scalar(tape, 1), y;
    struct ad_body b = {.size = sizeof b,
                        .tape = body,
                        .n_state = 1,
                        .state = &s,
                        .next = &next,
                        .proceed = proceed,
                        .context = &asked};
    ad_program *p;
    ad_scan(tape, &b, 1000000000, &x, NULL, NULL, &y, NULL);
    assert_int_equal(ad_compile(tape, 1, &y, &p), AD_E_ACCURACY);
    assert_null(p);
    ad_tape_free(tape);
    ad_tape_free(body);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_compiled),
        cmocka_unit_test(test_direct),
        cmocka_unit_test(test_constant),
    };
    return cmocka_run_group_tests_name("scan interrupted", tests, NULL, NULL);
}
