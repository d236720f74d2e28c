/* Results of compiling: dead nodes removed, equal nodes shared, constants folded, segments formed,
   and values kept no longer than they are used. */
#include "support.h"

#include <stdlib.h>

static struct ad_program_info info_of(ad_tape *tape, size_t n, const ad_var out[])
{
    ad_program *p = compile(tape, n, out);
    struct ad_program_info info = ad_program_info(p);
    ad_program_free(p);
    return info;
}

static void test_dead_nodes_are_dropped(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 7, NULL), y = ad_tanh(ad_sin(x));
    size_t alone = info_of(t, 1, &y).nodes;
    ad_var z = ad_cos(y);
    for (int k = 0; k < 100; k++)
        z = ad_exp(ad_mul(z, x));
    assert_int_equal(info_of(t, 1, &y).nodes, alone);
    assert_true(info_of(t, 1, &z).nodes >= 200);
    ad_tape_free(t);
}

static void test_equal_nodes_are_shared(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 7, NULL), w = ad_input(t, 3, 7, NULL);
    const uint32_t rows[] = {0, 2}, again[] = {0, 2}, others[] = {0, 1};
    ad_var same[] = {ad_sin(ad_mul(x, w)), ad_sin(ad_mul(x, w))};
    assert_int_equal(info_of(t, 2, same).nodes, info_of(t, 1, same).nodes);
    ad_var views[] = {ad_sin(ad_row(x, 1)), ad_sin(ad_row(x, 1)), ad_sin(ad_row(x, 2))};
    assert_int_equal(info_of(t, 2, views).nodes, info_of(t, 1, views).nodes);
    assert_true(info_of(t, 3, views).nodes > info_of(t, 2, views).nodes);
    ad_var gathers[] = {ad_gather_rows(x, 2, rows), ad_gather_rows(x, 2, again),
                        ad_gather_rows(x, 2, others)};
    assert_int_equal(info_of(t, 2, gathers).nodes, info_of(t, 1, gathers).nodes);
    assert_true(info_of(t, 3, gathers).nodes > info_of(t, 2, gathers).nodes);
    ad_var numbers[] = {ad_add(x, 0.37), ad_add(x, 0.37), ad_add(x, 0.38)};
    assert_int_equal(info_of(t, 2, numbers).nodes, info_of(t, 1, numbers).nodes);
    assert_true(info_of(t, 3, numbers).nodes > info_of(t, 2, numbers).nodes);
    ad_tape_free(t);
}

/* Sharing must not confuse what only looks alike. */
static void test_different_nodes_are_not_shared(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 3, NULL), w = ad_input(t, 2, 3, NULL);
    double vx[] = {1, 2, 3, 4, 5, 6}, vw[] = {7, 5, 3, 2, 1, 9};
    struct {
        ad_var var;
        double first;
    } cases[] = {
        {ad_sub(x, w), -6},
        {ad_sub(w, x), 6},
        {ad_lt(x, w), 1},
        {ad_lt(w, x), 0},
        {ad_diff(x, 2, false), 2},
        {ad_diff(x, 3, false), 3},
        {ad_diff(w, 2, true), -4},
        {ad_diff(w, 2, false), -4},
        {ad_reshape(x, 3, 2), 1},
        {ad_transpose(x), 1},
        {ad_matmul(x, false, w, true), 26},
        {ad_matmul(x, true, w, false), 15},
        {ad_add(x, 0.0), 1},
        {ad_mul(x, -0.0), -0.0},
        {ad_div(1.0, ad_mul(ad_scalar(t, 0.0), 1.0)), INFINITY},
        {ad_div(1.0, ad_mul(ad_scalar(t, -0.0), 1.0)), -INFINITY},
    };
    enum { N = sizeof cases / sizeof cases[0] };
    ad_var out[N];
    for (size_t k = 0; k < N; k++)
        out[k] = cases[k].var;
    ad_program *p = compile(t, N, out);
    ad_set(p, x, vx);
    ad_set(p, w, vw);
    ad_run(p);
    for (size_t k = 0; k < N; k++) {
        double v[9];
        assert_int_equal(ad_get(p, out[k], v), AD_OK);
        if (!(v[0] == cases[k].first))
            fail_msg("case %zu: %g, not %g", k, v[0], cases[k].first);
    }
    ad_program_free(p);
    ad_tape_free(t);
}

