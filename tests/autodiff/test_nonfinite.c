/* The report of the first value that is not finite. */
#include "support.h"
#include "tests/mentions.h"

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
        cmocka_unit_test(test_check_mode),
        cmocka_unit_test(test_check_mode_names_the_first),
        cmocka_unit_test(test_check_mode_in_f32),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
