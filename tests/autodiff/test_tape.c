/* Recording and compiling: sticky errors, reuse, what compiling drops, folds and shares, outputs of
   every kind, deep and large tapes, and the report of the first value that is not finite. */
#include "support.h"
#include "../../autodiff/clock.h"

#include <float.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>

static void assert_mentions(const char *message, const char *text)
{
    if (!strstr(message, text))
        fail_msg("\"%s\" does not mention \"%s\"", message, text);
}

static struct ad_program_info info_of(ad_tape *tape, size_t n, const ad_var out[])
{
    ad_program *p = compile(tape, n, out);
    struct ad_program_info info = ad_program_info(p);
    ad_program_free(p);
    return info;
}

/* ---- errors ---- */

static void assert_error(ad_tape *tape, enum ad_status status, const char *op, const char *shape)
{
    const struct ad_error *e = ad_tape_error(tape);
    assert_int_equal(e->status, status);
    assert_mentions(e->message, op);
    assert_mentions(e->message, shape);
    ad_tape_reset(tape);
    assert_int_equal(ad_tape_error(tape)->status, AD_OK);
}

static void test_shape_errors(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    const uint32_t beyond[] = {0, 3};
    ad_add(ad_input(t, 3, 7, NULL), ad_input(t, 3, 8, NULL));
    assert_error(t, AD_E_SHAPE, "add", "3 x 8");
    ad_atan2(ad_input(t, 2, 5, NULL), ad_input(t, 3, 1, NULL));
    assert_error(t, AD_E_SHAPE, "atan2", "2 x 5");
    ad_select(ad_input(t, 2, 5, NULL), ad_input(t, 2, 1, NULL), ad_input(t, 3, 1, NULL));
    assert_error(t, AD_E_SHAPE, "select", "3 x 1");
    ad_matmul(ad_input(t, 3, 7, NULL), false, ad_input(t, 7, 2, NULL), true);
    assert_error(t, AD_E_SHAPE, "matmul", "3 x 7");
    ad_slice_rows(ad_input(t, 3, 7, NULL), 2, 2);
    assert_error(t, AD_E_SHAPE, "slice", "3 x 7");
    ad_slice_cols(ad_input(t, 3, 7, NULL), 1, SIZE_MAX);
    assert_error(t, AD_E_SHAPE, "slice", "3 x 7");
    ad_col(ad_input(t, 3, 7, NULL), 7);
    assert_error(t, AD_E_SHAPE, "slice", "3 x 7");
    ad_reshape(ad_input(t, 3, 7, NULL), 4, 5);
    assert_error(t, AD_E_SHAPE, "reshape", "4 x 5");
    ad_broadcast(ad_input(t, 3, 7, NULL), 6, 7);
    assert_error(t, AD_E_SHAPE, "broadcast", "6 x 7");
    ad_gather_rows(ad_input(t, 3, 7, NULL), 2, beyond);
    assert_error(t, AD_E_SHAPE, "gather", "3");
    ad_scatter_rows(ad_input(t, 2, 7, NULL), beyond, 3);
    assert_error(t, AD_E_SHAPE, "scatter", "3");
    ad_diff(ad_input(t, 3, 1, NULL), 1, false);
    assert_error(t, AD_E_SHAPE, "diff", "3 x 1");
    ad_concat_rows(2, (ad_var[]){ad_input(t, 3, 7, NULL), ad_input(t, 3, 6, NULL)});
    assert_error(t, AD_E_SHAPE, "", "");
    ad_place(t, 4, 4, 1, (ad_var[]){ad_input(t, 3, 3, NULL)}, (size_t[]){2}, (size_t[]){0});
    assert_error(t, AD_E_SHAPE, "place", "4 x 4");
    ad_input(t, 0, 5, NULL);
    assert_error(t, AD_E_SHAPE, "input", "0 x 5");
    ad_input(t, SIZE_MAX / 2, 5, NULL);
    assert_error(t, AD_E_SHAPE, "input", "");
    ad_tape_free(t);
}

