/* Cyclic coordinates and their momenta, against closed forms. */
#include "systems.h"
#include "tests/close.h"

#include <math.h>

/* A spherical pendulum: theta from below, phi round the vertical. */
static ad_var spherical(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var theta = ad_row(q, 0);
    ad_var round = ad_mul(ad_sin(theta), ad_row(v, 1));
    ad_var T = ad_mul(0.5, ad_add(ad_square(ad_row(v, 0)), ad_square(round)));
    return ad_add(T, ad_cos(theta));
}

/* The same, pushed round by a field that is weak. */
static ad_var pushed(ad_var q, ad_var v, ad_var t, const void *params)
{
    return ad_add(spherical(q, v, t, params), ad_mul(1e-9, ad_cos(ad_row(q, 1))));
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = q[1] = 0.5;
    v[0] = v[1] = 0;
    return AD_OK;
}

static void find(phys_lagrangian *L, bool *cyclic, double *value, double *change)
{
    struct phys_scene scene = scene_of("scene", 2, L, 3, 0.1, at_rest);
    struct phys_system system;
    struct ad_error error = {0};
    /* theta, phi and their velocities, twice: sin^2(theta) phi' is .25 and .26 */
    const double x[] = {M_PI / 6, 0.4, 0.1, 1, M_PI / 2, 2, 0.2, 0.26}, t[] = {0, 1};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    phys_cyclic(&system, 2, x, t, cyclic, value, change, &error);
    assert_string_equal(error.message, "");
    phys_system_close(&system);
}

static void an_angle_about_the_vertical_is_cyclic(void **state)
{
    bool cyclic[2];
    double value[2], change[2];
    (void)state;
    find(spherical, cyclic, value, change);
    assert_false(cyclic[0]);
    assert_true(cyclic[1]);
    assert_close(value[1], 0.25, 1e-14, 0);
    assert_close(change[1], 0.01, 1e-13, 0);
    find(pushed, cyclic, value, change);
    assert_false(cyclic[0] || cyclic[1]);
}

static void what_is_missing_is_refused(void **state)
{
    bool cyclic;
    double value, change;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_cyclic(NULL, 0, NULL, NULL, &cyclic, &value, &change, &error),
                     AD_E_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_angle_about_the_vertical_is_cyclic),
        cmocka_unit_test(what_is_missing_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
