/* Loops against the same steps unrolled: values and derivatives of three orders, in both types,
   interpreted, as machine code and on threads, whatever number of states is stored. */
#include "autodiff/scan/scan.h"
#include "tests/native.h"
#include "scan_cases.h"

#include <stdlib.h>
#include <string.h>

/* Against the largest value: sums of either are in another order. */
static void assert_alike(const char *name, size_t n, const double *a, const double *b,
                         double tolerance)
{
    double largest = 0;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(b[i]));
    for (size_t i = 0; i < n; i++)
        if (!is_close(a[i], b[i], 0, tolerance * (largest + 1)))
            fail_msg("%s: value %zu is %.17g, unrolled %.17g", name, i, a[i], b[i]);
}

static void compare(const struct scan_case *c, enum ad_type type, size_t steps, size_t checkpoints,
                    int order, size_t threads)
{
    size_t n, m;
    double *a = scan_derivatives(c, type, steps, checkpoints, false, order, threads, &n);
    double *b = scan_derivatives(c, type, steps, 0, true, order, 1, &m);
    assert_int_equal(n, m);
    assert_alike(c->name, n, a, b, type == AD_F32 ? 2e-5 : 2e-13);
    free(a);
    free(b);
}

static void test_unrolled(void **state)
{
    (void)state;
    static const size_t steps[] = {1, 2, 7};
    for (size_t k = 0; k < n_scan_cases; k++)
        for (size_t i = 0; i < LENGTH(steps); i++)
            compare(&scan_cases[k], AD_F64, steps[i], 0, i < 2 ? 2 : 3, 1);
}

static void test_unrolled_in_f32(void **state)
{
    (void)state;
    for (size_t k = 0; k < n_scan_cases; k++)
        compare(&scan_cases[k], AD_F32, 5, 2, 2, 1);
}

/* ---- random bodies ---- */

static uint64_t body_seed;

static ad_var random_operation(uint64_t *seed, ad_var a, ad_var b)
{
    switch (below(seed, 12)) {
    case 0:
        return ad_add(a, b);
    case 1:
        return ad_mul(a, b);
    case 2:
        return ad_sin(ad_sub(a, b));
    case 3:
        return ad_max(a, ad_mul(0.5, b));
    case 4:
        return ad_tanh(ad_matmul(a, false, ad_matmul(b, true, a, false), false));
    case 5:
        return ad_add(ad_sum_rows(a), b);
    case 6:
        return ad_mul(ad_sum_cols(a), ad_sigmoid(b));
    case 7:
        return ad_cumsum_rows(ad_mul(0.3, a));
    case 8:
        return ad_gather_rows(a, 3, (const uint32_t[]){2, 0, 0});
    case 9:
        return ad_select(ad_lt(a, b), ad_cos(a), ad_square(b));
    case 10:
        return ad_softmax_rows(ad_add(a, ad_detach(b)));
    default:
        return ad_concat_rows(2, (ad_var[]){ad_slice_rows(a, 1, 2), ad_row(b, 0)});
    }
}

/* Operations on values of 3 x 2 that were there before; states stay within (-1, 1). */
static void random_step(const ad_var s[], const ad_var in[], const ad_var w[], ad_var next[],
                        ad_var out[])
{
    enum { OPERATIONS = 9 };
    uint64_t seed = body_seed;
    ad_var pool[5 + OPERATIONS] = {s[0], s[1], in[0], w[0], ad_mul(w[1], s[0])};
    size_t n = 5;
    for (; n < LENGTH(pool); n++) {
        const size_t i = below(&seed, n), j = below(&seed, n);
        pool[n] = random_operation(&seed, pool[i], pool[j]);
    }
    next[0] = ad_tanh(pool[n - 1]);
    next[1] = below(&seed, 3) ? ad_sin(pool[below(&seed, n)]) : s[0];
    out[0] = ad_sin(pool[below(&seed, n)]);
}

static void test_random_bodies(void **state)
{
    (void)state;
    const struct scan_case c = {"random",         2,           1,  2, 1, {{3, 2}, {3, 2}}, {{3, 2}},
                                {{3, 2}, {3, 1}}, random_step, -1, 1};
    uint64_t seed = 41;
    for (int k = 0; k < 30; k++) {
        body_seed = random_bits(&seed);
        const size_t steps = 1 + below(&seed, 6), stored = below(&seed, steps + 1);
        compare(&c, AD_F64, steps, stored, 2, 1);
        if (k % 5 == 0)
            compare(&c, AD_F32, steps, stored, 1, 1);
    }
}

/* ---- whatever is stored, and on whatever it runs ---- */

static void assert_bits(const struct scan_case *c, size_t steps, size_t checkpoints, size_t threads,
                        size_t n, const double *expected)
{
    size_t m;
    double *a = scan_derivatives(c, AD_F64, steps, checkpoints, false, 2, threads, &m);
    assert_int_equal(m, n);
    if (memcmp(a, expected, n * sizeof *a))
        fail_msg("%s: %zu steps, %zu checkpoints, %zu threads", c->name, steps, checkpoints,
                 threads);
    free(a);
}

static void test_checkpoints(void **state)
{
    (void)state;
    for (size_t k = 0; k < n_scan_cases; k++)
        for (size_t steps = 1; steps <= 13; steps += steps < 5 ? 1 : 4) {
            size_t n;
            const struct scan_case *c = &scan_cases[k];
            double *all = scan_derivatives(c, AD_F64, steps, 0, false, 2, 1, &n);
            for (size_t stored = 1; stored <= steps; stored += stored < 3 ? 1 : 3)
                assert_bits(c, steps, stored, 1, n, all);
            assert_bits(c, steps, 2, 3, n, all);
            free(all);
        }
}