/* The first error is kept, everything after passes through, ad_grad and ad_compile return it. */
static void test_errors_are_sticky(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 7, NULL), g;
    ad_var wrong = ad_mul(x, ad_input(t, 2, 7, NULL));
    ad_var y = ad_sum(ad_exp(ad_matmul(wrong, false, ad_row(wrong, 90), false)));
    assert_int_equal(ad_grad(y, 1, &x, &g), AD_E_SHAPE);
    ad_program *p = (ad_program *)t;
    assert_int_equal(ad_compile(t, 1, &y, &p), AD_E_SHAPE);
    assert_null(p);
    assert_mentions(ad_tape_error(t)->message, "mul");
    assert_null(strchr(ad_tape_error(t)->message, '\n'));
    ad_tape_free(t);
}

static void test_variables_of_two_tapes(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64), *other = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 4, NULL), y = ad_input(other, 1, 4, NULL), g;
    ad_add(x, y);
    assert_error(t, AD_E_TAPE, "add", "tape");
    x = ad_input(t, 4, 4, NULL);
    ad_matmul(x, false, ad_input(other, 4, 4, NULL), false);
    assert_error(t, AD_E_TAPE, "matmul", "tape");
    ad_concat_rows(2, (ad_var[]){ad_input(t, 1, 4, NULL), y});
    assert_error(t, AD_E_TAPE, "", "tape");
    x = ad_sum(ad_input(t, 4, 4, NULL));
    assert_int_equal(ad_grad(x, 1, &y, &g), AD_E_TAPE);
    assert_error(t, AD_E_TAPE, "grad", "tape");
    ad_program *p;
    assert_int_equal(ad_compile(t, 1, &y, &p), AD_E_TAPE);
    assert_null(p);
    ad_tape_free(t);
    ad_tape_free(other);
}

static void test_setting_and_getting_strangers(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 4, NULL), unused = ad_input(t, 1, 4, NULL);
    ad_var inner = ad_sin(x), y = ad_sum(inner);
    ad_program *p = compile(t, 1, &y);
    double v[4] = {1, 2, 3, 4};
    assert_int_equal(ad_set(p, x, v), AD_OK);
    assert_int_equal(ad_set(p, unused, v), AD_OK);
    assert_int_equal(ad_set(p, inner, v), AD_E_TAPE);
    assert_int_equal(ad_set(p, y, v), AD_E_TAPE);
    assert_int_equal(ad_get(p, inner, v), AD_E_TAPE);
    assert_null(ad_data(p, inner));
    assert_non_null(ad_data(p, x));
    ad_program_free(p);
    ad_program_free(NULL);
    ad_tape_free(t);
    ad_tape_free(NULL);
}

static void test_fail_keeps_the_first(void **state)
{
    (void)state;
    struct ad_error e = {0};
    char text[600];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = 0;
    assert_int_equal(ad_fail(&e, AD_E_IO, "%s", text), AD_E_IO);
    assert_int_equal(strlen(e.message), sizeof e.message - 1);
    assert_int_equal(ad_fail(&e, AD_E_SHAPE, "second"), AD_E_IO);
    assert_true(e.message[0] == 'x');
}

/* ---- reuse ---- */

/* A reset tape keeps its memory; programs outlive it. */
static void test_reset_and_reuse(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    size_t bytes = 0;
    ad_program *kept = NULL;
    ad_var first_x = {0}, first_y = {0};
    for (int round = 0; round < 5; round++) {
        ad_var x = ad_input(t, 2, 3, "x"), y = x, g;
        for (int k = 0; k < 20000; k++)
            y = ad_sin(ad_add(y, 0.1 * round));
        assert_int_equal(ad_grad(ad_sum(y), 1, &x, &g), AD_OK);
        if (round == 0) {
            kept = compile(t, 1, &y);
            first_x = x;
            first_y = y;
        }
        if (round > 1)
            assert_int_equal(ad_tape_bytes(t), bytes);
        bytes = ad_tape_bytes(t);
        ad_tape_reset(t);
        assert_true(ad_tape_size(t) < 10);
    }
    ad_tape_free(t);
    double v[6] = {1, 2, 3, 4, 5, 6};
    assert_int_equal(ad_set(kept, first_x, v), AD_OK);
    ad_run(kept);
    assert_int_equal(ad_get(kept, first_y, v), AD_OK);
    double expected = 1;
    for (int k = 0; k < 20000; k++)
        expected = sin(expected);
    assert_close(v[0], expected, 1e-10, 0);
    ad_program_free(kept);
}

