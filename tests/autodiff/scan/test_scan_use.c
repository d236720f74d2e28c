/* Loops as parts of programs: held inputs, several gradients, constants, views and shared operands,
   one variable in two roles, custom operations, no steps, and the program's size. */
#include "autodiff/derivatives.h"
#include "scan_cases.h"

#include <stdlib.h>
#include <string.h>

/* ---- runs ---- */

/* What an earlier way back used up, or an earlier run computed, is not what a later one reads. */
static void test_runs_again(void **state)
{
    (void)state;
    struct scan_made m = scan_make(scan_case_named("layer"), AD_F64, 9, 2, false);
    ad_var factor = ad_input(m.tape, 1, 1, "factor"), g[5], h[5], both[10];
    for (size_t k = 0; k < m.n; k++)
        ad_hold(m.x[k]);
    ad_grad(ad_mul(factor, m.y), m.n, m.x, g);
    ad_grad(ad_sum(ad_square(m.out[0])), m.n, m.x, h); /* another way back through the same loop */
    memcpy(both, g, m.n * sizeof *g);
    memcpy(both + m.n, h, m.n * sizeof *h);
    ad_program *p = compile(m.tape, 2 * m.n, both), *q = compile(m.tape, 2 * m.n, both);
    for (int turn = 0; turn < 3; turn++) {
        if (turn < 2)
            scan_set_all(p, &m, 3 + (uint64_t)turn);
        scan_set_all(q, &m, turn ? 4 : 3);
        ad_run(p);
        for (int again = 0; again < 3; again++) {
            const double by = 0.5 + again + 2 * turn;
            ad_set(p, factor, &by);
            ad_set(q, factor, &by);
            assert_int_equal(ad_rerun(p), AD_OK);
            ad_program *fresh = compile(m.tape, 2 * m.n, both);
            scan_set_all(fresh, &m, turn ? 4 : 3);
            ad_set(fresh, factor, &by);
            ad_run(fresh);
            ad_run(q);
            for (size_t k = 0; k < 2 * m.n; k++) {
                const size_t bytes = size_of(both[k]) * sizeof(double);
                assert_memory_equal(ad_data(p, both[k]), ad_data(fresh, both[k]), bytes);
                assert_memory_equal(ad_data(q, both[k]), ad_data(fresh, both[k]), bytes);
            }
            ad_program_free(fresh);
        }
    }
    ad_program_free(p);
    ad_program_free(q);
    ad_tape_free(m.tape);
}

/* A loop of constants is computed when compiling, and the way back each time. */
static void test_constants(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), w = ad_input(body, 1, 1, "w"), y, g[2];
    ad_var next = ad_mul(w, ad_sin(s));
    const struct ad_body of = {.size = sizeof of,
                               .tape = body,
                               .n_state = 1,
                               .state = &s,
                               .next = &next,
                               .n_shared = 1,
                               .shared = &w,
                               .checkpoints = 2};
    ad_var x[] = {ad_scalar(tape, 0.7), ad_scalar(tape, 1.2)}, a = ad_input(tape, 1, 1, "a");
    ad_scan(tape, &of, 5, &x[0], NULL, &x[1], &y, NULL);
    ad_grad(ad_mul(a, y), 2, x, g);
    ad_program *p = compile(tape, 3, (ad_var[]){y, g[0], g[1]});
    double q = 0.7, d[2] = {1, 0}, value;
    for (int t = 0; t < 5; t++) {
        d[0] *= 1.2 * cos(q);
        d[1] = d[1] * 1.2 * cos(q) + sin(q);
        q = 1.2 * sin(q);
    }
    for (int run = 1; run < 4; run++) {
        ad_set(p, a, &(double){run});
        ad_run(p);
        for (int k = 0; k < 2; k++) {
            ad_get(p, g[k], &value);
            assert_close(value, run * d[k], 1e-14, 0);
        }
    }
    ad_get(p, y, &value);
    assert_close(value, q, 1e-15, 0);
    ad_program_free(p);
    ad_tape_free(tape);
    ad_tape_free(body);
}

