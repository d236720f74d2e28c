/* Constant arguments, which recording simplifies: powers, either side of every binary operation,
   nested factors. Values and derivatives must be unaffected. */
#include "references.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- powers with a number as exponent ---- */

static const double exponents[] = {-32, -7, -3, -2, -1,  -0.5, 0,  0.5, 1,
                                   1.5, 2,  3,  4,  5.5, 7,    16, 31,  32};

static void test_number_powers(void **state)
{
    (void)state;
    uint64_t seed = 99;
    for (size_t k = 0; k < LENGTH(exponents); k++) {
        double c = exponents[k], lo = c == floor(c) ? -1.4 : 0.5;
        double *at = random_values(&seed, 5 * 131, lo, 1.6);
        for (size_t i = 0; i < 5 * 131; i++)
            at[i] += fabs(at[i]) < 0.4 ? 0.8 : 0;
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var x = ad_input(tape, 5, 131, NULL), y = ad_pow(x, c);
        double *v = evaluate(y, 1, &x, (const double *const[]){at});
        for (size_t i = 0; i < 5 * 131; i++)
            assert_close(v[i], pow(at[i], c), 1e-14, 0);
        char name[32];
        snprintf(name, sizeof name, "pow(x, %g)", c);
        assert_gradient(name, weighted_sum(y), 1, &x, (const double *const[]){at}, 1e-8, 25);
        assert_second(name, weighted_sum(y), 1, &x, (const double *const[]){at}, 1e-7, 25);
        free(v);
        free(at);
        ad_tape_free(tape);
    }
}

/* ---- numbers on either side ---- */

#define BOTH_SIDES(X)                                                                              \
    X(add) X(sub) X(mul) X(div) X(pow) X(atan2) X(hypot) X(min) X(max) X(lt) X(le) X(eq) X(ne)

typedef ad_var with_number(ad_var x, double c);
#define RECORD(name)                                                                               \
    static ad_var name##_right(ad_var x, double c) { return ad_##name(x, c); }                     \
    static ad_var name##_left(ad_var x, double c) { return ad_##name(c, x); }
BOTH_SIDES(RECORD)

static const struct {
    const char *name;
    with_number *right, *left;
    double (*reference)(double, double, double);
} sided[] = {
#define ENTRY(name) {#name, name##_right, name##_left, name##_reference},
    BOTH_SIDES(ENTRY)};

/* Neutral numbers, powers of two and signs are simplified when recording: values must not show it.
 */
static void test_numbers_on_either_side(void **state)
{
    (void)state;
    static const double numbers[] = {0, 1, -1, 2, 0.5, -4, 3, 0.7};
    uint64_t seed = 7;
    for (size_t k = 0; k < LENGTH(sided); k++)
        for (size_t j = 0; j < LENGTH(numbers); j++) {
            double c = numbers[j], *at = random_values(&seed, 3 * 7, 0.3, 2);
            at[4] = 2;
            at[5] = 1;
            const double *const values[] = {at};
            ad_tape *tape = ad_tape_new(AD_F64);
            ad_var x = ad_input(tape, 3, 7, NULL);
            double *right = evaluate(sided[k].right(x, c), 1, &x, values);
            double *left = evaluate(sided[k].left(x, c), 1, &x, values);
            for (size_t i = 0; i < 3 * 7; i++) {
                assert_close(right[i], sided[k].reference(at[i], c, 0), 1e-15, 0);
                if (strcmp(sided[k].name, "pow") != 0 || c >= 0)
                    assert_close(left[i], sided[k].reference(c, at[i], 0), 1e-15, 0);
            }
            free(right);
            free(left);
            free(at);
            ad_tape_free(tape);
        }
}

/* Factors of factors are merged when recording. */
static void test_chained_factors(void **state)
{
    (void)state;
    uint64_t seed = 8;
    double *at = random_values(&seed, 3 * 7, -2, 2);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 3, 7, NULL);
    ad_var y = ad_neg(ad_mul(ad_neg(ad_mul(3.0, ad_neg(ad_div(x, 8.0)))), -0.5));
    double *v = evaluate(y, 1, &x, (const double *const[]){at});
    for (size_t i = 0; i < 3 * 7; i++)
        assert_close(v[i], 3.0 / 8 * 0.5 * at[i], 1e-15, 0);
    assert_gradient("factors", weighted_sum(y), 1, &x, (const double *const[]){at}, 1e-9, 0);
    free(v);
    free(at);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_number_powers),
        cmocka_unit_test(test_numbers_on_either_side),
        cmocka_unit_test(test_chained_factors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