/* ---- what compiling makes of it ---- */

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
   exp x is read by a product as well, so it is kept, whoever else reads it. */
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
    size_t alone = info_of(t, 1, &xxx).value_bytes, bytes = info_of(t, 1, &waits).value_bytes;
    assert_true(bytes < alone + (N * N + N * N / 2) * sizeof(double));
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

/* ---- outputs of every kind ---- */

static void test_unusual_outputs(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    double v[] = {1, 2, 3, 4, 5, 6}, c[] = {0.5, 1.5}, got[6];
    ad_var x = ad_input(t, 2, 3, "x"), constant = ad_const(t, 2, 1, c), row = ad_row(x, 1);
    ad_var shape = ad_reshape(x, 3, 2), wide = ad_broadcast(constant, 2, 3);
    ad_var out[] = {x, constant, row, row, shape, wide, ad_col(shape, 1), ad_transpose(row)};
    ad_program *p = compile(t, sizeof out / sizeof out[0], out);
    double *storage[8];
    for (int k = 0; k < 8; k++) {
        storage[k] = ad_data(p, out[k]);
        assert_non_null(storage[k]);
    }
    assert_ptr_equal(storage[2], storage[3]);
    for (int round = 0; round < 2; round++) {
        assert_int_equal(ad_set(p, x, v), AD_OK);
        ad_run(p);
        const double expected[8][6] = {{v[0], v[1], v[2], v[3], v[4], v[5]},
                                       {0.5, 1.5},
                                       {v[3], v[4], v[5]},
                                       {v[3], v[4], v[5]},
                                       {v[0], v[1], v[2], v[3], v[4], v[5]},
                                       {0.5, 0.5, 0.5, 1.5, 1.5, 1.5},
                                       {v[1], v[3], v[5]},
                                       {v[3], v[4], v[5]}};
        for (int k = 0; k < 8; k++) {
            size_t n = ad_rows(out[k]) * ad_cols(out[k]);
            assert_int_equal(ad_get(p, out[k], got), AD_OK);
            assert_memory_equal(got, expected[k], n * sizeof *got);
            assert_memory_equal(storage[k], expected[k], n * sizeof *got);
        }
        for (int i = 0; i < 6; i++)
            v[i] += 10;
    }
    ad_program_free(p);
    ad_tape_free(t);
}

/* ad_data is the storage itself, for both types; writing there is setting. */
static void test_data_is_the_storage(void **state)
{
    (void)state;
    for (enum ad_type type = AD_F32; type <= AD_F64; type++) {
        ad_tape *t = ad_tape_new(type);
        ad_var x = ad_input(t, 2, 129, NULL), y = ad_mul(3.0, x);
        ad_program *p = compile(t, 1, &y);
        void *in = ad_data(p, x), *out = ad_data(p, y);
        for (size_t i = 0; i < 2 * 129; i++) {
            double value = 0.25 * (double)i;
            if (type == AD_F32)
                ((float *)in)[i] = (float)value;
            else
                ((double *)in)[i] = value;
        }
        ad_run(p);
        assert_ptr_equal(in, ad_data(p, x));
        assert_ptr_equal(out, ad_data(p, y));
        for (size_t i = 0; i < 2 * 129; i++) {
            double got = type == AD_F32 ? (double)((float *)out)[i] : ((double *)out)[i];
            assert_true(got == 0.75 * (double)i);
        }
        ad_program_free(p);
        ad_tape_free(t);
    }
}

static void test_inputs_start_at_zero(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 3, 100, NULL), y = ad_sum(ad_cos(x));
    assert_close(evaluate_scalar(y, 0, NULL, NULL), 300, 0, 0);
    ad_tape_free(t);
}

static void test_gradient_of_what_does_not_depend(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 3, NULL), other = ad_input(t, 3, 1, NULL), g[2];
    ad_var y = ad_sum(ad_sin(x)), late;
    assert_int_equal(ad_grad(y, 2, (ad_var[]){other, x}, g), AD_OK);
    late = ad_input(t, 1, 4, NULL);
    ad_var h;
    assert_int_equal(ad_grad(y, 1, &late, &h), AD_OK);
    assert_int_equal(ad_rows(g[0]), 3);
    assert_int_equal(ad_cols(h), 4);
    double *zero = evaluate(g[0], 0, NULL, NULL), *none = evaluate(h, 0, NULL, NULL);
    for (int i = 0; i < 3; i++)
        assert_true(zero[i] == 0 && none[i] == 0);
    free(zero);
    free(none);
    ad_tape_free(t);
}