static void test_constants_are_folded(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    const double c[] = {1, 2, 3, 4, 5, 6};
    ad_var a = ad_const(t, 2, 3, c), b = ad_matmul(a, false, ad_exp(ad_neg(a)), true);
    ad_var x = ad_input(t, 1, 1, NULL);
    ad_var y = ad_mul(ad_sum(ad_sin(b)), x);
    struct ad_program_info info = info_of(t, 1, &y);
    assert_true(info.instructions == 1);
    assert_true(info.constants >= 4);
    double one = 1, expected = 0;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            double s = 0;
            for (int k = 0; k < 3; k++)
                s += c[3 * i + k] * exp(-c[3 * j + k]);
            expected += sin(s);
        }
    assert_close(evaluate_scalar(y, 1, &x, (const double *const[]){&one}), expected, 1e-14, 0);
    ad_tape_free(t);
}

static void test_elementwise_runs_are_one_segment(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 1000, NULL), y = ad_row(x, 0), z = ad_row(x, 1);
    for (int k = 0; k < 30; k++)
        y = ad_mul(ad_sin(y), ad_add(z, y));
    assert_int_equal(info_of(t, 1, &y).segments, 1);
    ad_var both[] = {y, ad_sum(y)};
    assert_true(info_of(t, 2, both).segments <= 2);
    ad_tape_free(t);
}

/* sin x is needed with the second product alone: it is computed there, and not kept until then.
   exp x is read by a product as well, so it is kept, whoever else reads it. An adjoint of
   differences waits as sin x does. */
static void test_values_wait(void **state)
{
    (void)state;
    enum { N = 64 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, N, N, "x"), s = ad_sin(x), e = ad_exp(x);
    ad_var xx = ad_matmul(x, false, x, false), xxx = ad_matmul(xx, false, x, false);
    ad_var waits = ad_mul(s, xxx), kept = ad_mul(e, ad_matmul(e, false, x, false));
    assert_int_equal(info_of(t, 1, &waits).segments, 3);
    assert_int_equal(info_of(t, 1, &kept).segments, 3);
    ad_var adjoint = ad_mul(ad_diff_adjoint(x, 1, true, N), xxx);
    assert_int_equal(info_of(t, 1, &adjoint).segments, 3);
    size_t alone = info_of(t, 1, &xxx).value_bytes, bytes = info_of(t, 1, &waits).value_bytes;
    assert_true(bytes < alone + (N * N + N * N / 2) * sizeof(double));
    ad_tape_free(t);
}

