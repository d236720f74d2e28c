/* Directional derivatives against each other; and cases that could be wrong without an error:
   branches, infinite slopes beside others, repeated variables, variables without dependents or
   that are no inputs. */
#include "autodiff/derivatives.h"
#include "structure_cases.h"
#include "support.h"

#include <stdlib.h>
#include <string.h>

/* ---- <seed, J dx> = <J' seed, dx> ---- */

static double dot(size_t n, const double *a, const double *b)
{
    double s = 0;
    for (size_t i = 0; i < n; i++)
        s += a[i] * b[i];
    return s;
}

enum { MOST = 3 };

static void assert_duality(const char *name, ad_var y, size_t n, const ad_var x[],
                           const double *const at[], double tolerance)
{
    ad_tape *t = y.tape;
    uint64_t random = 77;
    ad_var dx[MOST], g[MOST], dy;
    double *direction[MOST], right = 0, left, size = 0;
    size_t n_y = ad_rows(y) * ad_cols(y);
    for (size_t k = 0; k < n; k++) {
        size_t n_x = ad_rows(x[k]) * ad_cols(x[k]);
        direction[k] = random_values(&random, n_x, -1, 1);
        dx[k] = ad_const(t, ad_rows(x[k]), ad_cols(x[k]), direction[k]);
    }
    double *seed = random_values(&random, n_y, -1, 1);
    assert_int_equal(ad_jvp(y, n, x, dx, &dy), AD_OK);
    assert_int_equal(ad_vjp(y, ad_const(t, ad_rows(y), ad_cols(y), seed), n, x, g), AD_OK);
    double *v = evaluate(dy, n, x, at);
    left = dot(n_y, seed, v);
    for (size_t i = 0; i < n_y; i++)
        size += fabs(seed[i] * v[i]);
    free(v);
    for (size_t k = 0; k < n; k++) {
        v = evaluate(g[k], n, x, at);
        right += dot(ad_rows(x[k]) * ad_cols(x[k]), v, direction[k]);
        free(v);
        free(direction[k]);
    }
    if (!is_close(left, right, tolerance, tolerance * size))
        fail_msg("%s: <seed, J dx> is %.17g, <J' seed, dx> %.17g", name, left, right);
    free(seed);
}

struct row {
    const char *name;
    enum ad_op op;
    int arity;
    double lo, hi;
};

static const struct row rows[] = {
#define AD_UNARY(name, value, dx, lo, hi) {#name, AD_OP_##name, 1, lo, hi},
#define AD_BINARY(name, value, da, db, lo, hi) {#name, AD_OP_##name, 2, lo, hi},
#define AD_TERNARY(name, value, da, db, dc, lo, hi) {#name, AD_OP_##name, 3, lo, hi},
#include "autodiff/ops.def"
};

static ad_var record(const struct row *row, const ad_var x[3])
{
    if (row->op == AD_OP_powi)
        return ad_binary(row->op, AD_ARG(x[0]), AD_ARG(-5.0));
    return row->arity == 1   ? ad_unary(row->op, x[0])
           : row->arity == 2 ? ad_binary(row->op, AD_ARG(x[0]), AD_ARG(x[1]))
                             : ad_ternary(row->op, AD_ARG(x[0]), AD_ARG(x[1]), AD_ARG(x[2]));
}

/* A matrix with a row and a column, in every order, between others so that second order is there.
 */
static void test_every_elementwise_operation(void **state)
{
    (void)state;
    static const size_t shapes[4][2] = {{3, 4}, {1, 4}, {3, 1}, {1, 1}};
    for (size_t k = 0; k < LENGTH(rows); k++)
        for (size_t s = 0; s < 4; s++) {
            uint64_t random = 7 + k;
            ad_tape *t = ad_tape_new(AD_F64);
            ad_var x[3], dx[3], dy;
            double *at[3];
            for (size_t i = 0; i < 3; i++) {
                const size_t *shape = shapes[(s + i) % 4];
                x[i] = ad_input(t, shape[0], shape[1], NULL);
                at[i] = random_values(&random, shape[0] * shape[1], rows[k].lo, rows[k].hi);
                dx[i] = ad_cos(ad_mul(1.5, x[i]));
            }
            ad_var y = record(&rows[k], x);
            assert_duality(rows[k].name, y, 3, x, (const double *const *)at, 1e-13);
            assert_int_equal(ad_jvp(y, 3, x, dx, &dy), AD_OK);
            assert_duality(rows[k].name, dy, 3, x, (const double *const *)at, 1e-12);
            for (int i = 0; i < 3; i++)
                free(at[i]);
            ad_tape_free(t);
        }
}