/* y itself, the same x twice, and an x that is no input. */
static void test_gradient_by_inner_values(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 2, 3, NULL), inner = ad_square(x), y = ad_sin(inner), g[4];
    double v[] = {1, 2, 3, 4, 5, 6}, got[6];
    assert_int_equal(ad_grad(y, 4, (ad_var[]){y, inner, x, x}, g), AD_OK);
    ad_program *p = compile(t, 4, g);
    ad_set(p, x, v);
    ad_run(p);
    for (int i = 0; i < 6; i++) {
        ad_get(p, g[0], got);
        assert_true(got[i] == 1);
        ad_get(p, g[1], got);
        assert_close(got[i], cos(v[i] * v[i]), 1e-14, 0);
        ad_get(p, g[2], got);
        assert_close(got[i], 2 * v[i] * cos(v[i] * v[i]), 1e-14, 0);
        ad_get(p, g[3], got);
        assert_close(got[i], 2 * v[i] * cos(v[i] * v[i]), 1e-14, 0);
    }
    ad_program_free(p);
    ad_tape_free(t);
}

/* ---- size ---- */

/* Heap in use, large mapped blocks included. */
static size_t heap_bytes(void)
{
#if defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
    struct mallinfo2 m = mallinfo2();
    return m.uordblks + m.hblkhd;
#else
    return 0;
#endif
}

/* Recursion would need a stack far beyond what a process has. */
static void test_a_deep_chain(void **state)
{
    (void)state;
    enum { DEPTH = 1000000 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, NULL), y = x, g;
    for (int k = 0; k < DEPTH / 2; k++)
        y = ad_sin(ad_add(y, 0.25));
    assert_true(ad_tape_size(t) >= DEPTH);
    assert_int_equal(ad_grad(y, 1, &x, &g), AD_OK);
    double at = 0.3, value = at, slope = 1;
    for (int k = 0; k < DEPTH / 2; k++) {
        slope *= cos(value + 0.25);
        value = sin(value + 0.25);
    }
    ad_program *p = compile(t, 2, (ad_var[]){y, g});
    ad_set(p, x, &at);
    ad_run(p);
    double got;
    ad_get(p, y, &got);
    assert_close(got, value, 1e-12, 0);
    ad_get(p, g, &got);
    assert_close(got, slope, 1e-9, 1e-300);
    ad_program_free(p);
    ad_tape_free(t);
}

/* A million nodes: memory by the library's own account and by the heap. */
static void test_a_million_nodes(void **state)
{
    (void)state;
    enum { NODES = 1000000 };
    size_t before = heap_bytes();
    double start = ad_now();
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, 1, NULL), y = x, z = ad_cos(x);
    while (ad_tape_size(t) < NODES) {
        y = ad_mul(ad_sin(y), z);
        z = ad_add(z, y);
    }
    ad_program *p = compile(t, 1, &z);
    double elapsed = ad_now() - start;
    struct ad_program_info info = ad_program_info(p);
    size_t heap = heap_bytes() - before, nodes = ad_tape_size(t);
    assert_true(info.nodes > NODES - 1000);
    assert_true(ad_tape_bytes(t) + info.bytes < 200 * nodes);
    if (before)
        assert_true(heap < 200 * nodes + info.value_bytes);
    print_message("%zu nodes: %.2f s, %.0f bytes a node on the tape, %.0f in the program, "
                  "%.0f on the heap\n",
                  nodes, elapsed, (double)ad_tape_bytes(t) / (double)nodes,
                  (double)info.bytes / (double)nodes, (double)heap / (double)nodes);
    double at = 0.7, got;
    ad_set(p, x, &at);
    ad_run(p);
    ad_get(p, z, &got);
    assert_true(isfinite(got));
    ad_program_free(p);
    ad_tape_free(t);
}

/* ---- the first value that is not finite ---- */

static void assert_nonfinite(ad_program *p, const char *op, const char *label, const char *where)
{
    struct ad_error e = {0};
    assert_int_equal(ad_run_checked(p, &e), AD_E_NONFINITE);
    assert_int_equal(e.status, AD_E_NONFINITE);
    assert_mentions(e.message, op);
    assert_mentions(e.message, label);
    assert_mentions(e.message, where);
}

