/* Power series at branches, numbers, extreme values and values in common; refusals. */
#include "tests/mentions.h"
#include "autodiff/series/internal.h"
#include "tests/close.h"

#include <float.h>
#include <math.h>

static void test_branches_are_counted_and_taken(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x"), g;
    ad_var y[3] = {ad_abs(x), ad_max(ad_cube(x), ad_mul(2.0, x)), ad_hypot(x, 3.0)};
    ad_series *series;
    assert_int_equal(ad_series_new(3, y, 1, &x, 2, &series), AD_OK);
    assert_int_equal(ad_series_branches(series), 2);
    const double at[] = {-2, -0.5}, larger[][3] = {{-4, 2, 0}, {-0.125, 0.75, -1.5}};
    for (size_t p = 0; p < 2; p++) {
        for (size_t k = 0; k <= 2; k++) {
            ad_series_input(series, 0, 0)[k] = k == 0 ? at[p] : k == 1;
            ad_series_advance(series, k);
        }
        assert_close(ad_series_output(series, 0, 0)[1], -1, 0, 0);
        for (size_t k = 0; k <= 2; k++)
            assert_close(ad_series_output(series, 1, 0)[k], larger[p][k], 1e-15, 0);
    }
    ad_series_free(series);
    /* no kink: the gradient of a power asks whether its base is 0 */
    assert_int_equal(ad_grad(ad_pow(ad_add(1.0, ad_square(x)), -1.5), 1, &x, &g), AD_OK);
    assert_int_equal(ad_series_new(1, &g, 1, &x, 2, &series), AD_OK);
    assert_int_equal(ad_series_branches(series), 0);
    ad_series_free(series);
    ad_tape_free(tape);
}

static void test_numbers_are_known(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 2, 1, "x"), unused = ad_input(tape, 1, 1, "unused");
    ad_var y[2] = {ad_add(ad_mul(x, 0.0), 3.0), ad_sin(x)}, in[2] = {unused, x};
    ad_series *series;
    assert_int_equal(ad_series_new(2, y, 2, in, 1, &series), AD_OK);
    assert_true(ad_series_is_number(series, 0, 1));
    assert_false(ad_series_is_number(series, 1, 1));
    for (size_t k = 0; k <= 1; k++) {
        ad_series_input(series, 1, 1)[k] = 1;
        ad_series_advance(series, k);
    }
    assert_close(ad_series_output(series, 0, 0)[0], 3, 0, 0);
    assert_close(ad_series_output(series, 0, 0)[1], 0, 0, 0);
    assert_close(ad_series_output(series, 1, 1)[1], cos(1), 1e-15, 0);
    ad_series_free(series);
    ad_tape_free(tape);
}

/* NaN goes through branches, and numbers are not merged where that over- or underflows. */
static void test_extreme_values(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x"), z = ad_input(tape, 1, 1, "z"), in[2] = {x, z};
    ad_var y[5] = {ad_relu(ad_log(x)), ad_max(ad_log(x), 0.5), ad_min(0.5, ad_log(x)),
                   ad_mul(ad_mul(1e-200, z), ad_mul(1e-200, ad_neg(z))), ad_div(z, 1e-310)};
    ad_series *series;
    assert_int_equal(ad_series_new(5, y, 2, in, 0, &series), AD_OK);
    *ad_series_input(series, 0, 0) = -1;
    *ad_series_input(series, 1, 0) = 1e150;
    ad_series_advance(series, 0);
    for (size_t k = 0; k < 3; k++)
        assert_true(isnan(*ad_series_output(series, k, 0)));
    assert_close(*ad_series_output(series, 3, 0), -1e-100, 1e-15, 0);
    *ad_series_input(series, 1, 0) = 1e-310;
    ad_series_advance(series, 0);
    assert_close(*ad_series_output(series, 4, 0), 1, 1e-10, 0);
    ad_series_free(series);
    ad_tape_free(tape);
}

/* What is common is carried once: sine and cosine of one angle, and their derivatives. */
static void test_common_values_are_one(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x"), again = ad_broadcast(x, 1, 5);
    ad_var y = ad_add(ad_sum(ad_mul(ad_sin(again), ad_cos(again))), ad_mul(ad_cos(x), ad_sin(x)));
    ad_series *series;
    assert_int_equal(ad_series_new(1, &y, 1, &x, 3, &series), AD_OK);
    assert_in_range(series->n, 5, 12);
    ad_series_free(series);
    ad_tape_free(tape);
}

