/* A failing allocation at every point of record, gradient, compile, run and check gives a status,
   never a crash or a leak. The linker redirects the library's allocations here. */
#include "autodiff/derivatives.h"
#include "autodiff/optim.h"
#include "support.h"
#include "tests/alloc.h"

/* ---- jobs: every kind of node, so that every array of the tape and the compiler grows ---- */

static ad_var pairs(ad_var q)
{
    static const uint32_t first[] = {0, 0, 1}, second[] = {1, 2, 2};
    ad_var d = ad_sub(ad_gather_rows(q, 3, first), ad_gather_rows(q, 3, second));
    return ad_scatter_rows(ad_recip(ad_add(ad_square(d), 0.1)), first, 3);
}

static ad_var record(ad_tape *tape, ad_var x[2])
{
    static const double numbers[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    x[0] = ad_input(tape, 3, 40, "coordinates of three bodies");
    x[1] = ad_input(tape, 3, 3, "weights");
    ad_var m = ad_matmul(ad_add(x[1], ad_const(tape, 3, 3, numbers)), false, x[0], false);
    ad_var v = ad_diff(ad_label(ad_tanh(m), "hidden"), 3, true);
    ad_var parts[] = {ad_row(v, 0), ad_transpose(ad_col(x[0], 1)), ad_row(x[0], 2)};
    ad_var placed = ad_place(tape, 4, 43, 3, parts, (size_t[]){0, 3, 1}, (size_t[]){1, 2, 3});
    ad_var both = ad_concat_rows(2, (ad_var[]){pairs(x[0]), v});
    return ad_add(ad_sum(ad_sin(both)), ad_mean(ad_square(placed)));
}

/* Status of the whole job; AD_E_MEMORY also for a NULL from a function that returns handles. */
static enum ad_status record_grad_compile_run(void)
{
    double at[120], weights[9] = {0.1, 0.2, 0.3}, result[120];
    for (int i = 0; i < 120; i++)
        at[i] = 0.01 * i;
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!tape)
        return AD_E_MEMORY;
    ad_var x[2], g[2], y = record(tape, x);
    ad_program *p = NULL;
    enum ad_status status = ad_grad(y, 2, x, g);
    if (status == AD_OK)
        status = ad_compile(tape, 3, (ad_var[]){y, g[0], g[1]}, &p);
    if (status == AD_OK) {
        ad_set(p, x[0], at);
        ad_set(p, x[1], weights);
        ad_run(p);
        ad_get(p, g[0], result);
        if (!isfinite(result[7]))
            status = AD_E_NONFINITE;
    } else if (p || ad_tape_error(tape)->status != status || !*ad_tape_error(tape)->message) {
        status = AD_E_ARGUMENT;
    }
    ad_program_free(p);
    ad_tape_free(tape);
    return status;
}

static enum ad_status check(void)
{
    double at[120], weights[9] = {0.1, 0.2, 0.3};
    for (int i = 0; i < 120; i++)
        at[i] = 0.01 * i;
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!tape)
        return AD_E_MEMORY;
    ad_var x[2], y = record(tape, x);
    struct ad_check report;
    enum ad_status status =
        ad_check_second(y, 2, x, (const double *const[]){at, weights}, 1e-5, 2, &report);
    if (status == AD_OK && !report.passed)
        status = AD_E_NONFINITE;
    ad_tape_free(tape);
    return status;
}

/* Enough nodes, constants, labels, lists and parts for every array to grow more than once. */
static enum ad_status grow(void)
{
    ad_tape *tape = ad_tape_new(AD_F32);
    if (!tape)
        return AD_E_MEMORY;
    ad_var x = ad_input(tape, 5, 8, "x"), y = ad_scalar(tape, 0), g;
    for (uint32_t k = 0; k < 600; k++) {
        const uint32_t rows[] = {k % 5, k * k % 5};
        ad_var two = ad_label(ad_gather_rows(ad_mul(x, 1.0 + k), 2, rows), "two of five");
        y = ad_add(y, ad_sum(ad_mul(ad_row(x, k % 5), two)));
    }
    ad_program *p = NULL;
    enum ad_status status = ad_grad(y, 1, &x, &g);
    if (status == AD_OK)
        status = ad_compile(tape, 1, &g, &p);
    ad_program_free(p);
    ad_tape_free(tape);
    return status;
}

