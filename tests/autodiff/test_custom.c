/* Operations of one's own: against the same recorded, every way they are run; what a callback can
   do wrong, and what is refused. Values, gradients and adjoint identities of them are also in
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

/* ---- what a callback can do wrong ---- */

enum fault { RIGHT, FAILS, BEHIND, BEFORE, MAKES_NAN, WRONG_ADJOINT, LEAVES, N_FAULTS };

struct box {
    enum fault value, adjoint;
    double factor;
};

/* y = factor x^2, with a fault. */
static int square(void *user, size_t cols, const double *const x[], double *y)
{
    const struct box *box = user;
    for (size_t c = 0; c < cols; c++)
        y[c] = box->factor * x[0][c] * x[0][c];
    if (box->value == BEHIND || box->value == BEFORE)
        y[box->value == BEHIND ? (ptrdiff_t)cols : -1] = 1;
    if (box->value == MAKES_NAN)
        y[cols - 1] = (double)NAN;
    return box->value == FAILS && cols < 256; /* in the last block alone */
}

static int square_adjoint(void *user, size_t cols, const double *const x[], const double *y,
                          const double *gy, double *const gx[])
{
    const struct box *box = user;
    (void)y;
    for (size_t c = 0; c < cols; c++)
        if (box->adjoint != LEAVES || c != 2)
            gx[0][c] =
                (box->adjoint == WRONG_ADJOINT ? 1.001 : 1) * 2 * box->factor * x[0][c] * gy[c];
    if (box->adjoint == BEHIND || box->adjoint == BEFORE)
        gx[0][box->adjoint == BEHIND ? (ptrdiff_t)cols + 7 : -8] = 1;
    return box->adjoint == FAILS;
}

static void wrong_recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)y;
    gx[0] = ad_mul(ad_mul(2.002, x[0]), gy);
}

static ad_var squared(ad_var x, struct box *box)
{
    struct ad_custom operation = {
        .name = "square", .rows = 1, .value = square, .adjoint = square_adjoint, .user = box};
    return ad_custom(1, &x, &operation);
}

static void test_faults(void **state)
{
    (void)state;
    static const enum ad_status expected[N_FAULTS] = {
        [FAILS] = AD_E_NONFINITE, [BEHIND] = AD_E_ARGUMENT, [BEFORE] = AD_E_ARGUMENT};
    double at[COLS], g[COLS], value;
    for (int c = 0; c < COLS; c++)
        at[c] = 0.001 * c;
    for (int of_adjoint = 0; of_adjoint < 2; of_adjoint++)
        for (int fault = RIGHT; fault <= BEFORE; fault++) {
            struct box box = {.factor = 3};
            *(of_adjoint ? &box.adjoint : &box.value) = (enum fault)fault;
            ad_tape *t = ad_tape_new(AD_F64);
            ad_var x = ad_input(t, 1, COLS, "x"), y = ad_sum(squared(x, &box)), slope;
            struct ad_error error = {0};
            assert_int_equal(ad_grad(y, 1, &x, &slope), AD_OK);
            assert_int_equal(
                ad_gradient(1, &x, (const double *[]){at}, y, &value, (double *const[]){g}, &error),
                expected[fault]);
            ad_program *all = compile(t, 2, (ad_var[]){slope, y});
            ad_set(all, x, at);
            ad_run(all);
            assert_int_equal(ad_program_error(all)->status, expected[fault]);
            if (fault) {
                assert_non_null(strstr(ad_program_error(all)->message, "\"square\""));
                assert_non_null(
                    strstr(ad_program_error(all)->message, of_adjoint ? "adjoint" : "value"));
                assert_non_null(strstr(error.message, "\"square\"): "));
                assert_non_null(strstr(error.message, of_adjoint ? "adjoint" : "value"));
                error = (struct ad_error){0};
                assert_int_equal(ad_run_checked(all, &error), expected[fault]);
            }
            /* and nothing of it stays */
            box.adjoint = box.value = RIGHT;
            ad_run(all);
            assert_int_equal(ad_program_error(all)->status, AD_OK);
            ad_get(all, slope, g);
            assert_close(g[COLS - 1], 6 * at[COLS - 1], 1e-15, 0);
            ad_program_free(all);
            ad_tape_free(t);
        }
}

/* NaN of a callback, and what it leaves out, come out of the run. */
static void test_not_finite(void **state)
{
    (void)state;
    struct box box = {.factor = 1, .value = MAKES_NAN, .adjoint = LEAVES};
    double at[5] = {1, 2, 3, 4, 5}, g[5], y_at[5];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 5, "x"), y = squared(x, &box), slope;
    struct ad_error error = {0};
    ad_grad(y, 1, &x, &slope);
    ad_program *p = compile(t, 2, (ad_var[]){y, slope});
    ad_set(p, x, at);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
    ad_get(p, y, y_at);
    ad_get(p, slope, g);
    assert_true(y_at[3] == 16 && isnan(y_at[4]) && isnan(g[2]) && g[3] == 8);
    assert_int_equal(ad_run_checked(p, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "custom"));
    ad_program_free(p);
    /* no NaN comes back through a branch that is not taken */
    box.value = RIGHT;
    ad_var taken = ad_sum(ad_select(ad_lt(x, 2.5), squared(ad_recip(ad_sub(x, 3.0)), &box), x));
    box.adjoint = RIGHT;
    ad_grad(taken, 1, &x, &slope);
    p = compile(t, 1, &slope);
    ad_set(p, x, at);
    ad_run(p);
    ad_get(p, slope, g);
    assert_true(g[2] == 1 && g[3] == 1);
    assert_close(g[0], -2 / -8.0, 1e-14, 0);
    ad_program_free(p);
    ad_tape_free(t);
}

