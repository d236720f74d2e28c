/* Operations that move or reduce values: against one-element-at-a-time formulas, adjoint identities
   of the linear ones, first and second order, f32 and f64, several sizes. */
#include "structure_cases.h"
#include "support.h"
#include "autodiff/internal.h"

#include <stdlib.h>

static const size_t sizes[][2] = {{1, 1}, {1, 2}, {3, 7}, {7, 1}, {5, 131}, {130, 5}, {3, 1000}};
enum { N_SIZES = sizeof sizes / sizeof sizes[0] };

/* One case at one size: matrices of random values, and inputs for them on a tape. */
struct trial {
    const struct structure *s;
    size_t n; /* arguments */
    struct matrix m[2];
    const double *at[2];
    ad_tape *tape;
    ad_var x[2];
};

/* All different, evenly spaced. */
static double *spaced_values(uint64_t *state, size_t n)
{
    double *v = random_values(state, n, 0, 1);
    for (size_t k = 0; k < n; k++)
        v[k] = (double)k;
    for (size_t k = n; k-- > 1;) {
        size_t other = below(state, k + 1);
        double swap = v[k];
        v[k] = v[other];
        v[other] = swap;
    }
    for (size_t k = 0; k < n; k++)
        v[k] = (double)(float)(-2 + 4 * (v[k] + 0.37) / (double)n);
    return v;
}

static struct trial begin(const struct structure *s, size_t number, size_t size, enum ad_type type)
{
    uint64_t state = 31 * size + number;
    size_t rows = sizes[size][0], cols = sizes[size][1];
    struct trial t = {.s = s, .n = s->second == NONE ? 1 : 2, .tape = ad_tape_new(type)};
    t.m[0] = (struct matrix){rows, cols, NULL};
    t.m[1] = structure_second(s, rows, cols);
    for (size_t k = 0; k < t.n; k++) {
        size_t n = t.m[k].rows * t.m[k].cols;
        t.at[k] = t.m[k].v =
            s->nature == KINKED ? spaced_values(&state, n) : random_values(&state, n, -2, 2);
        t.x[k] = ad_input(t.tape, t.m[k].rows, t.m[k].cols, NULL);
    }
    return t;
}

static void end(struct trial *t)
{
    for (size_t k = 0; k < t->n; k++)
        free((void *)t->at[k]);
    ad_tape_free(t->tape);
}

typedef void test(struct trial *t);

static void for_each_case(test *f, enum ad_type type)
{
    for (size_t k = 0; structure_case(k); k++) {
        const struct structure *s = structure_case(k);
        for (size_t size = 0; size < N_SIZES; size++)
            if (sizes[size][1] >= s->min_cols) {
                struct trial t = begin(s, k, size, type);
                f(&t);
                end(&t);
            }
    }
}

/* ---- values ---- */

/* Rounding of a sum goes with the sum of absolute values: 2 each, 1000 of them. */
static void compare_values(struct trial *t, double rtol, double atol)
{
    ad_var y = t->s->record(t->x);
    double *v = evaluate(y, t->n, t->x, t->at);
    for (size_t r = 0; r < ad_rows(y); r++)
        for (size_t c = 0; c < ad_cols(y); c++) {
            double expected = t->s->element(t->m, r, c), got = v[r * ad_cols(y) + c];
            if (!is_close(got, expected, rtol, atol))
                fail_msg("%s of %zu x %zu: (%zu, %zu) is %.17g, not %.17g", t->s->name,
                         t->m[0].rows, t->m[0].cols, r, c, got, expected);
        }
    free(v);
}

static void values_f64(struct trial *t) { compare_values(t, 1e-14, 1e-12); }

static void values_f32(struct trial *t) { compare_values(t, 2e-6, 2e-4); }

static void test_values(void **state)
{
    (void)state;
    for_each_case(values_f64, AD_F64);
    for_each_case(values_f32, AD_F32);
}

/* ---- <A x, y> = <x, A' y>, where A' y is the gradient of <A x, y> ---- */

