/* Jacobians and Hessians against gradients. */
#include "autodiff/derivatives.h"
#include "structure_cases.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>

enum { MOST = 3 };

/* All entries against gradients of one element at a time. */
static void assert_jacobian(ad_jacobian *J, ad_var y, size_t n, const ad_var x[],
                            const double *const at[], double tolerance)
{
    const struct ad_sparse *m = ad_jacobian_matrix(J);
    double *dense = malloc(m->rows * m->cols * sizeof *dense);
    double *expected = malloc(m->cols * sizeof *expected), *gradient[MOST];
    ad_var column = ad_reshape(y, m->rows, 1);
    assert_true(dense && expected);
    assert_int_equal(m->rows, ad_rows(y) * ad_cols(y));
    for (size_t k = 0, first = 0; k < n; first += ad_rows(x[k]) * ad_cols(x[k]), k++) {
        assert_int_equal(ad_set(ad_jacobian_program(J), x[k], at[k]), AD_OK);
        gradient[k] = expected + first;
    }
    for (int again = 0; again < 2; again++)
        ad_jacobian_run(J);
    ad_jacobian_dense(J, dense);
    for (size_t r = 0; r < m->rows; r++) {
        struct ad_error e = {0};
        assert_int_equal(ad_gradient(n, x, at, ad_row(column, r), NULL, gradient, &e), AD_OK);
        for (size_t c = 0; c < m->cols; c++)
            if (!is_close(dense[r * m->cols + c], expected[c], tolerance, tolerance))
                fail_msg("entry (%zu, %zu) is %.17g, not %.17g", r, c, dense[r * m->cols + c],
                         expected[c]);
        for (size_t k = m->start[r] + 1; k < m->start[r + 1]; k++)
            assert_true(m->col[k - 1] < m->col[k]);
    }
    free(dense);
    free(expected);
}

static void test_jacobian_of_structures(void **state)
{
    (void)state;
    for (size_t k = 0; structure_case(k); k++)
        for (int type = 0; type < 2; type++) {
            const struct structure *s = structure_case(k);
            if (s->second > SAME)
                continue;
            uint64_t random = 3 + k;
            ad_tape *t = ad_tape_new(type ? AD_F64 : AD_F32);
            ad_var x[2] = {ad_input(t, 3, 4, NULL), ad_input(t, 3, 4, NULL)};
            double *at[2] = {random_values(&random, 12, -1, 1), random_values(&random, 12, -1, 1)};
            ad_var y = ad_mul(0.25, s->record((ad_var[]){ad_tanh(x[0]), ad_tanh(x[1])}));
            ad_jacobian *J;
            size_t before = ad_tape_size(t);
            assert_int_equal(ad_jacobian_new(y, 2, x, &J), AD_OK);
            assert_int_equal(ad_tape_size(t), before);
            assert_jacobian(J, y, 2, x, (const double *const *)at, type ? 1e-13 : 1e-5);
            const struct ad_sparse *m = ad_jacobian_matrix(J);
            for (size_t i = 0; s->nature == LINEAR && i < m->start[m->rows]; i++)
                assert_true(m->value[i] != 0); /* the pattern has no more than there is */
            ad_jacobian_free(J);
            free(at[0]);
            free(at[1]);
            ad_tape_free(t);
        }
}

