/* Thousands of random programs: the compiled program against plain loops, for two sets of inputs
   and several numbers of threads; gradients against differences. The oracle of the compiler. */
#include "world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t widths[] = {1, 2, 3, 7, 31, 64, 100, 129, 255, 256, 257, 600, 1000, 2000};
enum { N_WIDTHS = sizeof widths / sizeof widths[0], MAX_OUT = 6 };

static struct world world(enum ad_type type, uint64_t seed, uint64_t values, bool smooth)
{
    struct world w;
    world_init(&w, type, seed, values, widths[seed % N_WIDTHS], 6 + 5 * (seed % 11), smooth);
    return w;
}

/* Some of the values, inputs and constants among them, one twice, and always the last. */
static size_t draw_outputs(const struct world *w, size_t out[MAX_OUT])
{
    uint64_t state = w->structure;
    size_t n = 1 + below(&state, MAX_OUT - 1);
    for (size_t k = 0; k < n; k++)
        out[k] = below(&state, w->n);
    out[0] = w->n - 1;
    out[n] = out[below(&state, n)];
    return n + 1;
}

/* Small programs make no passes unless blocks of columns are made smaller than usual. */
static void set_block(uint64_t seed)
{
    static const char *const columns[] = {"0", "16", "32", "48", "100"};
    setenv("LEASTACTION_COLUMNS", columns[seed / N_WIDTHS % 5], 1);
}

static ad_program *program_of(const struct world *w, size_t n_out, const size_t out[])
{
    ad_var vars[MAX_OUT];
    for (size_t k = 0; k < n_out; k++)
        vars[k] = w->var[out[k]];
    return compile(w->tape, n_out, vars);
}

static void set_inputs(ad_program *p, const struct world *inputs, const struct world *values)
{
    for (size_t k = 0; k < inputs->n_inputs; k++)
        assert_int_equal(ad_set(p, inputs->var[k], values->m[k].v), AD_OK);
}

static void compare(const ad_program *p, const struct world *w, const struct world *expected,
                    size_t n_out, const size_t out[], double tolerance, uint64_t seed)
{
    for (size_t k = 0; k < n_out; k++) {
        const struct matrix *m = &expected->m[out[k]];
        double *got = malloc(m->rows * m->cols * sizeof *got);
        assert_non_null(got);
        assert_int_equal(ad_get(p, w->var[out[k]], got), AD_OK);
        for (size_t i = 0; i < m->rows * m->cols; i++)
            if (!is_close(got[i], m->v[i], tolerance, tolerance))
                fail_msg(
                    "program %llu, value %zu of %zu (%zu x %zu), element %zu: %.17g, not %.17g",
                    (unsigned long long)seed, out[k], w->n, m->rows, m->cols, i, got[i], m->v[i]);
        free(got);
    }
}

/* One program, the values of its inputs and others. */
static uint64_t subject_seed;
static struct world subject, other;

static void values_on_this_isa(void)
{
    const double tolerance = 1e-11;
    size_t out[MAX_OUT], n_out = draw_outputs(&subject, out);
    ad_program *p = program_of(&subject, n_out, out);
    set_inputs(p, &subject, &other);
    ad_run(p);
    compare(p, &subject, &other, n_out, out, tolerance, subject_seed);
    set_inputs(p, &subject, &subject);
    for (size_t threads = 1; threads < 4; threads++) {
        ad_set_threads(p, threads);
        ad_run(p);
        compare(p, &subject, &subject, n_out, out, tolerance, subject_seed);
    }
    ad_program_free(p);
}

/* Of three builds, which FUZZ_SHARE numbers 0 to 2, each takes n seeds of its own. */
static uint64_t first(uint64_t seed, uint64_t n)
{
    const char *share = getenv("FUZZ_SHARE");
    return seed + (share ? strtoull(share, NULL, 10) % 3 : 0) * n;
}

static void test_values_f64(void **state)
{
    (void)state;
    const uint64_t last = first(0, 500) + 500;
    for (subject_seed = last - 500; subject_seed < last; subject_seed++) {
        subject = world(AD_F64, subject_seed, 1, false);
        other = world(AD_F64, subject_seed, 2, false);
        set_block(subject_seed);
        for_each_isa(values_on_this_isa);
        world_release(&subject);
        world_release(&other);
    }
}

/* Rounding in f32 is 1e-7 an operation, and conditions of select may turn on it: a few seeds whose
   values stay clear of them. */
