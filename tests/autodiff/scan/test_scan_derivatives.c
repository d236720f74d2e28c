/* Derivatives of loops by some operands, in directions, as matrices and evaluated directly; and
   where a value that nothing reads is infinite. */
#include "autodiff/derivatives.h"
#include "scan_cases.h"

#include <stdlib.h>

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
            scan_set_all(p[u], &m[u], 5);
            ad_run(p[u]);
        }
        for (size_t k = 0; k < n; k++)
            scan_assert_like(p[0], out[0][k], p[1], out[1][k]);
        for (int u = 0; u < 2; u++) {
            ad_program_free(p[u]);
            ad_tape_free(m[u].tape);
        }
    }
}

/* Along the seed of a gradient alone it is linear. */
static void test_seed(void **state)
{
    (void)state;
    for (size_t i = 0; i < n_scan_cases; i++) {
        struct scan_made m = scan_make(&scan_cases[i], AD_F64, 5, 2, false);
        ad_var c = ad_input(m.tape, 1, 1, "c"), one = ad_scalar(m.tape, 1), g[12], along, size[2];
        ad_grad(ad_mul(c, m.y), m.n, m.x, g);
        assert_int_equal(ad_jvp(g[m.n - 1], 1, &c, &one, &along), AD_OK);
        size[0] = ad_sum(ad_square(g[m.n - 1]));
        size[1] = ad_sum(ad_square(ad_sub(ad_mul(c, along), g[m.n - 1])));
        ad_program *p = compile(m.tape, 2, size);
        scan_set_all(p, &m, 17);
        ad_set(p, c, (const double[]){1.7});
        ad_run(p);
        const double *all = ad_data(p, size[0]), *apart = ad_data(p, size[1]);
        assert_true(*all > 0 && *apart < 1e-26 * *all);
        ad_program_free(p);
        ad_tape_free(m.tape);
    }
}

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
        scan_set_all(p, &m, 17);
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
        struct scan_made m = scan_make(scan_case_named("layer"), AD_F64, 3, 2, u);
        ad_jacobian *J, *H;
        assert_int_equal(ad_jacobian_new(m.out[0], m.n, m.x, &J), AD_OK);
        assert_int_equal(ad_hessian_new(m.y, m.n, m.x, &H), AD_OK);
        for (int k = 0; k < 2; k++) {
            ad_jacobian *of = k ? H : J;
            const struct ad_sparse *a = ad_jacobian_matrix(of);
            scan_set_all(ad_jacobian_program(of), &m, 29);
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

/* A countdown from 3 and its logarithm: infinite in the last step, which nothing reads. */
static void test_infinite_where_unused(void **state)
{
    (void)state;
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var s = ad_input(body, 1, 1, "s"), next = ad_sub(s, 1.0), log = ad_log(s);
    const struct ad_body of = {.size = sizeof of,
                               .tape = body,
                               .n_state = 1,
                               .state = &s,
                               .next = &next,
                               .n_out = 1,
                               .out = &log};
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_some_operands), cmocka_unit_test(test_directions),
        cmocka_unit_test(test_seed),          cmocka_unit_test(test_jacobian),
        cmocka_unit_test(test_direct),        cmocka_unit_test(test_infinite_where_unused),
    };
    return cmocka_run_group_tests_name("scan derivatives", tests, NULL, NULL);
}