/* Two points of three coordinates see what is beside them: few runs, whatever the length is. */
static void test_bands(void **state)
{
    (void)state;
    enum { N = 400 };
    ad_tape *t = ad_tape_new(AD_F64);
    uint64_t random = 9;
    double *values = random_values(&random, 3 * N, -1, 1);
    const double *const at[] = {values};
    ad_var x = ad_input(t, 3, N, "x"), d = ad_diff(x, 2, false);
    ad_var force = ad_mul(ad_sum_rows(ad_square(d)), ad_sin(ad_row(ad_slice_cols(x, 1, N - 1), 0)));
    ad_jacobian *J, *H;
    assert_int_equal(ad_jacobian_new(force, 1, &x, &J), AD_OK);
    assert_int_equal(ad_jacobian_runs(J), 2); /* backward; 6 forward */
    assert_int_equal(ad_jacobian_matrix(J)->start[N - 1], 6 * (N - 1));
    assert_jacobian(J, force, 1, &x, at, 1e-13);
    assert_int_equal(ad_hessian_new(force, 1, &x, &H), AD_OK);
    assert_in_range(ad_jacobian_runs(H), 9, 12);
    ad_var g;
    ad_grad(force, 1, &x, &g);
    assert_jacobian(H, g, 1, &x, at, 1e-12);
    const struct ad_sparse *h = ad_jacobian_matrix(H);
    for (size_t r = 0; r < 60; r++) /* symmetric */
        for (size_t k = h->start[r]; k < h->start[r + 1]; k++)
            for (size_t i = h->start[h->col[k]]; i < h->start[h->col[k] + 1]; i++)
                if (h->col[i] == r)
                    assert_close(h->value[i], h->value[k], 1e-12, 1e-12);
    ad_jacobian_free(J);
    ad_jacobian_free(H);
    free(values);
    ad_tape_free(t);
}

/* One row or one column full: backward or forward takes one run. */
static void test_arrows(void **state)
{
    (void)state;
    enum { N = 50 };
    ad_tape *t = ad_tape_new(AD_F64);
    uint64_t random = 4;
    double *values = random_values(&random, N, -1, 1), one = 0.5;
    ad_var x = ad_input(t, N, 1, "x"), a = ad_input(t, 1, 1, "a");
    ad_jacobian *J;
    assert_int_equal(ad_jacobian_new(ad_sum(ad_exp(x)), 1, &x, &J), AD_OK);
    assert_int_equal(ad_jacobian_runs(J), 1);
    ad_jacobian_free(J);
    ad_var y = ad_mul(ad_sin(x), ad_exp(a));
    assert_int_equal(ad_jacobian_new(y, 2, (ad_var[]){a, x}, &J), AD_OK);
    assert_int_equal(ad_jacobian_runs(J), 2);
    assert_jacobian(J, y, 2, (ad_var[]){a, x}, (const double *const[]){&one, values}, 1e-14);
    ad_jacobian_free(J);
    ad_var z = ad_reshape(x, 5, N / 5); /* each column by its own alone */
    y = ad_matmul(ad_const(t, 2, 5, values), false, z, false);
    assert_int_equal(ad_jacobian_new(y, 2, (ad_var[]){a, x}, &J), AD_OK);
    assert_int_equal(ad_jacobian_matrix(J)->start[2 * N / 5], 2 * N);
    assert_jacobian(J, y, 2, (ad_var[]){a, x}, (const double *const[]){&one, values}, 1e-14);
    ad_jacobian_free(J);
    free(values);
    ad_tape_free(t);
}

/* The pattern is that of all values: a branch not taken here is taken there. */
static void test_pattern_of_branches(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 3, "x"), a = ad_col(x, 0), b = ad_col(x, 1), c = ad_col(x, 2);
    ad_var y = ad_max(ad_select(ad_gt(c, 0.0), a, b), ad_mul(c, ad_detach(a)));
    ad_jacobian *J;
    assert_int_equal(ad_jacobian_new(y, 1, &x, &J), AD_OK);
    assert_int_equal(ad_jacobian_matrix(J)->start[1], 3);
    static const double cases[][6] = {
        {3, -2, 1, 0.5, 0, 0.5}, {5, -2, 0.1, 1, 0, 0}, {1, 7, -1, 0, 1, 0}, {2, -9, -1, 0, 0, 2}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        double dense[3], expected[3] = {cases[k][3], cases[k][4], cases[k][5]};
        if (k == 0)
            expected[2] = 1.5; /* a tie: half of c's a = 3 */
        ad_set(ad_jacobian_program(J), x, cases[k]);
        ad_jacobian_run(J);
        ad_jacobian_dense(J, dense);
        for (int i = 0; i < 3; i++)
            assert_same(dense[i], expected[i], "entry");
    }
    ad_jacobian_free(J);
    ad_tape_free(t);
}