/* ---- common factors ---- */

enum { UNKNOWNS = 5, TOP = 6, SUM_MOST = 20 };

struct number {
    ad_var y;
    double c[TOP + 1], size[TOP + 1]; /* by plain multiplication; the same of absolute values */
};

static struct number multiply(const struct number *a, const struct number *b)
{
    struct number r = {.y = ad_mul(a->y, b->y)};
    for (size_t i = 0; i <= TOP; i++)
        for (size_t j = 0; i + j <= TOP; j++) {
            r.c[i + j] += a->c[i] * b->c[j];
            r.size[i + j] += a->size[i] * b->size[j];
        }
    return r;
}

static struct number add(const struct number *a, double by, const struct number *b)
{
    struct number r = {.y = ad_add(a->y, ad_mul(by, b->y))};
    for (size_t k = 0; k <= TOP; k++) {
        r.c[k] = a->c[k] + by * b->c[k];
        r.size[k] = a->size[k] + fabs(by) * b->size[k];
    }
    return r;
}

static double next(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*seed >> 11) / 9007199254740992.0;
}

/* A sum of products of few unknowns, times one of them: most have common factors. */
static struct number random_sum(const struct number *x, uint64_t *seed)
{
    const size_t terms = 1 + (size_t)(SUM_MOST * next(seed) * next(seed));
    struct number sum = {0};
    for (size_t i = 0; i <= terms; i++) {
        struct number term = x[(size_t)(UNKNOWNS * next(seed))];
        for (size_t k = (size_t)(5 * next(seed)); k > 0; k--) {
            const struct number *f = &x[(size_t)(UNKNOWNS * next(seed))];
            term = next(seed) < 0.5 ? multiply(&term, f) : multiply(f, &term);
        }
        const double by = next(seed) < 0.5 ? -1 : next(seed) < 0.5 ? 1 : 3 * next(seed);
        sum = i == 0 ? term : next(seed) < 0.5 ? add(&sum, by, &term) : add(&term, by, &sum);
    }
    return multiply(&sum, &x[(size_t)(UNKNOWNS * next(seed))]);
}

static void test_common_factors_leave_the_series(void **state)
{
    (void)state;
    uint64_t seed = 7;
    ad_tape *tape = ad_tape_new(AD_F64);
    for (size_t round = 0; round < 100; round++) {
        struct number x[UNKNOWNS] = {{.y = {0}}};
        ad_var in[UNKNOWNS], y[2];
        ad_series *series;
        ad_tape_reset(tape);
        for (size_t i = 0; i < UNKNOWNS; i++) {
            x[i].y = in[i] = ad_input(tape, 1, 1, "x");
            for (size_t k = 0; k <= TOP; k++) {
                x[i].c[k] = 2 * next(&seed) - 1;
                x[i].size[k] = fabs(x[i].c[k]);
            }
        }
        const struct number a = random_sum(x, &seed), b = random_sum(x, &seed),
                            c = add(&b, -2, &a), *const expected[] = {&a, &c};
        for (size_t j = 0; j < 2; j++)
            y[j] = expected[j]->y;
        assert_int_equal(ad_series_new(2, y, UNKNOWNS, in, TOP, &series), AD_OK);
        for (size_t k = 0; k <= TOP; k++) {
            for (size_t i = 0; i < UNKNOWNS; i++)
                ad_series_input(series, i, 0)[k] = x[i].c[k];
            ad_series_advance(series, k);
            for (size_t j = 0; j < 2; j++)
                assert_close(ad_series_output(series, j, 0)[k], expected[j]->c[k], 0,
                             1e-14 * expected[j]->size[k]);
        }
        ad_series_free(series);
    }
    ad_tape_free(tape);
}