static void test_every_structure(void **state)
{
    (void)state;
    static const size_t seconds[][2] = {
        [SAME] = {5, 6},         [ONE_ROW] = {1, 6},   [ONE_COL] = {5, 1},     [COLS_BY_4] = {6, 4},
        [FOUR_BY_COLS] = {4, 6}, [ROWS_BY_4] = {5, 4}, [FOUR_BY_ROWS] = {4, 5}};
    for (size_t k = 0; structure_case(k); k++) {
        const struct structure *s = structure_case(k);
        uint64_t random = 3 + k;
        ad_tape *t = ad_tape_new(AD_F64);
        size_t n = s->second == NONE ? 1 : 2;
        ad_var x[2] = {ad_input(t, 5, 6, NULL)}, inner[2];
        double *at[2] = {random_values(&random, 30, -2, 2)};
        if (n == 2) {
            x[1] = ad_input(t, seconds[s->second][0], seconds[s->second][1], NULL);
            at[1] = random_values(&random, ad_rows(x[1]) * ad_cols(x[1]), -2, 2);
        }
        for (size_t i = 0; i < n; i++)
            inner[i] = ad_sinh(x[i]);
        ad_var y = ad_sin(s->record(inner)), dy;
        assert_duality(s->name, y, n, x, (const double *const *)at, 1e-12);
        assert_int_equal(ad_jvp(y, n, x, inner, &dy), AD_OK);
        assert_duality(s->name, dy, n, x, (const double *const *)at, 1e-11);
        for (size_t i = 0; i < n; i++)
            free(at[i]);
        ad_tape_free(t);
    }
}

/* A direction through one that depends on another adds to what that makes of it, as gradients do.
 */
static void test_intermediate(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_input(t, 2, 3, "a"), b = ad_exp(a), y = ad_mul(a, ad_sin(b));
    const double values[] = {0.1, 0.5, -0.3, 0.7, 0.2, -1};
    const double *const at[] = {values};
    ad_var x[] = {a, b}, seed = ad_const(t, 2, 3, values), one = ad_scalar(t, 1), g[2], dy[3];
    assert_int_equal(ad_vjp(y, seed, 2, x, g), AD_OK);
    for (int k = 0; k < 2; k++)
        assert_int_equal(ad_jvp(y, 1, &x[k], &one, &dy[k]), AD_OK);
    assert_int_equal(ad_jvp(y, 2, x, (ad_var[]){one, one}, &dy[2]), AD_OK);
    ad_var both = ad_add(ad_sum(g[0]), ad_sum(g[1]));
    assert_close(evaluate_scalar(ad_dot(seed, dy[2]), 1, &a, at), evaluate_scalar(both, 1, &a, at),
                 1e-14, 0);
    ad_var difference = ad_sub(dy[2], ad_add(dy[0], dy[1]));
    assert_close(evaluate_scalar(ad_sum(ad_square(difference)), 1, &a, at), 0, 0, 1e-30);
    ad_tape_free(t);
}

/* What is not taken may be anything, forward, too. */
static void test_branches_forward(void **state)
{
    (void)state;
    const double zeros[] = {0, 0, 4};
    const double *const at[] = {zeros};
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 3, "x"), dy;
    ad_var y = ad_select(ad_gt(x, 0.0), ad_log(x), ad_mul(3.0, x));
    assert_int_equal(ad_jvp(y, 1, &x, (ad_var[]){ad_scalar(t, 2)}, &dy), AD_OK);
    double *v = evaluate(dy, 1, &x, at);
    assert_same(v[0], 6, "branch not taken");
    assert_same(v[2], 0.5, "branch taken");
    free(v);
    y = ad_log(ad_relu(ad_sub(x, 5.0)));
    assert_int_equal(ad_jvp(y, 1, &x, (ad_var[]){ad_scalar(t, 2)}, &dy), AD_OK);
    v = evaluate(dy, 1, &x, at);
    assert_same(v[0], 0, "behind a branch");
    free(v);
    ad_tape_free(t);
}