static void test_values_f32(void **state)
{
    (void)state;
    for (uint64_t seed = first(1000, 130), last = seed + 130; seed < last; seed++) {
        struct world w = world(AD_F32, seed, 1, true);
        set_block(seed);
        size_t out[MAX_OUT], n_out = draw_outputs(&w, out);
        ad_program *p = program_of(&w, n_out, out);
        set_inputs(p, &w, &w);
        ad_run(p);
        compare(p, &w, &w, n_out, out, 2e-3, seed);
        ad_program_free(p);
        world_release(&w);
    }
}

/* ---- gradients ---- */

/* A little of every input on top: a gradient that is zero to rounding cannot be checked. */
static ad_var objective(const struct world *w)
{
    size_t out[MAX_OUT], n_out = draw_outputs(w, out);
    ad_var y = ad_scalar(w->tape, 0);
    for (size_t k = 0; k < n_out; k++) {
        const struct matrix *m = &w->m[out[k]];
        y = ad_add(y, ad_div(weighted_sum(w->var[out[k]]), (double)(m->rows * m->cols)));
    }
    for (size_t k = 0; k < w->n_inputs; k++)
        y = ad_add(y, ad_mul(1e-3, ad_mean(ad_sin(w->var[k]))));
    return y;
}

static const double **points(const struct world *w, const double *at[MAX_INPUTS])
{
    for (size_t k = 0; k < w->n_inputs; k++)
        at[k] = w->m[k].v;
    return at;
}

static void test_gradients(void **state)
{
    (void)state;
    for (uint64_t seed = first(2000, 80), last = seed + 80; seed < last; seed++) {
        struct world w = world(AD_F64, seed, 1, true);
        set_block(seed);
        const double *at[MAX_INPUTS];
        char name[32];
        snprintf(name, sizeof name, "program %llu", (unsigned long long)seed);
        assert_gradient(name, objective(&w), w.n_inputs, w.var, points(&w, at), 1e-6, 4);
        world_release(&w);
    }
}

static void test_second_order(void **state)
{
    (void)state;
    for (uint64_t seed = first(3000, 40), last = seed + 40; seed < last; seed++) {
        struct world w = world(AD_F64, seed, 1, true);
        set_block(seed);
        const double *at[MAX_INPUTS];
        char name[32];
        snprintf(name, sizeof name, "program %llu", (unsigned long long)seed);
        assert_second(name, objective(&w), w.n_inputs, w.var, points(&w, at), 1e-5, 3);
        world_release(&w);
    }
}

/* What else a program gives out, and a second recording on the tape, does not change the gradient.
 */
static void test_gradient_beside_other_outputs(void **state)
{
    (void)state;
    for (uint64_t seed = first(4000, 33), last = seed + 33; seed < last; seed++) {
        struct world w = world(AD_F64, seed, 1, false);
        set_block(seed);
        ad_var y = objective(&w), g[MAX_INPUTS], again[MAX_INPUTS], all[MAX_NODES + 2 * MAX_INPUTS];
        assert_int_equal(ad_grad(y, w.n_inputs, w.var, g), AD_OK);
        assert_int_equal(ad_grad(y, w.n_inputs, w.var, again), AD_OK);
        memcpy(all, w.var, w.n * sizeof *all);
        memcpy(all + w.n, g, w.n_inputs * sizeof *g);
        memcpy(all + w.n + w.n_inputs, again, w.n_inputs * sizeof *g);
        ad_program *alone = compile(w.tape, w.n_inputs, g);
        ad_program *together = compile(w.tape, w.n + 2 * w.n_inputs, all);
        set_inputs(alone, &w, &w);
        set_inputs(together, &w, &w);
        ad_run(alone);
        ad_run(together);
        for (size_t k = 0; k < w.n_inputs; k++) {
            const double *a = ad_data(alone, g[k]), *b = ad_data(together, g[k]);
            const double *c = ad_data(together, again[k]);
            for (size_t i = 0; i < w.m[k].rows * w.m[k].cols; i++) {
                assert_close(b[i], a[i], 1e-11, 1e-13);
                assert_close(c[i], b[i], 0, 0);
            }
        }
        ad_program_free(alone);
        ad_program_free(together);
        world_release(&w);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values_f64),
        cmocka_unit_test(test_values_f32),
        cmocka_unit_test(test_gradients),
        cmocka_unit_test(test_second_order),
        cmocka_unit_test(test_gradient_beside_other_outputs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
