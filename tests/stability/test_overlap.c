/* Bodies that start at the same position: refused with the coordinate, or capped and finite; never
   a path of NaN. */
#include "follow.h"
#include "tests/close.h"

#include <stdlib.h>
#include <string.h>

static void a_distance_of_zero_is_refused(void **state)
{
    (void)state;
    struct motion m;
    follow_open(&m, "dimer", NULL, 0);
    phys_system_set(&m.system, "r0", 0, &m.error);
    assert_told(&m.error, AD_E_ARGUMENT, "r0 0 distance");
    motion_close(&m);
}

/* Laws without a cap, from a start that no scene gives but a file may: every method says where. */
static void laws_without_a_cap_refuse(void **state)
{
    (void)state;
    static const char *const scenes[] = {"dimer", "fall", "kepler", "figure8", "pythagorean"};
    static const char *const integrators[] = {"verlet", "rk4", "gauss2", "dop853"};
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
        for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
            struct motion m;
            follow_open(&m, scenes[s], NULL, 0);
            memset(m.y, 0, sizeof m.y);
            assert_false(phys_integrator_find(integrators[i], &m.error)->adaptive
                             ? follow_to(&m, integrators[i], 1e-6, 0.1)
                             : follow_steps(&m, integrators[i], 0.01, 10));
            assert_told(&m.error, AD_E_NONFINITE, "finite x* t 0*");
            for (size_t k = 0; k < m.ode.n; k++)
                assert_true(isfinite(m.y[k]));
            motion_close(&m);
        }
}

/* Laws with a cap or a softening: all bodies at one point feel finite forces. */
static void laws_with_a_cap_stay_finite(void **state)
{
    (void)state;
    static const char *const scenes[] = {"gas", "threebody"};
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        struct phys_system system;
        struct ad_error error = {0};
        phys_motion *motion;
        assert_int_equal(phys_system_open(scenes[s], &system, &error), AD_OK);
        assert_int_equal(phys_motion_new(&system, &motion, &error), AD_OK);
        double *q = calloc(3 * system.dof, sizeof *q), *v = q + system.dof, *a = v + system.dof;
        assert_non_null(q);
        phys_motion_acceleration(motion, q, v, 0, a, &error);
        assert_int_equal(error.status, AD_OK);
        for (size_t k = 0; k < system.dof; k++)
            assert_true(isfinite(a[k]));
        assert_int_equal(
            phys_check_finite(
                &system,
                &(struct phys_points){.size = sizeof(struct phys_points), 1, q, v, &(double){0}},
                &error),
            AD_OK);
        free(q);
        phys_motion_free(motion);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_distance_of_zero_is_refused),
        cmocka_unit_test(laws_without_a_cap_refuse),
        cmocka_unit_test(laws_with_a_cap_stay_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
