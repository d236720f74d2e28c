/* Potentials too thin for a Taylor series to see from where its step begins. */
#include "own.h"
#include "tests/close.h"

#include <limits.h>

static const char *const taylor = "taylor";

/* A pulse too thin for the series to see from where the step begins: the slope at its end gives it
   away where the step ends inside, and a barrier that does not is left to the reference. */
static ad_var wall(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    ad_var x = ad_mul(ad_sub(q, 1.0), 20.0);
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_exp(ad_neg(ad_square(x))));
}

static void test_a_wall_turns_it_around(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, wall, 11, 0.1, begin_own);
    double y[2], other[2];
    assert_int_equal(follow_own(&scene, taylor, 2.1, y), AD_OK); /* met about t = 1.8 */
    assert_int_equal(follow_own(&scene, "dop853", 2.1, other), AD_OK);
    assert_close(y[0], other[0], 1e-10, 0);
    assert_close(y[1], other[1], 1e-10, 0);
}

/* Where a step goes over the wall, at every tolerance, the measured error shows it, and another
   method is taken. */
static void test_what_the_series_does_not_see(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, wall, 11, 0.1, begin_own);
    struct phys_system system;
    struct phys_motion_solution motion;
    struct ad_error error = {0};
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 20, .error = 1e-6};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_motion_solve(&system, &settings, &motion, &error), AD_OK);
    assert_string_equal(motion.trial[0].integrator->name, taylor);
    assert_false(motion.trial[0].chosen);
    assert_true(motion.error <= 1e-6);
    assert_close(motion.x[2 * (motion.n - 1) + 1], -0.25, 1e-6, 0);
    phys_motion_solution_free(&motion);
    phys_system_close(&system);
}

static ad_var thin_wall(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    ad_var x = ad_mul(ad_sub(q, 1.0), 200.0);
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_exp(ad_neg(ad_square(x))));
}

static int calls, last_call;

static bool count_calls(void *context)
{
    (void)context;
    return ++calls < last_call;
}

/* A wall thinner than the first steps of dop853, too: its tolerance is tightened, and that of the
   series, which was given up, stays as it was tried. An interruption at any time ends all. */
static void test_what_is_tightened(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, thin_wall, 11, 0.1, begin_own);
    struct phys_system system;
    struct phys_motion_solution motion;
    struct ad_error error = {0};
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 20, .error = 1e-8, .proceed = count_calls};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    calls = 0, last_call = INT_MAX;
    assert_int_equal(phys_motion_solve(&system, &settings, &motion, &error), AD_OK);
    const struct phys_motion_trial *trial = motion.trial;
    assert_true(motion.n_trials == 2 && !trial[0].chosen && trial[1].chosen);
    assert_true(isfinite(trial[0].estimate) && isnan(trial[1].estimate)); /* tightened */
    assert_true(motion.setting == trial[1].setting && trial[1].integrator == motion.integrator);
    assert_true(motion.error <= 1e-8);
    phys_motion_solution_free(&motion);
    for (int all = calls, k = 1; k < all; k += 1 + all / 12) {
        calls = 0, last_call = k;
        error = (struct ad_error){0};
        enum ad_status status = phys_motion_solve(&system, &settings, &motion, &error);
        assert_true(status == AD_E_ACCURACY || (status == AD_OK && motion.info.stop));
        assert_true(calls < k + 3);
        phys_motion_solution_free(&motion);
    }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_wall_turns_it_around),
        cmocka_unit_test(test_what_the_series_does_not_see),
        cmocka_unit_test(test_what_is_tightened),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