/* u a c + u b d + v a c + v b d, in any order: (u + v) (a c + b d). */
static void test_common_factors_are_found(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x[6], term[4], y;
    ad_series *series;
    for (size_t k = 0; k < 6; k++)
        x[k] = ad_input(tape, 1, 1, "x");
    term[0] = ad_mul(x[0], ad_mul(x[2], x[4]));
    term[1] = ad_mul(ad_mul(x[5], x[1]), x[3]);
    term[2] = ad_mul(x[5], ad_mul(x[3], x[0]));
    term[3] = ad_mul(x[4], ad_mul(x[2], x[1]));
    y = ad_sub(ad_add(term[0], term[1]), ad_neg(ad_add(term[2], term[3])));
    assert_int_equal(ad_series_new(1, &y, 6, x, 3, &series), AD_OK);
    assert_int_equal(series->n, 6 + 3 + 2);
    ad_series_free(series);
    ad_tape_free(tape);
}

/* A compiler would take minutes for these. */
static void test_long_series_are_interpreted(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x"), y = x;
    ad_series *series;
    struct ad_error note = {0};
    for (int k = 0; k < 5000; k++)
        y = ad_sin(y);
    assert_int_equal(ad_series_new(1, &y, 1, &x, 2, &series), AD_OK);
    assert_false(ad_series_native(series, 1, &note));
    assert_mentions(note.message, "4096");
    assert_null(ad_points_new(series, 1, true, NULL));
    ad_series_free(series);
    ad_tape_free(tape);
}

static void test_refusals(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64), *narrow = ad_tape_new(AD_F32);
    ad_var x = ad_input(tape, 1, 1, "x"), z = ad_input(tape, 1, 1, "z"), y = ad_mul(x, z);
    ad_series *series;
    assert_int_equal(ad_series_new(1, &y, 1, &x, 3, &series), AD_E_ARGUMENT); /* z is not given */
    assert_null(series);
    ad_tape_reset(tape);
    x = ad_input(tape, 1, 1, "x");
    y = ad_sin(x);
    assert_int_equal(ad_series_new(1, &y, 1, &y, 3, &series), AD_E_ARGUMENT); /* no input */
    ad_tape_reset(tape);
    ad_var a = ad_input(tape, 4, 1, "a"), b = ad_input(tape, 2, 1, "b"), both[2] = {a, b};
    y = ad_solve(a, b, AD_LU);
    assert_int_equal(ad_series_new(1, &y, 2, both, 3, &series), AD_E_ARGUMENT);
    ad_tape_reset(tape);
    assert_int_equal(ad_series_new(1, &y, 2, both, 3, &series), AD_E_TAPE); /* of before */
    x = ad_input(narrow, 1, 1, "x");
    y = ad_sin(x);
    assert_int_equal(ad_series_new(1, &y, 1, &x, 3, &series), AD_E_ARGUMENT);
    assert_int_equal(ad_series_new(0, NULL, 1, &x, 3, &series), AD_E_ARGUMENT);
    x = ad_input(tape, 1, 1, "x");
    y = ad_sin(x);
    assert_int_equal(ad_series_new(1, &y, 1, &x, 3, NULL), AD_E_ARGUMENT);
    assert_int_equal(ad_series_new(1, &y, 1, NULL, 3, &series), AD_E_ARGUMENT);
    assert_int_equal(ad_series_new(1, &y, 1, &x, SIZE_MAX, &series), AD_E_ARGUMENT);
    ad_tape_reset(tape);
    x = ad_input(tape, 1, 1, "x");
    y = ad_sin(x);
    both[0] = both[1] = x;
    assert_int_equal(ad_series_new(1, &y, 2, both, 3, &series), AD_E_ARGUMENT); /* twice */
    assert_null(ad_series_output(NULL, 0, 0));
    ad_series_free(NULL);
    ad_tape_free(tape);
    ad_tape_free(narrow);
}

/* ---- what rounding cuts off ---- */

enum { CUT_RATES = 12 };

static void record_rates(ad_var x, ad_var *rates)
{
    ad_var a = ad_slice_rows(x, 0, 1), b = ad_slice_rows(x, 1, 1), r2 = ad_sum(ad_square(x));
    ad_var y[CUT_RATES] = {ad_mul(a, b),
                           ad_div(a, b),
                           ad_recip(r2),
                           ad_sqrt(r2),
                           ad_pow(r2, -1.5),
                           ad_div(a, ad_sqrt(r2)),
                           ad_pow(r2, -0.5),
                           ad_sub(a, b),
                           ad_add(ad_mul(a, 0.3), ad_mul(b, 0.7)),
                           ad_sub(ad_square(a), 0.1),
                           ad_mul(a, ad_pow(ad_sub(ad_square(a), ad_square(b)), 3.0)),
                           ad_select(ad_sub(a, b), ad_mul(b, r2), a)};
    *rates = ad_concat_rows(CUT_RATES, y);
}