/* An infinite slope in one column is no NaN in the others, forward or backward. */
static void test_infinite_slope(void **state)
{
    (void)state;
    for (int forward = 0; forward < 2; forward++) {
        ad_tape *t = ad_tape_new(AD_F64);
        ad_var x = ad_input(t, 1, 2, "x"), a = ad_col(x, 0), b = ad_col(x, 1);
        ad_var parts[] = {ad_mul(3.0, a), ad_add(ad_log(a), ad_mul(2.0, b)), ad_square(b)};
        ad_var y = ad_concat_cols(forward ? 3 : 1, forward ? parts : parts + 1);
        ad_jacobian *J;
        double dense[6];
        const double at[] = {0, 5};
        assert_int_equal(ad_jacobian_new(y, 1, &x, &J), AD_OK);
        ad_set(ad_jacobian_program(J), x, at);
        ad_jacobian_run(J);
        ad_jacobian_dense(J, dense);
        const double *row = dense + 2 * forward;
        assert_same(row[0], INFINITY, "slope of log at 0");
        assert_same(row[1], 2, "beside it");
        if (forward) {
            assert_same(dense[0], 3, "above it");
            assert_same(dense[5], 10, "below it");
        }
        ad_jacobian_free(J);
        ad_tape_free(t);
    }
}

/* Twice the same variable, one that nothing depends on, one recorded later, a constant y. */
static void test_unusual_variables(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    const double two = 2, three = 3;
    ad_var x = ad_input(t, 1, 1, "x"), z = ad_input(t, 1, 1, "z"), y = ad_square(x), later;
    later = ad_input(t, 1, 1, "later");
    ad_jacobian *J;
    double dense[3];
    assert_int_equal(ad_jacobian_new(y, 3, (ad_var[]){z, x, later}, &J), AD_OK);
    ad_set(ad_jacobian_program(J), x, &two);
    ad_set(ad_jacobian_program(J), z, &three);
    ad_jacobian_run(J);
    ad_jacobian_dense(J, dense);
    assert_same(dense[0], 0, "z");
    assert_same(dense[1], 4, "x");
    assert_same(dense[2], 0, "later");
    ad_jacobian_free(J);
    assert_int_equal(ad_jacobian_new(y, 2, (ad_var[]){x, x}, &J), AD_OK);
    ad_set(ad_jacobian_program(J), x, &two);
    ad_jacobian_run(J);
    ad_jacobian_dense(J, dense);
    assert_same(dense[0], 4, "x");
    assert_same(dense[1], 4, "x again");
    ad_jacobian_free(J);
    assert_int_equal(ad_jacobian_new(ad_scalar(t, 7), 1, &x, &J), AD_OK);
    assert_int_equal(ad_jacobian_matrix(J)->start[1], 0);
    ad_jacobian_run(J);
    ad_jacobian_dense(J, dense);
    assert_same(dense[0], 0, "constant");
    ad_jacobian_free(J);
    assert_int_equal(ad_hessian_new(ad_mul(3.0, x), 1, &x, &J), AD_OK); /* linear */
    ad_jacobian_run(J);
    ad_jacobian_dense(J, dense);
    assert_same(dense[0], 0, "linear");
    ad_jacobian_free(J);
    ad_jacobian_free(NULL);
    ad_tape_free(t);
}

static void test_refused(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    for (int k = 0; k < 8; k++) {
        static const enum ad_status expected[] = {AD_OK,     AD_E_SHAPE,    AD_E_TAPE,
                                                  AD_E_TAPE, AD_E_ARGUMENT, AD_E_TAPE,
                                                  AD_E_TAPE, AD_E_ARGUMENT};
        ad_tape_reset(t);
        ad_var x = ad_input(t, 2, 3, "x"), y = ad_sin(x), out, foreign = ad_input(other, 2, 3, "x");
        ad_jacobian *J = NULL;
        enum ad_status status = k == 0 ? /* a row broadcasts */ ad_vjp(y, ad_row(x, 0), 1, &x, &out)
                                : k == 1 ? ad_jvp(y, 1, &x, (ad_var[]){ad_transpose(x)}, &out)
                                : k == 2 ? ad_vjp(y, foreign, 1, &x, &out)
                                : k == 3 ? ad_jvp(y, 1, &x, &foreign, &out)
                                : k == 4 ? ad_jacobian_new(y, 0, NULL, &J)
                                : k == 5 ? ad_jacobian_new(y, 1, &foreign, &J)
                                : k == 6 ? ad_hessian_new((ad_var){0}, 1, &x, &J)
                                         : ad_jvp(y, 1, &x, NULL, &out);
        assert_int_equal(status, expected[k]);
        assert_null(J);
    }
    ad_tape_free(t);
    ad_tape_free(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_elementwise_operation),
        cmocka_unit_test(test_every_structure),
        cmocka_unit_test(test_intermediate),
        cmocka_unit_test(test_branches_forward),
        cmocka_unit_test(test_infinite_slope),
        cmocka_unit_test(test_unusual_variables),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("derivatives", tests, NULL, NULL);
}