/* The derivative of a force along u passes its factors on to each coordinate. */
static void test_factors_come_out_of_sums(void **state)
{
    (void)state;
    enum { DIMENSIONS = 3 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x[DIMENSIONS], g[DIMENSIONS], h[DIMENSIONS], r = ad_scalar(t, 0), along = r;
    for (size_t k = 0; k < DIMENSIONS; k++) {
        x[k] = ad_input(t, 1, 8, NULL);
        r = ad_add(r, ad_square(x[k]));
    }
    ad_grad(ad_sum(ad_recip(r)), DIMENSIONS, x, g);
    for (size_t k = 0; k < DIMENSIONS; k++)
        along = ad_add(along, ad_mul(g[k], ad_input(t, 1, 8, NULL)));
    ad_grad(ad_sum(along), DIMENSIONS, x, h);
    assert_int_equal(info_of(t, DIMENSIONS, h).instructions, 27);
    ad_tape_free(t);
}

/* Products add themselves to what they are added to; not to a constant, which must outlive the run,
   nor to a value that is read again. */
static void test_products_add_themselves(void **state)
{
    (void)state;
    enum { N = 3 };
    uint64_t seed = 12;
    double *v = random_values(&seed, N * N, -1, 1), *w = random_values(&seed, N * N, -1, 1);
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, N, N, "x"), kept = ad_const(t, N, N, w), e = ad_exp(x);
    ad_var xx = ad_matmul(x, false, x, false), xe = ad_matmul(x, false, e, true);
    ad_var all = ad_add(ad_add(ad_sin(x), xx), xe), constant = ad_add(xe, kept);
    assert_int_equal(info_of(t, 1, &all).instructions, 4);
    ad_var out[] = {all, constant, ad_add(xx, ad_square(xx)), e};
    ad_program *p = compile(t, 4, out);
    ad_set(p, x, v);
    for (int run = 0; run < 2; run++) {
        ad_run(p);
        for (size_t i = 0; i < N; i++)
            for (size_t j = 0; j < N; j++) {
                size_t at = i * N + j;
                double a = 0, b = 0;
                for (size_t k = 0; k < N; k++) {
                    a += v[i * N + k] * v[k * N + j];
                    b += v[i * N + k] * exp(v[j * N + k]);
                }
                const double expected[] = {sin(v[at]) + a + b, b + w[at], a + a * a, exp(v[at])};
                for (size_t k = 0; k < 4; k++)
                    assert_close(((double *)ad_data(p, out[k]))[at], expected[k], 1e-14, 1e-14);
            }
    }
    ad_program_free(p);
    ad_tape_free(t);
    free(v);
    free(w);
}

/* Values live only as long as they are used: a long chain needs the memory of a few. */
/* Beside 1/x, recip0(x) is not divided again, and is what it is alone. */
static void test_reciprocals_are_reused(void **state)
{
    (void)state;
    const double values[] = {0, -0.0, 2, -0.37, 1e-310, INFINITY, -INFINITY, NAN};
    enum { N = sizeof values / sizeof *values };
    double reused[N], alone[N];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, N, NULL), out[] = {ad_recip(x), ad_recip0(x)};
    ad_program *two = compile(t, 2, out), *one = compile(t, 1, out + 1);
    ad_set(two, x, values);
    ad_set(one, x, values);
    ad_run(two);
    ad_run(one);
    ad_get(two, out[1], reused);
    ad_get(one, out[1], alone);
    for (size_t k = 0; k < N; k++)
        assert_true(reused[k] == alone[k] || (isnan(reused[k]) && isnan(alone[k])));
    assert_true(alone[0] == 0 && alone[1] == 0 && alone[2] == 0.5);
    ad_program_free(two);
    ad_program_free(one);
    ad_tape_free(t);
}

static void test_memory_is_reused(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_input(t, 64, 64, NULL), y = a;
    for (int k = 0; k < 300; k++)
        y = ad_mul(ad_sin(ad_matmul(y, false, a, false)), 0.1);
    assert_true(info_of(t, 1, &y).value_bytes < 12 * 64 * 64 * sizeof(double));
    ad_tape_free(t);
}

/* Equal index lists have one copy; more different ones than are remembered stay apart. */
static void test_many_index_lists(void **state)
{
    (void)state;
    enum { LISTS = 300, N = 6, ROWS = 7 };
    double x[N * N], want[ROWS * N] = {0};
    uint32_t list[ROWS];
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var a = ad_input(t, N, N, "a"), y = ad_scalar(t, 0);
    for (int k = 0; k < N * N; k++)
        x[k] = sin(1 + k);
    for (int k = 0; k < 2 * LISTS; k++) { /* each twice, of rows and of columns */
        for (int i = 0; i < ROWS; i++)
            list[i] = (uint32_t)((k % LISTS * (i + 1) + k % LISTS / N * i) % N);
        y = ad_add(y, ad_gather_rows(ad_gather_cols(a, N, list), ROWS, list));
        for (int i = 0; i < ROWS; i++)
            for (int j = 0; j < N; j++)
                want[i * N + j] += x[list[i] * N + list[j]];
    }
    ad_program *p = compile(t, 1, &y);
    ad_set(p, a, x);
    ad_run(p);
    const double *is = ad_data(p, y);
    for (int k = 0; k < ROWS * N; k++)
        assert_close(is[k], want[k], 1e-12, 1e-12);
    ad_program_free(p);
    ad_tape_free(t);
}

