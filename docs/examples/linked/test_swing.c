/* The Lagrangian of ../elastic.c under a user's cmocka tests:

       cc test_swing.c ../elastic.c $(pkg-config --cflags --libs leastaction cmocka) -o test_swing
 */
#include <physics/physics.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

extern const struct phys_scene leastaction_scene;

/* Three slices, anywhere: rows are r and theta, their rates, and the time. */
static const double q[] = {1.1, 0.9, 1.3, 0.4, -0.7, 2.1}, v[] = {0.3, -0.2, 0.6, 1.7, 0.1, -0.9},
                    t[] = {0, 0.1, 0.2};
static const struct phys_points points = {3, q, v, t};

static void test_derivatives(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    struct ad_check report;
    assert_int_equal(phys_system_make(&leastaction_scene, &system, &error), AD_OK);
    assert_int_equal(phys_check_finite(&system, &points, &error), AD_OK);
    for (int order = 1; order <= 2; order++) {
        phys_check_gradient(&system, &points, order, 1e-8, 0, &report, &error);
        assert_int_equal(error.status, AD_OK);
        assert_true(report.passed);
    }
    phys_system_close(&system);
}

static void test_locality(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    struct phys_locality report;
    assert_int_equal(phys_system_make(&leastaction_scene, &system, &error), AD_OK);
    assert_int_equal(phys_check_locality(&system, &points, &report, &error), AD_OK);
    assert_true(report.passed);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_derivatives),
                                       cmocka_unit_test(test_locality)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