static void adjoint_identity(struct trial *t)
{
    if (t->s->nature != LINEAR)
        return;
    ad_var y = t->s->record(t->x), g[2];
    size_t rows = ad_rows(y), cols = ad_cols(y);
    uint64_t state = 5;
    double *weights = random_values(&state, rows * cols, -2, 2), left = 0, right = 0;
    ad_var dot_y = ad_dot(ad_const(t->tape, rows, cols, weights), y);
    assert_int_equal(ad_grad(dot_y, t->n, t->x, g), AD_OK);
    for (size_t i = 0; i < rows * cols; i++)
        left += weights[i] * t->s->element(t->m, i / cols, i % cols);
    for (size_t k = 0; k < t->n; k++) {
        double *adjoint = evaluate(g[k], t->n, t->x, t->at);
        for (size_t i = 0; i < t->m[k].rows * t->m[k].cols; i++)
            right += t->at[k][i] * adjoint[i];
        free(adjoint);
    }
    if (!is_close(right, left, 1e-13, 1e-10))
        fail_msg("%s of %zu x %zu: <x, A'y> is %.17g, <Ax, y> is %.17g", t->s->name, t->m[0].rows,
                 t->m[0].cols, right, left);
    free(weights);
}

static void test_adjoint_identities(void **state)
{
    (void)state;
    for_each_case(adjoint_identity, AD_F64);
}

/* ---- derivatives, between nonlinear functions so that the second order is not empty ---- */

/* Of kinked cases all is kept apart. */
static ad_var sandwich(struct trial *t)
{
    ad_var inner[2];
    for (size_t k = 0; k < t->n; k++)
        inner[k] = t->s->nature == KINKED ? ad_sinh(t->x[k]) : ad_sin(t->x[k]);
    return weighted_sum(ad_sin(t->s->record(inner)));
}

static void derivatives(struct trial *t)
{
    ad_var y = sandwich(t);
    assert_gradient(t->s->name, y, t->n, t->x, t->at, 1e-7, 15);
    assert_second(t->s->name, y, t->n, t->x, t->at, 1e-6, 9);
}

static void test_derivatives(void **state)
{
    (void)state;
    for_each_case(derivatives, AD_F64);
}

/* ---- every way of running, to third order ---- */

enum { ORDERS = 3, WAY_ROWS = 5, WAY_COLS = 131, MOST_OUT = 3 * ORDERS + 1 };

/* A case recorded with its gradients: y[k] is the sum of those of y[k-1], weighted. */
struct orders {
    struct trial t;
    ad_var y[ORDERS], out[MOST_OUT];
    size_t n_out;
};

static struct orders record_orders(struct trial t)
{
    struct orders o = {.t = t, .y = {sandwich(&t)}};
    for (size_t k = 0; k < ORDERS; k++) {
        ad_var *g = o.out + o.n_out;
        assert_int_equal(ad_grad(o.y[k], t.n, t.x, g), AD_OK);
        o.n_out += t.n;
        if (k + 1 < ORDERS)
            o.y[k + 1] =
                t.n == 1 ? weighted_sum(g[0]) : ad_add(weighted_sum(g[0]), weighted_sum(g[1]));
    }
    return o;
}

static double *run_orders(ad_program *p, const struct orders *o, size_t *n)
{
    double *all = NULL;
    *n = 0;
    for (size_t k = 0; k < o->t.n; k++)
        ad_set(p, o->t.x[k], o->t.at[k]);
    ad_run(p);
    for (size_t k = 0; k < o->n_out; k++) {
        const size_t size = ad_rows(o->out[k]) * ad_cols(o->out[k]);
        all = realloc(all, (*n + size) * sizeof *all);
        assert_non_null(all);
        ad_get(p, o->out[k], all + *n);
        *n += size;
    }
    return all;
}

static void one_way(const struct orders *o)
{
    size_t n;
    ad_program *p = compile(o->t.tape, o->n_out, o->out);
    double *one = run_orders(p, o, &n);
    ad_set_threads(p, 2);
    double *two = run_orders(p, o, &n);
    assert_memory_equal(one, two, n * sizeof *one);
    free(one);
    free(two);
    ad_program_free(p);
}