static void test_checks_find(void **state)
{
    (void)state;
    struct box box = {.factor = 1};
    double at[5] = {1, 2, 3, 4, 5};
    const double *where[] = {at};
    struct ad_check report;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 5, "x"), y = ad_sum(squared(x, &box));
    assert_int_equal(ad_check_gradient(y, 1, &x, where, 1e-8, 0, &report), AD_OK);
    assert_true(report.passed);
    box.adjoint = WRONG_ADJOINT;
    assert_int_equal(ad_check_gradient(y, 1, &x, where, 1e-8, 0, &report), AD_OK);
    assert_false(report.passed);
    box.adjoint = RIGHT;
    const struct ad_custom operation = {.name = "square",
                                        .rows = 1,
                                        .value = square,
                                        .adjoint = square_adjoint,
                                        .recorded = wrong_recorded,
                                        .user = &box};
    y = ad_sum(ad_custom(1, &x, &operation));
    assert_int_equal(ad_check_gradient(y, 1, &x, where, 1e-8, 0, &report), AD_OK);
    assert_true(report.passed);
    assert_int_equal(ad_check_second(y, 1, &x, where, 1e-6, 0, &report), AD_OK);
    assert_false(report.passed);
    ad_tape_free(t);
}

/* What `user` points to may change: nothing was computed when compiling, or is left out. */
static void test_user_changes(void **state)
{
    (void)state;
    struct box box = {.factor = 1};
    double got, at = 3;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_hold(ad_input(t, 1, 1, "x"));
    ad_var y = ad_add(squared(x, &box), squared(ad_scalar(t, 2), &box));
    ad_program *p = compile(t, 1, &y);
    ad_set(p, x, &at);
    ad_run(p);
    ad_get(p, y, &got);
    assert_true(got == 13);
    box.factor = 10;
    assert_int_equal(ad_rerun(p), AD_OK);
    ad_get(p, y, &got);
    assert_true(got == 130);
    ad_program_free(p);
    ad_tape_free(t);
}

/* ---- what is refused ---- */

static void none_recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)x, (void)y, (void)gy, (void)gx;
}

static enum ad_status refused(size_t n, const ad_var x[], const struct ad_custom *operation)
{
    ad_tape *t = x[0].tape;
    ad_custom(n, x, operation);
    enum ad_status status = ad_tape_error(t)->status;
    ad_tape_reset(t);
    return status;
}

static void test_refused(void **state)
{
    (void)state;
    struct box box = {.factor = 1};
    ad_tape *t = ad_tape_new(AD_F64);
    struct ad_custom f = {.name = "square", .rows = 1, .value = square, .user = &box};
    ad_var many[17];
    ad_custom(1, NULL, &f);
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, NULL), AD_E_ARGUMENT);
    f.value = NULL;
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, &f), AD_E_ARGUMENT);
    f.value = square;
    f.rows = 0;
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, &f), AD_E_ARGUMENT);
    f.rows = 1;
    assert_int_equal(refused(2, (ad_var[]){ad_input(t, 1, 5, "x"), ad_input(t, 2, 4, "y")}, &f),
                     AD_E_SHAPE);
    for (int k = 0; k < 17; k++)
        many[k] = ad_input(t, 1, 5, "x");
    assert_int_equal(refused(17, many, &f), AD_E_ARGUMENT);
    f.rows = SIZE_MAX;
    assert_int_equal(refused(1, (ad_var[]){ad_input(t, 1, 5, "x")}, &f), AD_E_SHAPE);

    /* derivatives that are not there */
    f.rows = 1;
    ad_var x = ad_input(t, 1, 5, "x"), y = ad_custom(1, &x, &f), g;
    assert_int_equal(ad_grad(y, 1, &x, &g), AD_E_ARGUMENT);
    assert_non_null(strstr(ad_tape_error(t)->message, "\"square\""));
    ad_tape_reset(t);
    x = ad_input(t, 1, 5, "x");
    assert_int_equal(ad_grad(squared(x, &box), 1, &x, &g), AD_OK);
    assert_int_equal(ad_grad(g, 1, &x, &g), AD_E_ARGUMENT);
    assert_non_null(strstr(ad_tape_error(t)->message, "\"square\""));
    assert_non_null(strstr(ad_tape_error(t)->message, "second"));
    ad_tape_reset(t);
    f.recorded = none_recorded;
    x = ad_input(t, 1, 5, "x");
    assert_int_equal(ad_grad(ad_custom(1, &x, &f), 1, &x, &g), AD_E_TAPE);
    ad_tape_reset(t);

    /* ad_gradient cannot record */
    double at[5] = {1, 2, 3, 4, 5}, slope[5], value[5];
    struct ad_error error = {0};
    x = ad_input(t, 1, 5, "x");
    f.recorded = wrong_recorded;
    y = ad_custom(1, &x, &f);
    assert_int_equal(
        ad_gradient(1, &x, (const double *[]){at}, y, value, (double *[]){slope}, &error),
        AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(ad_evaluate(1, &x, (const double *[]){at}, y, value, &error), AD_OK);
    assert_true(value[4] == 25);
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
    const struct ad_custom operation = {
        .name = "sums", .rows = 1, .value = sums, .recorded = sums_recorded};
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
        cmocka_unit_test(test_slopes_broadcast), cmocka_unit_test(test_every_way),
        cmocka_unit_test(test_direct),           cmocka_unit_test(test_jacobian),
        cmocka_unit_test(test_faults),           cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_checks_find),      cmocka_unit_test(test_user_changes),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("operations of one's own", tests, NULL, NULL);
}