/* A sum computes the product that it alone reads: of matrices and numbers (bits of `numbers`). */
static void check_products(size_t rows, size_t cols, unsigned numbers)
{
    enum { FORMS = 6, N = 3 };
    const size_t n = rows * cols;
    ad_tape *t = ad_tape_new(AD_F64);
    double *x = malloc((N + 1) * n * sizeof *x), *y = x + N * n;
    ad_var in[N];
    for (unsigned k = 0; k < N; k++) {
        bool number = numbers >> k & 1;
        in[k] = ad_input(t, number ? 1 : rows, number ? 1 : cols, NULL);
        for (size_t i = 0; i < n; i++)
            x[k * n + i] = cos(1.3 * (double)(number ? 0 : i) + k);
    }
    ad_var ab = ad_mul(in[0], in[1]), c = in[2];
    ad_var out[FORMS] = {ad_add(ad_mul(2.0, ab), c),       ad_add(c, ad_mul(ab, 3.0)),
                         ad_sub(ad_mul(in[0], c), in[1]),  ad_sub(in[1], ad_mul(c, in[0])),
                         ad_add(ad_square(ad_sin(ab)), c), ad_sub(c, ad_square(ad_cos(ab)))};
    ad_program *p = compile(t, FORMS, out);
    for (unsigned k = 0; k < N; k++)
        assert_int_equal(ad_set(p, in[k], x + k * n), AD_OK);
    ad_run(p);
    for (unsigned f = 0; f < FORMS; f++) {
        if (ad_rows(out[f]) * ad_cols(out[f]) != n)
            continue; /* of numbers alone */
        assert_int_equal(ad_get(p, out[f], y), AD_OK);
        for (size_t i = 0; i < n; i++) {
            double A = x[i], B = x[n + i], C = x[2 * n + i];
            double right[FORMS] = {2 * A * B + C,
                                   C + 3 * A * B,
                                   A * C - B,
                                   B - C * A,
                                   sin(A * B) * sin(A * B) + C,
                                   C - cos(A * B) * cos(A * B)};
            assert_close(y[i], right[f], 0, 4e-15);
        }
    }
    free(x);
    ad_program_free(p);
    ad_tape_free(t);
}

static void test_sums_take_their_products(void **state)
{
    (void)state;
    static const size_t shapes[][2] = {{1, 2}, {3, 5}, {3, 100}, {1, 3001}};
    for (size_t k = 0; k < LENGTH(shapes); k++)
        for (unsigned numbers = 0; numbers < 8; numbers++)
            check_products(shapes[k][0], shapes[k][1], numbers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dead_nodes_are_dropped),
        cmocka_unit_test(test_equal_nodes_are_shared),
        cmocka_unit_test(test_different_nodes_are_not_shared),
        cmocka_unit_test(test_constants_are_folded),
        cmocka_unit_test(test_elementwise_runs_are_one_segment),
        cmocka_unit_test(test_values_wait),
        cmocka_unit_test(test_factors_come_out_of_sums),
        cmocka_unit_test(test_products_add_themselves),
        cmocka_unit_test(test_reciprocals_are_reused),
        cmocka_unit_test(test_sums_take_their_products),
        cmocka_unit_test(test_memory_is_reused),
        cmocka_unit_test(test_many_index_lists),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
