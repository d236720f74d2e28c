/* Variational integrators against the methods they are equal to. */
#include "tests/close.h"
#include "motion.h"

#include <string.h>

/* Largest difference of the coordinates after t by two methods, both in (q, p). */
static double difference(const char *scene, const char *one, const char *other, double dt, double t)
{
    struct motion a, b;
    double most = 0;
    motion_open(&a, scene, true, NULL);
    motion_open(&b, scene, true, NULL);
    motion_run(&a, one, dt, t, AD_OK);
    motion_run(&b, other, dt, t, AD_OK);
    for (size_t k = 0; k < a.ode.n; k++)
        most = fmax(most, fabs(a.y[k] - b.y[k]));
    motion_close(&a);
    motion_close(&b);
    return most;
}

/* For any Lagrangian, the rules on Gauss's points are Gauss's methods for its Hamiltonian. */
static void test_variational_gauss(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"variational-midpoint", "implicit-midpoint"},
                                           {"variational-gauss2", "gauss2"},
                                           {"variational-gauss4", "gauss4"}};
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        assert_true(difference("kepler", pairs[k][0], pairs[k][1], 0.02, 3) < 1e-11);
        assert_true(difference("dblpend", pairs[k][0], pairs[k][1], 0.02, 3) < 1e-11);
        assert_true(difference("arenstorf", pairs[k][0], pairs[k][1], 1e-3, 0.1) < 1e-10);
    }
    assert_true(difference("dblpend", "variational-trapezoid", "implicit-midpoint", 0.02, 3) >
                1e-7);
}

/* The positions of rule left are the published path, marched from the same first two slices. */
static void test_variational_left(void **state)
{
    enum { SLICES = 50 };
    (void)state;
    struct motion m;
    double path[2 * SLICES], dt = 0.05;
    phys_motion *motion;
    motion_open(&m, "kepler", true, NULL);
    assert_int_equal(phys_motion_new(&m.system, &motion, &m.error), AD_OK);
    for (size_t i = 0; i < SLICES; i++) {
        path[i] = m.y[0];
        path[SLICES + i] = m.y[1];
        m.settings.t0 = (double)i * dt;
        motion_run(&m, "variational-left", dt, (double)(i + 1) * dt, AD_OK);
    }
    double marched[2 * SLICES];
    memcpy(marched, path, sizeof path);
    assert_int_equal(phys_ode_path(motion, SLICES, dt, 1, marched, &m.error), AD_OK);
    for (size_t k = 0; k < 2 * SLICES; k++)
        assert_close(path[k], marched[k], 0, 1e-11);
    phys_motion_free(motion);
    motion_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_variational_gauss),
        cmocka_unit_test(test_variational_left),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