static void exact_rates(const long double *x, long double *y)
{
    const long double a = x[0], b = x[1],
                      r2 = a * a + b * b + x[2] * x[2] + x[3] * x[3] + x[4] * x[4] + x[5] * x[5] +
                           x[6] * x[6] + x[7] * x[7] + x[8] * x[8] + x[9] * x[9] + x[10] * x[10] +
                           x[11] * x[11],
                      w = (a - b) * (a + b);
    const long double rates[CUT_RATES] = {
        a * b,         a / b,         1 / r2, sqrtl(r2),         1 / (r2 * sqrtl(r2)),
        a / sqrtl(r2), 1 / sqrtl(r2), a - b,  a * 0.3 + b * 0.7, a * a - 0.1,
        a * w * w * w, b * r2};
    memcpy(y, rates, sizeof rates);
}

/* Rates are known to 1/100 of their rounding, if long double has the digits to tell. */
static void test_rates_with_what_was_cut_off(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, CUT_RATES, 1, "x"), rates;
    ad_series *series;
    double squares[2][CUT_RATES] = {{0}};
    record_rates(x, &rates);
    assert_int_equal(ad_series_new(1, &rates, 1, &x, 2, &series), AD_OK);
    for (size_t trial = 0; trial < 200 && LDBL_MANT_DIG > 60; trial++) {
        double c[3][CUT_RATES], cut[CUT_RATES], rest[CUT_RATES];
        long double point[CUT_RATES], exact[CUT_RATES];
        for (size_t i = 0; i < CUT_RATES; i++) {
            const double angle = (double)(1 + trial * CUT_RATES + i);
            c[0][i] = (i == 1 ? 5 : 1.5) + sin(angle);
            cut[i] = 0x1p-54 * c[0][i] * sin(1.7 * angle);
            point[i] = (long double)c[0][i] + cut[i];
        }
        exact_rates(point, exact);
        memcpy(c[1], cut, sizeof cut);
        ad_series_flow_cut(series, CUT_RATES, 2, c[0]);
        ad_series_rates_cut(series, CUT_RATES, c[0], cut, rest);
        for (size_t i = 0; i < CUT_RATES; i++)
            for (size_t with = 0; with < 2; with++) {
                const long double y = c[1][i] + (with ? (long double)rest[i] : 0);
                squares[with][i] += pow((double)((y - exact[i]) / exact[i]), 2);
            }
    }
    for (size_t i = 0; i < CUT_RATES && LDBL_MANT_DIG > 60; i++) {
        const double without = sqrt(squares[0][i] / 200), with = sqrt(squares[1][i] / 200);
        assert_true(without > 1e-17);
        assert_true(with < 0.01 * without);
    }
    ad_series_free(series);
    ad_tape_free(tape);
}

/* Where its own arithmetic overflows, or a root has no derivative, nothing is known to be cut off.
 */
static void test_nothing_cut_off_at_the_edges(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 2, 1, "x"), a = ad_slice_rows(x, 0, 1), b = ad_slice_rows(x, 1, 1),
           rate = ad_concat_rows(2, (ad_var[]){ad_mul(a, 1e-10), ad_sqrt(b)});
    ad_series *series;
    double c[2] = {1e305, 0}, cut[2] = {1e288, 1e-20}, rest[2] = {1, 1};
    assert_int_equal(ad_series_new(1, &rate, 1, &x, 2, &series), AD_OK);
    ad_series_rates_cut(series, 2, c, cut, rest);
    assert_true(rest[0] == 0 && rest[1] == 0);
    ad_series_free(series);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_branches_are_counted_and_taken),
        cmocka_unit_test(test_numbers_are_known),
        cmocka_unit_test(test_extreme_values),
        cmocka_unit_test(test_common_values_are_one),
        cmocka_unit_test(test_common_factors_leave_the_series),
        cmocka_unit_test(test_common_factors_are_found),
        cmocka_unit_test(test_long_series_are_interpreted),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_rates_with_what_was_cut_off),
        cmocka_unit_test(test_nothing_cut_off_at_the_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