/* ---- operands ---- */

static ad_var transposed(ad_var x) { return ad_transpose(x); }

/* Operands that are views, rows apart, numbers, and one variable in several roles. */
static void test_operands(void **state)
{
    (void)state;
    enum { STEPS = 4 };
    static const uint32_t rows[] = {4, 0, 2};
    ad_program *p[2];
    ad_var out[2][4];
    for (int u = 0; u < 2; u++) {
        const struct scan_case *c = scan_case_named("layer");
        ad_tape *tape = ad_tape_new(AD_F64), *body = ad_tape_new(AD_F64);
        ad_var a = ad_input(tape, 5, 2 * STEPS, "a"), b = ad_input(tape, 1, 9, "b"), last, y = {0};
        ad_var start = ad_slice_cols(ad_slice_rows(a, 1, 3), 2, 2);
        ad_var in = ad_gather_rows(a, 3, rows);
        ad_var w[] = {transposed(ad_reshape(b, 3, 3)), ad_slice_cols(b, 4, 1)};
        if (u) {
            ad_var s = start, x, o, parts[STEPS], all[2] = {w[0], ad_broadcast(w[1], 3, 1)};
            for (size_t t = 0; t < STEPS; t++) {
                x = ad_slice_cols(in, 2 * t, 2);
                c->step(&s, &x, all, &last, &o);
                s = last;
                parts[t] = o;
            }
            y = ad_concat_cols(STEPS, parts);
        } else {
            struct scan_vars v;
            struct ad_body of = scan_body(c, body, &v);
            of.checkpoints = 3;
            ad_scan(tape, &of, STEPS, &start, &in, w, &last, &y);
        }
        ad_var total = ad_add(weighted_sum(y), weighted_sum(last)), x[] = {a, b};
        ad_grad(total, 2, x, out[u]);
        ad_grad(ad_add(weighted_sum(out[u][0]), weighted_sum(out[u][1])), 2, x, out[u] + 2);
        p[u] = compile(tape, 4, out[u]);
        uint64_t seed = 11;
        for (int k = 0; k < 2; k++) {
            double *at = random_values(&seed, size_of(x[k]), -1, 1);
            ad_set(p[u], x[k], at);
            free(at);
        }
        ad_run(p[u]);
        if (u)
            for (int k = 0; k < 4; k++)
                scan_assert_like(p[0], out[0][k], p[1], out[1][k]);
        ad_tape_free(body);
        if (u)
            ad_tape_free(tape);
        else
            *state = tape;
    }
    ad_tape_free(*state);
    ad_program_free(p[0]);
    ad_program_free(p[1]);
}

static void test_no_steps(void **state)
{
    (void)state;
    struct scan_vars v;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    struct ad_body of = scan_body(scan_case_named("logistic"), body, &v);
    ad_var x[] = {ad_input(tape, 1, 1, "x"), ad_input(tape, 1, 1, "r")}, last, g[2];
    ad_scan(tape, &of, 0, &x[0], NULL, &x[1], &last, NULL);
    ad_grad(last, 2, x, g);
    ad_program *p = compile(tape, 3, (ad_var[]){last, g[0], g[1]});
    ad_set(p, x[0], &(double){0.3});
    ad_run(p);
    assert_true(*(double *)ad_data(p, last) == 0.3 && *(double *)ad_data(p, g[0]) == 1 &&
                *(double *)ad_data(p, g[1]) == 0);
    ad_program_free(p);
    ad_tape_free(tape);
    ad_tape_free(body);
}

/* The tape's program does not grow with the steps; nor does memory by more than what it is given.
 */
static void test_size(void **state)
{
    (void)state;
    size_t bytes[2], values[2];
    for (int k = 0; k < 2; k++) {
        struct scan_made m =
            scan_make(scan_case_named("pendulum"), AD_F64, k ? 700000 : 2, 0, false);
        ad_var g[3];
        ad_grad(ad_sum(m.last[0]), 3, m.x, g);
        ad_program *p = compile(m.tape, 3, g);
        bytes[k] = ad_program_info(p).bytes;
        values[k] = ad_program_info(p).value_bytes;
        ad_program_free(p);
        ad_tape_free(m.tape);
    }
    assert_int_equal(bytes[0], bytes[1]);
    /* energies of three columns and their seeds, an eighth more by classes of size, and states up
       to the default memory */
    assert_true(values[1] - values[0] <= 9 * 3 * 700000 * sizeof(double) / 4 + ((size_t)32 << 20));
}