static void test_check_mode(void **state)
{
    (void)state;
    enum { N = 777 };
    ad_tape *t = ad_tape_new(AD_F64);
    double v[2 * N];
    for (size_t i = 0; i < 2 * N; i++)
        v[i] = 1 + 0.001 * (double)i;
    ad_var x = ad_input(t, 2, N, "position");
    ad_var r = ad_label(ad_sqrt(ad_sub(x, 0.5)), "radius"), u = ad_label(ad_log(r), "potential");
    ad_var y = ad_sum(ad_mul(ad_exp(u), ad_cos(u)));
    ad_program *p = compile(t, 1, &y);
    struct ad_error e = {0};
    ad_set(p, x, v);
    assert_int_equal(ad_run_checked(p, &e), AD_OK);
    assert_int_equal(e.status, AD_OK);

    v[N + 300] = 0.25;
    ad_set(p, x, v);
    assert_nonfinite(p, "sqrt", "radius", "row 1, column 300");
    v[N + 300] = 0.5;
    ad_set(p, x, v);
    assert_nonfinite(p, "log", "potential", "row 1, column 300");
    v[N + 300] = NAN;
    ad_set(p, x, v);
    assert_nonfinite(p, "input", "position", "row 1, column 300");
    ad_program_free(p);
    ad_tape_free(t);
}

/* The first in the order of recording, not of execution or of columns. */
static void test_check_mode_names_the_first(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F32);
    double v[300] = {0};
    ad_var x = ad_input(t, 1, 300, NULL);
    ad_var early = ad_label(ad_recip(ad_sub(x, 7.0)), "early");
    ad_var late = ad_label(ad_recip(x), "late");
    ad_var y = ad_add(ad_sum(late), ad_sum(early));
    for (int i = 0; i < 300; i++)
        v[i] = 1 + i;
    v[5] = 0;
    ad_program *p = compile(t, 1, &y);
    ad_set(p, x, v);
    assert_nonfinite(p, "recip", "early", "column 6");
    ad_program_free(p);
    ad_tape_free(t);
}

/* f32 in SI units: the product of two masses is infinite, and said so. */
static void test_check_mode_in_f32(void **state)
{
    (void)state;
    ad_tape *t = ad_tape_new(AD_F32);
    ad_var sun = ad_input(t, 1, 1, "sun"), earth = ad_input(t, 1, 1, "earth");
    ad_var y = ad_label(ad_mul(sun, earth), "mass product");
    double a = 1.99e30, b = 5.97e24;
    ad_program *p = compile(t, 1, &y);
    ad_set(p, sun, &a);
    ad_set(p, earth, &b);
    assert_nonfinite(p, "mul", "mass product", "inf");
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shape_errors),
        cmocka_unit_test(test_errors_are_sticky),
        cmocka_unit_test(test_variables_of_two_tapes),
        cmocka_unit_test(test_setting_and_getting_strangers),
        cmocka_unit_test(test_fail_keeps_the_first),
        cmocka_unit_test(test_reset_and_reuse),
        cmocka_unit_test(test_dead_nodes_are_dropped),
        cmocka_unit_test(test_equal_nodes_are_shared),
        cmocka_unit_test(test_different_nodes_are_not_shared),
        cmocka_unit_test(test_constants_are_folded),
        cmocka_unit_test(test_elementwise_runs_are_one_segment),
        cmocka_unit_test(test_values_wait),
        cmocka_unit_test(test_products_add_themselves),
        cmocka_unit_test(test_memory_is_reused),
        cmocka_unit_test(test_unusual_outputs),
        cmocka_unit_test(test_data_is_the_storage),
        cmocka_unit_test(test_inputs_start_at_zero),
        cmocka_unit_test(test_gradient_of_what_does_not_depend),
        cmocka_unit_test(test_gradient_by_inner_values),
        cmocka_unit_test(test_a_deep_chain),
        cmocka_unit_test(test_a_million_nodes),
        cmocka_unit_test(test_check_mode),
        cmocka_unit_test(test_check_mode_names_the_first),
        cmocka_unit_test(test_check_mode_in_f32),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
