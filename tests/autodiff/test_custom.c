/* Operations of one's own: against the same recorded, every way they are run; faults of callbacks
   are in test_custom_faults. Values, gradients and adjoint identities of them are also in
   test_structure, by custom_cases.c. */
#include "autodiff/derivatives.h"
#include "ring.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 4, COLS = 1000 };

/* The ring as ordinary operations. */
static ad_var plain_ring(ad_var x)
{
    uint32_t next[ROWS];
    for (uint32_t i = 0; i < ROWS; i++)
        next[i] = (i + 1) % ROWS;
    return ad_tanh(ad_add(x, ad_mul(0.5, ad_gather_rows(x, ROWS, next))));
}

/* Its derivatives are recorded ones, of first order, too. */
static ad_var recorded_ring(ad_var x)
{
    struct ad_custom operation = ring_operation(ROWS);
    operation.adjoint = NULL;
    return ad_custom(1, &x, &operation);
}

/* ---- the same every way ---- */

/* Value, gradient, a second derivative and a tangent of a program around f. */
static void outputs(ad_var f(ad_var), ad_var x, ad_var y[4])
{
    ad_var g;
    y[0] = weighted_sum(ad_mul(f(ad_mul(x, 0.7)), f(ad_sin(x))));
    ad_grad(y[0], 1, &x, &y[1]);
    ad_grad(weighted_sum(ad_square(y[1])), 1, &x, &y[2]);
    ad_jvp(y[1], 1, &x, (ad_var[]){ad_cos(x)}, &y[3]);
    ad_grad(weighted_sum(y[3]), 1, &x, &g);
    y[3] = ad_add(y[3], g); /* of third order */
}

static void test_every_way(void **state)
{
    (void)state;
    for (int type = AD_F32; type <= AD_F64; type++)
        for (size_t threads = 1; threads <= 2; threads++) {
            const double tolerance = type == AD_F32 ? 2e-5 : 1e-13;
            uint64_t random = 3;
            double *at = random_values(&random, (size_t)ROWS * COLS, -2, 2);
            ad_tape *t = ad_tape_new((enum ad_type)type);
            ad_var x = ad_input(t, ROWS, COLS, "x"), y[12];
            outputs(ring, x, y);
            outputs(recorded_ring, x, y + 4);
            outputs(plain_ring, x, y + 8);
            ad_program *p = compile(t, 12, y);
            ad_set_threads(p, threads);
            ad_set(p, x, at);
            ad_run(p);
            for (size_t k = 0; k < 8; k++) {
                size_t n = ad_rows(y[k]) * ad_cols(y[k]);
                double *own = malloc(n * sizeof *own), *plain = malloc(n * sizeof *plain);
                assert_true(own && plain && ad_get(p, y[k], own) == AD_OK &&
                            ad_get(p, y[8 + k % 4], plain) == AD_OK);
                for (size_t i = 0; i < n; i++)
                    if (!is_close(own[i], plain[i], tolerance, tolerance * 1e2))
                        fail_msg("type %d, output %zu, element %zu: %.17g, not %.17g", type, k, i,
                                 own[i], plain[i]);
                free(own);
                free(plain);
            }
            ad_program_free(p);
            ad_tape_free(t);
            free(at);
        }
}