static void test_machine_code(void **state)
{
    (void)state;
    native_need_compiler();
    compare(scan_case_named("layer"), AD_F64, 6, 2, 2, 0);
    compare(scan_case_named("branches"), AD_F32, 6, 2, 1, 0);
}

/* ---- the schedule ---- */

/* Steps forward to go back through l with s stored, by trying all places. */
static size_t fewest(size_t l, size_t s)
{
    static size_t known[65][9];
    if (l == 1)
        return 0;
    if (s == 1)
        return l * (l - 1) / 2;
    if (!known[l][s]) {
        size_t best = SIZE_MAX;
        for (size_t m = 1; m < l; m++) {
            size_t work = m + fewest(l - m, s - 1) + fewest(m, s);
            best = work < best ? work : best;
        }
        known[l][s] = best;
    }
    return known[l][s];
}

static size_t work_of(size_t l, size_t s)
{
    if (l == 1)
        return 0;
    if (s == 1)
        return l * (l - 1) / 2;
    size_t m = ad_checkpoint_after(l, s - 1);
    assert_in_range(m, 1, l - 1);
    return m + work_of(l - m, s - 1) + work_of(m, s);
}

static void test_schedule(void **state)
{
    (void)state;
    for (size_t l = 1; l <= 64; l++)
        for (size_t s = 1; s <= 8; s++)
            assert_int_equal(work_of(l, s), fewest(l, s));
    size_t far = ad_checkpoint_after(INT32_MAX, 9); /* (s, r) = (10, 31): 10 ... 11 C(41, 10) */
    assert_in_range(far, 1, INT32_MAX - 1);
}

/* ---- logistic map: x[n] = sin^2(2^n theta) ---- */

static void test_logistic(void **state)
{
    (void)state;
    enum { STEPS = 9 };
    const double theta = 0.37, x = sin(theta) * sin(theta), S = sin(2 * theta), C = cos(2 * theta),
                 N = 1 << STEPS, s = sin(2 * N * theta), c = cos(2 * N * theta);
    const double expected[] = {
        0.5 - 0.5 * c, N * s / S, N * (2 * N * c * S - 2 * s * C) / pow(S, 3),
        N * ((4 - 4 * N * N) * s / pow(S, 3) - 6 * C * (2 * N * c * S - 2 * s * C) / pow(S, 5))};
    struct scan_made m = scan_make(scan_case_named("logistic"), AD_F64, STEPS, 3, false);
    ad_var d[4] = {m.last[0]};
    for (int k = 1; k < 4; k++)
        ad_grad(d[k - 1], 1, m.x, &d[k]);
    ad_program *p = compile(m.tape, 4, d);
    ad_set(p, m.x[0], &x);
    ad_set(p, m.x[1], &(double){4});
    ad_run(p);
    for (int k = 0; k < 4; k++) {
        double value;
        ad_get(p, d[k], &value);
        assert_close(value, expected[k], 1e-9, 1e-9 * pow(N, k));
    }
    ad_program_free(p);
    ad_tape_free(m.tape);
}

/* ---- 1e5 steps of an integrator against the same steps on dual numbers ---- */

struct dual {
    double v, d;
};

static struct dual plus(struct dual a, double c, struct dual b)
{
    return (struct dual){a.v + c * b.v, a.d + c * b.d};
}

static struct dual force(struct dual k, struct dual q)
{
    return (struct dual){k.v * sin(q.v), k.d * sin(q.v) + k.v * cos(q.v) * q.d};
}

static void test_integrator(void **state)
{
    (void)state;
    enum { STEPS = 100000 };
    const double at[] = {0.9, 0.2, 1.1};
    const struct scan_case *c = scan_case_named("pendulum");
    struct scan_made m = scan_make(c, AD_F64, STEPS, 1000, false);
    ad_var of = ad_row(m.last[0], 0), g[3];
    ad_grad(of, 3, m.x, g);
    ad_program *p = compile(m.tape, 3, g);
    for (int k = 0; k < 3; k++)
        ad_set(p, m.x[k], (double[]){at[k], at[k], at[k]});
    ad_run(p);
    for (int k = 0; k < 3; k++) {
        double slope[3];
        struct dual q = {at[0], k == 0}, v = {at[1], k == 1}, w = {at[2], k == 2};
        for (int t = 0; t < STEPS; t++) {
            struct dual half = plus(v, -0.05, force(w, q));
            q = plus(q, 0.1, half);
            v = plus(half, -0.05, force(w, q));
        }
        ad_get(p, g[k], slope); /* three columns of q and p, of one parameter */
        assert_close(slope[0], k == 2 ? 3 * q.d : q.d, 1e-7, 0);
    }
    ad_program_free(p);
    ad_tape_free(m.tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unrolled),    cmocka_unit_test(test_unrolled_in_f32),
        cmocka_unit_test(test_checkpoints), cmocka_unit_test(test_machine_code),
        cmocka_unit_test(test_schedule),    cmocka_unit_test(test_logistic),
        cmocka_unit_test(test_integrator),  cmocka_unit_test(test_random_bodies),
    };
    return cmocka_run_group_tests_name("scan", tests, NULL, NULL);
}
