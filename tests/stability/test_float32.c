/* The range of single precision ends at 3.4e38: in SI units, and in the steep wall of a pair law.
   The same recording is finite in double precision; the check names the operation. (Gradients
   through the branch that a select does not take are in tests/autodiff/test_edges.c.) */
#include "follow.h"
#include "tests/close.h"

/* Runs f of two numbers, x, on a tape of this type, checked. */
static double value_of(ad_var (*f)(ad_var x), enum ad_type type, const double *x,
                       struct ad_error *error)
{
    ad_tape *tape = ad_tape_new(type);
    ad_program *program;
    ad_var in = ad_input(tape, 2, 1, "x"), out = f(in);
    double value;
    assert_int_equal(ad_compile(tape, 1, &out, &program), AD_OK);
    ad_set(program, in, x);
    ad_run_checked(program, error);
    ad_get(program, out, &value);
    ad_program_free(program);
    ad_tape_free(tape);
    return value;
}

/* G M m / r: 5e33 J would fit, the product of the masses does not. */
static ad_var sun_and_earth(ad_var m)
{
    ad_var masses = ad_label(ad_mul(ad_row(m, 0), ad_row(m, 1)), "product of the masses");
    return ad_mul(6.67e-11 / 1.496e11, masses);
}

static void the_masses_of_sun_and_earth_do_not_fit(void **state)
{
    (void)state;
    const double m[] = {1.99e30, 5.97e24};
    struct ad_error error = {0};
    assert_close(value_of(sun_and_earth, AD_F64, m, &error), 6.67e-11 / 1.496e11 * m[0] * m[1],
                 1e-14, 0);
    assert_int_equal(error.status, AD_OK);
    assert_true(isinf(value_of(sun_and_earth, AD_F32, m, &error)));
    assert_told(&error, AD_E_NONFINITE, "\"product of the masses\" inf");
}

/* (s/r)^12, with s = 1 */
static ad_var wall(ad_var x)
{
    ad_var u3 = ad_pow(ad_square(ad_div(ad_row(x, 0), ad_row(x, 1))), 3);
    return ad_label(ad_square(u3), "wall of the pair law");
}

static void a_pair_law_overflows_below_6e_4(void **state)
{
    (void)state;
    struct ad_error error = {0};
    assert_true(isfinite(value_of(wall, AD_F32, (double[]){1, 6.16e-4}, &error)));
    assert_int_equal(error.status, AD_OK);
    assert_true(isinf(value_of(wall, AD_F32, (double[]){1, 6.14e-4}, &error)));
    assert_told(&error, AD_E_NONFINITE, "\"wall of the pair law\" inf");
    error = (struct ad_error){0};
    assert_close(value_of(wall, AD_F64, (double[]){1, 6.14e-4}, &error), pow(6.14e-4, -12), 1e-13,
                 0);
    assert_int_equal(error.status, AD_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_masses_of_sun_and_earth_do_not_fit),
        cmocka_unit_test(a_pair_law_overflows_below_6e_4),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