static void test_direct(void **state)
{
    (void)state;
    uint64_t random = 3;
    double *at = random_values(&random, (size_t)ROWS * COLS, -2, 2), value[2];
    double *g[2] = {malloc(sizeof(double) * ROWS * COLS), malloc(sizeof(double) * ROWS * COLS)};
    assert_true(g[0] && g[1]);
    for (int type = AD_F32; type <= AD_F64; type++) {
        ad_tape *t = ad_tape_new((enum ad_type)type);
        ad_var x = ad_input(t, ROWS, COLS, "x"), y[8];
        struct ad_error error = {0};
        outputs(ring, x, y);
        outputs(plain_ring, x, y + 4);
        for (size_t k = 0; k < 2; k++)
            assert_int_equal(ad_gradient(1, &x, (const double *[]){at}, y[4 * k], &value[k],
                                         (double *const[]){g[k]}, &error),
                             AD_OK);
        const double tolerance = type == AD_F32 ? 2e-5 : 1e-13;
        assert_close(value[0], value[1], tolerance, tolerance * 1e2);
        for (size_t i = 0; i < (size_t)ROWS * COLS; i++)
            assert_close(g[0][i], g[1][i], tolerance, tolerance * 1e2);
        assert_int_equal(ad_gradient(1, &x, (const double *[]){at}, ad_sum(y[1]), &value[0],
                                     (double *const[]){g[0]}, &error),
                         AD_E_ARGUMENT); /* of the adjoint */
        assert_non_null(strstr(error.message, "ring"));
        ad_tape_free(t);
    }
    free(g[0]);
    free(g[1]);
    free(at);
}

/* Blocks of a column each know nothing of each other. */
static void test_jacobian(void **state)
{
    (void)state;
    enum { FEW = 7 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, ROWS, FEW, "x");
    ad_jacobian *j;
    assert_int_equal(ad_jacobian_new(ring(x), 1, &x, &j), AD_OK);
    double at[ROWS * FEW];
    for (int k = 0; k < ROWS * FEW; k++)
        at[k] = sin(k);
    ad_set(ad_jacobian_program(j), x, at);
    ad_jacobian_run(j);
    const struct ad_sparse *m = ad_jacobian_matrix(j);
    assert_int_equal(m->start[m->rows], ROWS * ROWS * FEW);
    assert_true(ad_jacobian_runs(j) <= ROWS);
    for (size_t r = 0; r < m->rows; r++)
        for (size_t k = m->start[r]; k < m->start[r + 1]; k++) {
            size_t i = r / FEW, c = r % FEW, from = m->col[k] / FEW;
            double y = ring_element(at, ROWS, FEW, i, c), slope = 1 - y * y;
            assert_int_equal(m->col[k] % FEW, c);
            assert_close(m->value[k],
                         from == i                ? slope
                         : from == (i + 1) % ROWS ? slope / 2
                                                  : 0,
                         1e-14, 1e-15);
        }
    ad_jacobian_free(j);
    ad_tape_free(t);
}

/* ---- slopes of one row for several ---- */

static int sums(void *user, size_t cols, const double *const x[], double *y)
{
    (void)user;
    for (size_t c = 0; c < cols; c++)
        y[c] = x[0][c] + x[0][cols + c] + x[0][2 * cols + c] + 2 * (x[1][c] + x[1][cols + c]);
    return 0;
}

static void sums_recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)x, (void)y;
    gx[0] = gy;
    gx[1] = ad_mul(2.0, gy);
}

static void test_slopes_broadcast(void **state)
{
    (void)state;
    enum { WIDTH = 5 };
    const struct ad_custom operation = {.size = sizeof operation,
                                        .name = "sums",
                                        .rows = 1,
                                        .value = sums,
                                        .recorded = sums_recorded};
    double at[3 * WIDTH] = {0}, g[3 * WIDTH];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[] = {ad_input(t, 3, WIDTH, "a"), ad_input(t, 2, WIDTH, "b")}, slope[2];
    assert_int_equal(ad_grad(ad_sum(ad_custom(2, x, &operation)), 2, x, slope), AD_OK);
    ad_program *p = compile(t, 2, slope);
    for (size_t k = 0; k < 2; k++)
        ad_set(p, x[k], at);
    ad_run(p);
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(ad_get(p, slope[k], g), AD_OK);
        for (size_t i = 0; i < (3 - k) * WIDTH; i++)
            assert_close(g[i], k ? 2 : 1, 0, 0);
    }
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slopes_broadcast),
        cmocka_unit_test(test_every_way),
        cmocka_unit_test(test_direct),
        cmocka_unit_test(test_jacobian),
    };
    return cmocka_run_group_tests_name("operations of one's own", tests, NULL, NULL);
}