static void every_way(struct trial *t)
{
    struct orders o = record_orders(*t);
    assert_gradient(t->s->name, o.y[2], t->n, t->x, t->at, 1e-5, 5);
    one_way(&o);
}

static void test_every_way(void **state)
{
    (void)state;
    for_each_case(every_way, AD_F64);
}

/* ---- one value used by several ---- */

/* Rows taken apart and put together again, columns overlapping: adjoints of slices add up. */
static void test_overlapping_slices(void **state)
{
    (void)state;
    uint64_t seed = 12;
    double *values = random_values(&seed, 6 * 301, -1, 1);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 6, 301, NULL);
    ad_var y = ad_scalar(tape, 0);
    for (size_t i = 0; i < 6; i++)
        for (size_t j = 0; j <= i; j++)
            y = ad_add(y, ad_dot(ad_sin(ad_row(x, i)), ad_square(ad_row(x, j))));
    y = ad_add(y, ad_sum(ad_exp(ad_mul(ad_slice_cols(x, 0, 300), ad_slice_cols(x, 1, 300)))));
    y = ad_add(y, ad_sum(ad_cos(ad_slice_rows(ad_slice_cols(x, 7, 100), 2, 3))));
    y = ad_add(y, ad_mean(ad_square(x)));
    const double *const at_x[] = {values};
    assert_gradient("slices", y, 1, &x, at_x, 1e-8, 60);
    assert_second("slices", y, 1, &x, at_x, 1e-7, 40);
    free(values);
    ad_tape_free(tape);
}

/* A pair law: gather, elementwise, scatter; the Hessian is symmetric. */
static void test_pair_law(void **state)
{
    (void)state;
    enum { BODIES = 7, PAIRS = BODIES * (BODIES - 1) / 2, COLS = 33 };
    uint32_t first[PAIRS], second[PAIRS];
    size_t n = 0;
    for (uint32_t i = 0; i < BODIES; i++)
        for (uint32_t j = i + 1; j < BODIES; j++) {
            first[n] = i;
            second[n++] = j;
        }
    uint64_t seed = 13;
    double *values = random_values(&seed, BODIES * COLS, -1, 1);
    const double *const at_x[] = {values};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, BODIES, COLS, "x");
    ad_var d = ad_sub(ad_gather_rows(x, PAIRS, first), ad_gather_rows(x, PAIRS, second));
    ad_var law = ad_recip(ad_sqrt(ad_add(ad_square(d), 0.3)));
    ad_var force = ad_scatter_rows(ad_mul(law, d), first, BODIES);
    ad_var y = ad_add(ad_sum(law), ad_dot(ad_sin(force), x));
    assert_gradient("pair law", y, 1, &x, at_x, 1e-8, 40);
    assert_second("pair law", y, 1, &x, at_x, 1e-7, 40);
    free(values);
    ad_tape_free(tape);
}

/* The tables have every operation that moves or reduces values, in recordings of the cases and of
   their derivatives. Those of elementwise operations expand from ops.def (test_ops.c); loops have a
   table of their own (scan/scan_cases.c). */
static void test_every_operation(void **state)
{
    (void)state;
    bool seen[AD_N_OPS] = {[AD_OP_scan] = true, [AD_OP_scan_adjoint] = true};
    for (size_t k = 0; structure_case(k); k++) {
        struct trial t = begin(structure_case(k), k, 2, AD_F64);
        ad_var g[2];
        ad_grad(weighted_sum(t.s->record(t.x)), t.n, t.x, g);
        assert_tape_ok(t.tape);
        for (uint32_t id = 0; id < t.tape->n_nodes; id++)
            seen[node_at(t.tape, id)->op] = true;
        end(&t);
    }
#define AD_STRUCTURE(name, arity)                                                                  \
    if (!seen[AD_OP_##name])                                                                       \
        fail_msg(#name " is in no case");
#include "autodiff/ops.def"
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_operation),    cmocka_unit_test(test_values),
        cmocka_unit_test(test_adjoint_identities), cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_every_way),          cmocka_unit_test(test_overlapping_slices),
        cmocka_unit_test(test_pair_law),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
