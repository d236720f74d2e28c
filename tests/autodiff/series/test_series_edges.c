/* Power series at branches, numbers, extreme values and values in common; refusals. */
#include "autodiff/series/internal.h"
#include "tests/close.h"

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_branches_are_counted_and_taken),
        cmocka_unit_test(test_numbers_are_known),
        cmocka_unit_test(test_extreme_values),
        cmocka_unit_test(test_common_values_are_one),
        cmocka_unit_test(test_common_factors_leave_the_series),
        cmocka_unit_test(test_common_factors_are_found),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