static int scaled_value(void *user, size_t cols, const double *const x[], double *y)
{
    for (size_t i = 0; i < cols; i++)
        y[i] = *(double *)user * x[0][i];
    return 0;
}

static int scaled_adjoint(void *user, size_t cols, const double *const x[], const double *y,
                          const double *g, double *const gx[])
{
    (void)x, (void)y;
    for (size_t i = 0; i < cols; i++)
        gx[0][i] = *(double *)user * g[i];
    return 0;
}

/* What a custom operation of the body points to may change, though all operands stay. */
static void test_custom_in_the_body(void **state)
{
    (void)state;
    for (int held = 0; held < 2; held++) {
        double factor = 2, value;
        struct ad_custom custom = {
            .size = sizeof custom, "scaled", 1, scaled_value, scaled_adjoint, NULL, &factor};
        ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
        ad_var s = ad_input(body, 1, 1, "s"), next = ad_custom(1, &s, &custom), last;
        struct ad_body b = {
            .size = sizeof b, .tape = body, .n_state = 1, .state = &s, .next = &next};
        ad_var x = held ? ad_hold(ad_input(tape, 1, 1, "x")) : ad_scalar(tape, 1);
        ad_program *p;
        assert_int_equal(ad_scan(tape, &b, 3, &x, NULL, NULL, &last, NULL), AD_OK);
        assert_int_equal(ad_compile(tape, 1, &last, &p), AD_OK);
        if (held)
            ad_set(p, x, (double[]){1});
        ad_run(p);
        factor = 3;
        if (held)
            assert_int_equal(ad_rerun(p), AD_OK);
        else
            ad_run(p);
        ad_get(p, last, &value);
        assert_close(value, 27, 0, 0);
        ad_program_free(p);
        ad_tape_free(tape);
        ad_tape_free(body);
    }
}

/* Results may take the place of operands. */
static void test_results_in_place(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), h = ad_input(body, 1, 1, "h"), next = ad_mul(s, h);
    struct ad_body b = {.size = sizeof b,
                        .tape = body,
                        .n_state = 1,
                        .state = &s,
                        .next = &next,
                        .n_shared = 1,
                        .shared = &h};
    ad_var x = ad_input(tape, 1, 1, "x"), g = ad_input(tape, 1, 1, "g"), y[3] = {x, x, x};
    ad_var direction = ad_scalar(tape, 1);
    const double at[] = {2, 3}, *values[] = {&at[0], &at[1]};
    const double expected[] = {54, 4, 12};
    assert_int_equal(ad_scan(tape, &b, 3, &y[0], NULL, &g, &y[0], NULL), AD_OK);
    assert_int_equal(ad_grad(ad_square(x), 1, &y[1], &y[1]), AD_OK);
    y[2] = direction;
    assert_int_equal(ad_jvp(ad_cube(x), 1, &x, &y[2], &y[2]), AD_OK);
    for (size_t k = 0; k < 3; k++) {
        double value;
        assert_int_equal(ad_evaluate(2, (ad_var[]){x, g}, values, y[k], &value, NULL), AD_OK);
        assert_close(value, expected[k], 0, 0);
    }
    ad_tape_free(tape);
    ad_tape_free(body);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_runs_again),
        cmocka_unit_test(test_constants),
        cmocka_unit_test(test_operands),
        cmocka_unit_test(test_no_steps),
        cmocka_unit_test(test_custom_in_the_body),
        cmocka_unit_test(test_results_in_place),
        cmocka_unit_test(test_size),
    };
    return cmocka_run_group_tests_name("scan in use", tests, NULL, NULL);
}