/* ---- variables that are gathered ---- */

enum { SEEN = 20 }; /* columns that the gathers make of 4 x 5 elements */

/* So many steps of a coupled map of both operands' columns. */
static ad_var mixed(ad_var a, ad_var b, size_t steps)
{
    for (size_t k = 0; k < steps; k++) {
        ad_var next = ad_tanh(ad_add(ad_mul(0.9, a), ad_mul(0.1, ad_mul(b, ad_row(a, k % 4)))));
        b = ad_sub(ad_mul(0.99, b), ad_mul(0.1, ad_square(next)));
        a = next;
    }
    return ad_concat_rows(3,
                          (ad_var[]){ad_slice_rows(a, 0, 2), ad_row(b, 3), ad_exp(ad_row(b, 1))});
}

static void columns_seen(uint32_t list[SEEN], uint32_t factor)
{
    for (uint32_t k = 0; k < SEEN; k++)
        list[k] = (k * factor + k / 5) % 5;
}

static ad_var two_columns(ad_var x, ad_var w, size_t steps)
{
    uint32_t one[SEEN], other[SEEN]; /* the same in a fifth of the places */
    columns_seen(one, 1);
    columns_seen(other, 3);
    return mixed(ad_gather_cols(x, SEEN, one), ad_mul(ad_gather_cols(x, SEEN, other), w), steps);
}

static ad_var columns_and_rows(ad_var x, ad_var w, size_t steps)
{
    uint32_t one[SEEN];
    columns_seen(one, 2);
    ad_var rows = ad_gather_rows(ad_transpose(ad_reshape(ad_transpose(x), 5, 4)), 4,
                                 (uint32_t[]){3, 3, 0, 1});
    return mixed(ad_gather_cols(x, SEEN, one), ad_mul(w, ad_gather_cols(rows, SEEN, one)), steps);
}

/* Read as a whole, too. */
static ad_var and_whole(ad_var x, ad_var w, size_t steps)
{
    uint32_t one[SEEN];
    columns_seen(one, 2);
    return mixed(ad_gather_cols(x, SEEN, one), ad_mul(w, ad_sum(ad_square(x))), steps);
}

static ad_var gather_alone(ad_var x, ad_var w, size_t steps)
{
    uint32_t one[SEEN];
    columns_seen(one, steps & 1);
    (void)w;
    return ad_gather_cols(x, SEEN, one);
}

/* Differences from few values that are looked up; the copies are not computed. */
static ad_var looked_up(ad_var x, ad_var w, size_t steps)
{
    uint32_t one[SEEN];
    columns_seen(one, 2);
    ad_var few = ad_mul(ad_exp(ad_slice_rows(x, 1, 2)), ad_sum_cols(ad_slice_rows(x, 0, 2)));
    for (size_t k = 0; k < steps; k++)
        few = ad_sin(ad_add(few, ad_col(few, k % 5)));
    ad_var seen = ad_gather_cols(ad_gather_rows(ad_neg(few), 3, (uint32_t[]){1, 0, 1}), SEEN, one);
    return ad_concat_rows(2, (ad_var[]){ad_sub(0.5, seen), ad_neg(ad_sub(w, ad_row(seen, 1)))});
}

static ad_var looked_up_alone(ad_var x, ad_var w, size_t steps)
{
    uint32_t one[SEEN];
    columns_seen(one, 3);
    ad_var few = ad_mul(ad_sin(x), ad_sum(ad_mul((double)steps, x)));
    return ad_sub(ad_detach(w), ad_row(ad_gather_cols(few, SEEN, one), 2));
}

/* Rows of one observation take a run each, however many observations see a column; in one program
   (few steps) or run after run. */
