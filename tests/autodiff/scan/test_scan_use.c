/* Loops as parts of programs: held inputs, several gradients, views and shared operands, one
   variable in two roles, directions, Jacobians, direct evaluation; infinities where nothing is
   used; what is refused, and errors that name the step. */
#include "autodiff/derivatives.h"
#include "scan_cases.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct scan_case *layer(void) { return scan_case_named("layer"); }

static size_t size_of(ad_var x) { return ad_rows(x) * ad_cols(x); }

/* Sets all operands to values of this seed. */
static void set_all(ad_program *p, const struct scan_made *m, uint64_t seed)
{
    for (size_t k = 0; k < m->n; k++) {
        double *at = random_values(&seed, size_of(m->x[k]), 0.2, 0.9);
        assert_int_equal(ad_set(p, m->x[k], at), AD_OK);
        free(at);
    }
}

/* Values of x in both programs, which are of like recordings. */
static void assert_like(ad_program *p, ad_var x, ad_program *q, ad_var y)
{
    const double *a = ad_data(p, x), *b = ad_data(q, y);
    for (size_t i = 0; i < size_of(x); i++)
        assert_close(a[i], b[i], 1e-12, 1e-12);
}

/* ---- runs ---- */

/* What an earlier way back used up, or an earlier run computed, is not what a later one reads. */
static void test_runs_again(void **state)
{
    (void)state;
    struct scan_made m = scan_make(layer(), AD_F64, 9, 2, false);
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
            set_all(p, &m, 3 + (uint64_t)turn);
        set_all(q, &m, turn ? 4 : 3);
        ad_run(p);
        for (int again = 0; again < 3; again++) {
            const double by = 0.5 + again + 2 * turn;
            ad_set(p, factor, &by);
            ad_set(q, factor, &by);
            assert_int_equal(ad_rerun(p), AD_OK);
            ad_program *fresh = compile(m.tape, 2 * m.n, both);
            set_all(fresh, &m, turn ? 4 : 3);
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

/* Gradients by one operand alone, and of these by another. */
static void test_some_operands(void **state)
{
    (void)state;
    for (size_t i = 0; i < n_scan_cases; i++) {
        struct scan_made m[2];
        ad_program *p[2];
        ad_var out[2][64];
        size_t n = 0;
        for (int u = 0; u < 2; u++) {
            m[u] = scan_make(&scan_cases[i], AD_F64, 4, 2, u);
            n = 0;
            for (size_t k = 0; k < m[u].n; k++)
                for (size_t j = 0; j < m[u].n; j++) {
                    ad_var g;
                    ad_grad(m[u].y, 1, &m[u].x[k], &g);
                    ad_grad(weighted_sum(g), 1, &m[u].x[j], &out[u][n++]);
                }
            p[u] = compile(m[u].tape, n, out[u]);
            set_all(p[u], &m[u], 5);
            ad_run(p[u]);
        }
        for (size_t k = 0; k < n; k++)
            assert_like(p[0], out[0][k], p[1], out[1][k]);
        for (int u = 0; u < 2; u++) {
            ad_program_free(p[u]);
            ad_tape_free(m[u].tape);
        }
    }
}

/* A loop of constants is computed when compiling, and the way back each time. */
static void test_constants(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), w = ad_input(body, 1, 1, "w"), y, g[2];
    ad_var next = ad_mul(w, ad_sin(s));
    const struct ad_body of = {.tape = body,
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
        const struct scan_case *c = layer();
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
                assert_like(p[0], out[0][k], p[1], out[1][k]);
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

/* ---- directions, Jacobians, direct evaluation ---- */

/* <u, J v> = <J^T u, v>, and the same of the gradient: forward over reverse. */
static void test_directions(void **state)
{
    (void)state;
    for (size_t i = 0; i < n_scan_cases; i++) {
        struct scan_made m = scan_make(&scan_cases[i], AD_F64, 5, 2, false);
        ad_var of[2] = {scan_cases[i].n_state ? m.last[0] : m.out[0], {0}}, g[12];
        ad_grad(m.y, m.n, m.x, g);
        of[1] = g[m.n - 1];
        ad_var v[12], sides[4];
        for (size_t k = 0; k < m.n; k++)
            v[k] = ad_input(m.tape, ad_rows(m.x[k]), ad_cols(m.x[k]), "v");
        for (int k = 0; k < 2; k++) {
            ad_var u = ad_input(m.tape, ad_rows(of[k]), ad_cols(of[k]), "u"), forward, back[12];
            ad_jvp(of[k], m.n, m.x, v, &forward);
            ad_vjp(of[k], u, m.n, m.x, back);
            sides[2 * k] = ad_dot(u, forward);
            sides[2 * k + 1] = ad_scalar(m.tape, 0);
            for (size_t j = 0; j < m.n; j++)
                sides[2 * k + 1] = ad_add(sides[2 * k + 1], ad_dot(back[j], v[j]));
            m.x[m.n + (size_t)k] = u;
        }
        assert_tape_ok(m.tape);
        ad_program *p = compile(m.tape, 4, sides);
        set_all(p, &m, 17);
        uint64_t seed = 23;
        for (size_t k = 0; k < m.n + 2; k++) {
            ad_var x = k < m.n ? v[k] : m.x[k];
            double *at = random_values(&seed, size_of(x), -1, 1);
            ad_set(p, x, at);
            free(at);
        }
        ad_run(p);
        for (int k = 0; k < 2; k++) {
            const double *a = ad_data(p, sides[2 * k]), *b = ad_data(p, sides[2 * k + 1]);
            assert_close(*a, *b, 1e-12, 1e-13);
        }
        ad_program_free(p);
        ad_tape_free(m.tape);
    }
}

static void test_jacobian(void **state)
{
    (void)state;
    double *dense[2][2];
    size_t size = 0;
    for (int u = 0; u < 2; u++) {
        struct scan_made m = scan_make(layer(), AD_F64, 3, 2, u);
        ad_jacobian *J, *H;
        assert_int_equal(ad_jacobian_new(m.out[0], m.n, m.x, &J), AD_OK);
        assert_int_equal(ad_hessian_new(m.y, m.n, m.x, &H), AD_OK);
        for (int k = 0; k < 2; k++) {
            ad_jacobian *of = k ? H : J;
            const struct ad_sparse *a = ad_jacobian_matrix(of);
            set_all(ad_jacobian_program(of), &m, 29);
            ad_jacobian_run(of);
            dense[u][k] = malloc(a->rows * a->cols * sizeof(double));
            ad_jacobian_dense(of, dense[u][k]);
            size = a->rows * a->cols;
            for (size_t i = 0; u && i < size; i++)
                assert_close(dense[0][k][i], dense[1][k][i], 1e-12, 1e-13);
        }
        ad_jacobian_free(J);
        ad_jacobian_free(H);
        ad_tape_free(m.tape);
    }
    for (int k = 0; k < 4; k++)
        free(dense[k / 2][k % 2]);
}

static void test_direct(void **state)
{
    (void)state;
    for (size_t i = 0; i < n_scan_cases; i++)
        for (int type = AD_F32; type <= AD_F64; type++) {
            struct scan_made m = scan_make(&scan_cases[i], (enum ad_type)type, 5, 2, false);
            ad_var g[12], h[12], y;
            double *at[12], *slope[12], value, expected;
            ad_grad(m.y, m.n, m.x, g);
            y = weighted_sum(g[0]);
            for (size_t k = 1; k < m.n; k++)
                y = ad_add(y, weighted_sum(g[k]));
            ad_grad(y, m.n, m.x, h);
            ad_program *p = compile(m.tape, m.n + 1, (ad_var[]){y, h[0], h[1], h[2], h[3], h[4]});
            uint64_t seed = 31;
            for (size_t k = 0; k < m.n; k++) {
                at[k] = random_values(&seed, size_of(m.x[k]), 0.2, 0.9);
                slope[k] = malloc(size_of(m.x[k]) * sizeof(double));
                ad_set(p, m.x[k], at[k]);
            }
            ad_run(p);
            const double tolerance = type == AD_F32 ? 1e-4 : 1e-12;
            for (int turn = 0; turn < 2; turn++) {
                struct ad_error error = {0};
                assert_int_equal(
                    ad_gradient(m.n, m.x, (const double *const *)at, y, &value, slope, &error),
                    AD_OK);
                ad_get(p, y, &expected);
                assert_close(value, expected, tolerance, tolerance);
                for (size_t k = 0; k < m.n; k++) {
                    double *b = malloc(size_of(m.x[k]) * sizeof *b);
                    ad_get(p, h[k], b);
                    for (size_t j = 0; j < size_of(m.x[k]); j++)
                        assert_close(slope[k][j], b[j], 10 * tolerance, 10 * tolerance);
                    free(b);
                }
            }
            for (size_t k = 0; k < m.n; k++) {
                free(at[k]);
                free(slope[k]);
            }
            ad_program_free(p);
            ad_tape_free(m.tape);
        }
}

/* ---- edges ---- */

/* A countdown from 3 and its logarithm: infinite in the last step, which nothing reads. */
static void test_infinite_where_unused(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), next = ad_sub(s, 1.0), log = ad_log(s);
    const struct ad_body of = {
        .tape = body, .n_state = 1, .state = &s, .next = &next, .n_out = 1, .out = &log};
    ad_var x = ad_input(tape, 1, 1, "x"), last, y, g[4];
    ad_scan(tape, &of, 4, &x, NULL, NULL, &last, &y);
    ad_var used = ad_sum(ad_slice_cols(y, 0, 3));
    ad_grad(used, 1, &x, &g[0]);
    ad_grad(g[0], 1, &x, &g[1]);
    ad_grad(ad_add(used, ad_square(last)), 1, &x, &g[2]); /* every step has an adjoint */
    ad_grad(g[2], 1, &x, &g[3]);
    ad_program *p = compile(tape, 4, g);
    ad_set(p, x, &(double){3});
    ad_run(p);
    const double expected[] = {1 + 1 / 2. + 1 / 3., -1 - 1 / 4. - 1 / 9., 1 + 1 / 2. + 1 / 3. - 2,
                               2 - 1 - 1 / 4. - 1 / 9.};
    for (int k = 0; k < 4; k++)
        assert_close(*(double *)ad_data(p, g[k]), expected[k], 1e-14, 0);
    ad_program_free(p);
    ad_tape_free(tape);
    ad_tape_free(body);
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

/* ---- errors ---- */

static void test_errors_name_the_step(void **state)
{
    (void)state;
    enum { STEPS = 5 };
    struct scan_made m = scan_make(scan_case_named("systems"), AD_F64, STEPS, 2, false);
    ad_program *p = compile(m.tape, 1, &m.y);
    double in[4 * 3 * STEPS] = {0}, value;
    const double start[] = {1, 2, 3, 4, 5, 6}, w[] = {2, 1, 1, 2};
    const double *at[] = {start, in, w};
    for (int row = 0; row < 4; row++) /* step 3, column 1: w + 0.1 in is singular */
        in[row * 3 * STEPS + 3 * 3 + 1] = row == 0 || row == 3 ? -10 : 0;
    for (int k = 0; k < 3; k++)
        ad_set(p, m.x[k], at[k]);
    ad_run(p);
    const char *message = ad_program_error(p)->message;
    assert_int_equal(ad_program_error(p)->status, AD_E_NONFINITE);
    assert_non_null(strstr(message, "step 3"));
    assert_non_null(strstr(message, "column 1"));
    struct ad_error error = {0};
    assert_int_equal(ad_evaluate(3, m.x, at, m.y, &value, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "step 3"));
    memset(in, 0, sizeof in);
    ad_set(p, m.x[1], in);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
    ad_program_free(p);
    ad_tape_free(m.tape);
}

static void test_checked(void **state)
{
    (void)state;
    struct scan_made m = scan_make(scan_case_named("map"), AD_F64, 6, 0, false);
    ad_program *p = compile(m.tape, 1, &m.y);
    set_all(p, &m, 3);
    struct ad_error error = {0};
    assert_int_equal(ad_run_checked(p, &error), AD_OK);
    double *x = ad_data(p, m.x[0]);
    x[18 + 3 * 4 + 2] = 1e6; /* row 1 of step 4 */
    assert_int_equal(ad_run_checked(p, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "step 4"));
    assert_non_null(strstr(error.message, "exp"));
    assert_non_null(strstr(error.message, "row 1, column 2"));
    ad_program_free(p);
    ad_tape_free(m.tape);
}

static void refused(const struct ad_body *of, enum ad_type type, size_t steps, size_t cols,
                    enum ad_status status)
{
    ad_tape *tape = ad_tape_new(type);
    ad_var s = ad_input(tape, 3, 2, "s"), in = ad_input(tape, 3, cols, "in"), last, out;
    ad_var w[] = {ad_input(tape, 3, 3, "w"), ad_input(tape, 3, 1, "b")};
    assert_int_equal(ad_scan(tape, of, steps, &s, &in, w, &last, &out), status);
    assert_int_equal(ad_tape_error(tape)->status, status);
    if (status != AD_OK)
        assert_non_null(strstr(ad_tape_error(tape)->message, "scan"));
    ad_tape_free(tape);
}

static void test_refusals(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    struct scan_vars v;
    const struct ad_body of = scan_body(layer(), body, &v);
    struct ad_body wrong = of;
    ad_var foreign = ad_input(other, 3, 2, "x"), constant = ad_scalar(body, 1),
           narrow = ad_col(v.state[0], 0);
    refused(&of, AD_F64, 4, 8, AD_OK);
    refused(&of, AD_F64, 4, 9, AD_E_SHAPE);
    refused(&of, AD_F64, 0, 8, AD_E_ARGUMENT);
    refused(&of, AD_F64, (size_t)1 << 40, 8, AD_E_ARGUMENT);
    refused(&of, AD_F32, 4, 8, AD_E_ARGUMENT);
    refused(NULL, AD_F64, 4, 8, AD_E_ARGUMENT);
    wrong.state = &foreign;
    refused(&wrong, AD_F64, 4, 8, AD_E_TAPE);
    wrong.state = &constant;
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT);
    wrong.state = v.in; /* twice */
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT);
    wrong = of;
    wrong.next = &narrow;
    refused(&wrong, AD_F64, 4, 8, AD_E_SHAPE);
    wrong = of;
    wrong.n_shared = 1; /* an input nobody sets */
    refused(&wrong, AD_F64, 4, 8, AD_E_ARGUMENT);
    wrong = of;
    wrong.next = NULL;
    refused(&wrong, AD_F64, 4, 8, AD_E_TAPE);
    ad_matmul(foreign, false, foreign, false);
    wrong.tape = other;
    refused(&wrong, AD_F64, 4, 8, AD_E_SHAPE); /* the error of the body */
    assert_int_equal(ad_scan(NULL, &of, 1, NULL, NULL, NULL, NULL, NULL), AD_E_TAPE);
    ad_tape_free(body);
    ad_tape_free(other);
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
        struct ad_custom custom = {"scaled", 1, scaled_value, scaled_adjoint, NULL, &factor};
        ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
        ad_var s = ad_input(body, 1, 1, "s"), next = ad_custom(1, &s, &custom), last;
        struct ad_body b = {.tape = body, .n_state = 1, .state = &s, .next = &next};
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
    struct ad_body b = {
        .tape = body, .n_state = 1, .state = &s, .next = &next, .n_shared = 1, .shared = &h};
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
        cmocka_unit_test(test_some_operands),
        cmocka_unit_test(test_constants),
        cmocka_unit_test(test_operands),
        cmocka_unit_test(test_directions),
        cmocka_unit_test(test_jacobian),
        cmocka_unit_test(test_direct),
        cmocka_unit_test(test_infinite_where_unused),
        cmocka_unit_test(test_no_steps),
        cmocka_unit_test(test_custom_in_the_body),
        cmocka_unit_test(test_results_in_place),
        cmocka_unit_test(test_size),
        cmocka_unit_test(test_errors_name_the_step),
        cmocka_unit_test(test_checked),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests_name("scan in use", tests, NULL, NULL);
}