/* The pattern of a sparse matrix, its colours and its program. */
static enum ad_status sparse_hessian(void)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!tape)
        return AD_E_MEMORY;
    ad_jacobian *H = NULL;
    ad_var x = ad_input(tape, 2, 4, "x");
    enum ad_status status =
        ad_hessian_new(ad_sum(ad_mul(ad_sin(ad_row(x, 0)), ad_row(x, 1))), 1, &x, &H);
    ad_jacobian_free(H);
    ad_tape_free(tape);
    return status;
}

static enum ad_status optimise(void)
{
    struct ad_optimiser_settings settings = ad_optimiser_defaults(AD_ADAM);
    float x[10] = {0}, g[10] = {1, 2, 3};
    ad_optimiser *o = ad_optimiser_new(&settings, AD_F32, 10, NULL);
    if (!o)
        return AD_E_MEMORY;
    ad_optimiser_step(o, x, g);
    ad_optimiser_free(o);
    return AD_OK;
}

/* ---- every call fails once, alone or with all after it ---- */

static void run(enum ad_status (*job)(void), size_t fail, bool after, enum ad_status *status)
{
    alloc = (struct alloc){.failing = fail, .all_after = after};
    *status = job();
    alloc.failing = 0;
}

/* A job survives a failure only where it can do without (shrinking an array). */
static void fail_everywhere(enum ad_status (*job)(void), size_t step)
{
    enum ad_status status;
    run(job, 0, false, &status);
    assert_int_equal(status, AD_OK);
    assert_int_equal(alloc.given, alloc.taken);
    size_t total = alloc.calls, survived = 0;
    assert_true(total > 0);
    for (int after = 0; after < 2; after++)
        for (size_t k = 1; k <= total; k += step) {
            run(job, k, after, &status);
            size_t leaked = alloc.given - alloc.taken;
            if (leaked)
                fail_msg("call %zu of %zu failing leaks %zu blocks", k, total, leaked);
            if (status == AD_OK)
                survived++;
            else
                assert_int_equal(status, AD_E_MEMORY);
        }
    assert_true(survived <= 16);
}

static void test_record_grad_compile_run(void **state)
{
    (void)state;
    fail_everywhere(record_grad_compile_run, 1);
}

static void test_check(void **state)
{
    (void)state;
    fail_everywhere(check, 1);
}

static void test_growing(void **state)
{
    (void)state;
    fail_everywhere(grow, 7);
}

static void test_sparse_hessian(void **state)
{
    (void)state;
    fail_everywhere(sparse_hessian, 1);
}

static void test_optimiser(void **state)
{
    (void)state;
    fail_everywhere(optimise, 1);
}

/* A step and a run allocate nothing. */
static void test_running_allocates_nothing(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[2], g[2], y = record(tape, x);
    assert_int_equal(ad_grad(y, 2, x, g), AD_OK);
    ad_program *p = compile(tape, 2, g);
    struct ad_optimiser_settings settings = ad_optimiser_defaults(AD_ADAM);
    ad_optimiser *o = ad_optimiser_new(&settings, AD_F64, 120, NULL);
    ad_run(p);
    alloc.calls = 0;
    for (int k = 0; k < 10; k++) {
        ad_run(p);
        ad_optimiser_step(o, ad_data(p, x[0]), ad_data(p, g[0]));
    }
    assert_int_equal(alloc.calls, 0);
    ad_optimiser_free(o);
    ad_program_free(p);
    ad_tape_free(tape);
}

/* More threads than memory: goes on with those it has. */
static void test_threads_without_memory(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[2], y = record(tape, x);
    ad_program *p = compile(tape, 1, &y);
    double before, after;
    ad_run(p);
    ad_get(p, y, &before);
    alloc.calls = 0;
    alloc.failing = 1;
    ad_set_threads(p, 3);
    alloc.failing = 0;
    ad_run(p);
    ad_get(p, y, &after);
    assert_true(before == after);
    ad_program_free(p);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_record_grad_compile_run),
        cmocka_unit_test(test_check),
        cmocka_unit_test(test_growing),
        cmocka_unit_test(test_sparse_hessian),
        cmocka_unit_test(test_optimiser),
        cmocka_unit_test(test_running_allocates_nothing),
        cmocka_unit_test(test_threads_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