static void test_gathered(void **state)
{
    (void)state;
    static const struct {
        ad_var (*record)(ad_var x, ad_var w, size_t steps);
        size_t steps, runs; /* of 4 rows */
    } cases[] = {
        {two_columns, 3, 4},        {two_columns, 110, 4}, {columns_and_rows, 2, 4},
        {columns_and_rows, 121, 4}, {gather_alone, 1, 1},  {and_whole, 4, 0},
        {and_whole, 100, 0},        {looked_up, 4, 0},     {looked_up_alone, 1, 0},
    };
    for (size_t k = 0; k < LENGTH(cases); k++)
        for (int type = 0; type < 2; type++) {
            uint64_t random = 5 + k;
            ad_tape *t = ad_tape_new(type ? AD_F64 : AD_F32);
            ad_var x[2] = {ad_input(t, 4, 5, "x"), ad_input(t, 1, SEEN, "w")};
            double *at[2] = {random_values(&random, 20, -1, 1),
                             random_values(&random, SEEN, -1, 1)};
            ad_var y = cases[k].record(x[0], x[1], cases[k].steps);
            ad_jacobian *J;
            assert_int_equal(ad_jacobian_new(y, 2, x, &J), AD_OK);
            if (cases[k].runs)
                assert_int_equal(ad_jacobian_runs(J), cases[k].runs);
            ad_set_threads(ad_jacobian_program(J), k % 2 ? 2 : 1);
            assert_jacobian(J, y, 2, x, (const double *const *)at, type ? 1e-12 : 1e-4);
            ad_jacobian_free(J);
            free(at[0]);
            free(at[1]);
            ad_tape_free(t);
        }
}

/* More colours than results are kept of. */
static void test_many_runs(void **state)
{
    (void)state;
    enum { N = 37 };
    uint64_t random = 8;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, N, 1, "x"), y = x;
    double *values = random_values(&random, N, -1, 1),
           *m = random_values(&random, N * N, -0.25, 0.25);
    const double *const at[] = {values};
    ad_var mix = ad_const(t, N, N, m);
    for (size_t k = 0; k < 60; k++)
        y = ad_sin(ad_add(0.5, ad_matmul(mix, false, y, false)));
    ad_jacobian *J;
    assert_int_equal(ad_jacobian_new(y, 1, &x, &J), AD_OK);
    assert_int_equal(ad_jacobian_runs(J), N);
    assert_jacobian(J, y, 1, &x, at, 1e-9);
    ad_jacobian_free(J);
    free(values);
    free(m);
    ad_tape_free(t);
}

/* Seeds of zeros are not passed on; an infinite derivative there makes no NaN. */
static void test_zero_seeds(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 4, "x");
    static const double at[] = {0, 4, 0, 9, 1, 2, 3, 4, 5, 6, 7, 8};
    ad_var y = ad_concat_rows(
        2, (ad_var[]){ad_sqrt(ad_row(x, 0)), ad_mul(ad_row(x, 1), ad_square(ad_row(x, 2)))});
    ad_jacobian *J;
    double dense[8 * 12];
    assert_int_equal(ad_jacobian_new(y, 1, &x, &J), AD_OK);
    ad_set(ad_jacobian_program(J), x, at);
    ad_jacobian_run(J);
    ad_jacobian_dense(J, dense);
    for (size_t r = 0; r < 8; r++)
        for (size_t c = 0; c < 12; c++) {
            const size_t k = r % 4; /* column of y, row r / 4 */
            double expected = 0;
            if (c == r && r < 4)
                expected = at[k] == 0 ? INFINITY : 0.5 / sqrt(at[k]);
            else if (r >= 4 && c % 4 == k && c >= 4)
                expected = c < 8 ? at[8 + k] * at[8 + k] : 2 * at[4 + k] * at[8 + k];
            assert_same(dense[r * 12 + c], expected, "entry");
        }
    ad_jacobian_free(J);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_jacobian_of_structures),
        cmocka_unit_test(test_bands),
        cmocka_unit_test(test_arrows),
        cmocka_unit_test(test_pattern_of_branches),
        cmocka_unit_test(test_gathered),
        cmocka_unit_test(test_many_runs),
        cmocka_unit_test(test_zero_seeds),
    };
    return cmocka_run_group_tests_name("Jacobians", tests, NULL, NULL);
}
