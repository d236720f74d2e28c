/* What was not found, not opened or not given is an error, the one already held if there is one. */
#include "tests/close.h"
#include "physics/stability/stability.h"
#include "physics/motion/motion.h"

#include <string.h>

static void test_failed_searches(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct phys_ode ode;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    struct phys_path_info path_info;
    double y[2] = {1, 0}, path[9] = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &error), AD_OK);
    assert_int_equal(phys_ode_lagrangian(&pendulum, &ode, &error), AD_OK);
    struct phys_simulation s = {
        .integrator = phys_integrator_find("dop85", &error), .t1 = 1, .rtol = 1e-9};
    assert_int_equal(phys_simulate(&s, &ode, y, &info, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "dop85"));
    error = (struct ad_error){0};
    struct phys_path_settings settings = phys_path_defaults(&pendulum);
    assert_int_equal(phys_path_solve(phys_solver_find("newtom", &error), &pendulum, &settings, path,
                                     &path_info, &error),
                     AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "newtom"));
    phys_ode_free(&ode);
    phys_system_close(&pendulum);
}

/* Nothing given and no error held: a new one. */
static void test_nothing_given(void **state)
{
    (void)state;
    struct phys_system pendulum, closed = {0};
    struct phys_ode ode = {0};
    struct phys_spectrum spectrum;
    struct phys_solutions solutions;
    struct phys_simulation_info info;
    struct phys_step_limits limits;
    struct phys_motion *motion;
    struct phys_legendre *legendre;
    struct phys_approach *approach;
    struct phys_reference reference;
    struct phys_conserved conserved;
    struct phys_locality locality;
    struct ad_check check;
    double path[12] = {0}, q[2] = {1, 1}, v[2] = {0, 0};
    struct ad_error e = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &e), AD_OK);
    const struct phys_points no_time = {2, q, v, NULL};
    struct phys_path_settings no_rule = {.slices = 5, .dt = 0.1};
    const struct phys_simulation nothing = {.t1 = 1};
    phys_rule_interpolate(NULL, 1, 3, path);
    phys_rule_nodes(NULL, 1, 3, 1, path, path, NULL);
#define REFUSED(call) (e = (struct ad_error){0}, assert_int_equal((call), AD_E_ARGUMENT))
    REFUSED(phys_path_spectrum(&pendulum, &no_rule, path, &spectrum, &e));
    REFUSED(phys_path_all(&pendulum, &no_rule, path, 3, 1, &solutions, &e));
    REFUSED(phys_simulate(&nothing, &ode, q, &info, &e));
    REFUSED(phys_ode_enter(NULL, 0, q, v, path, &e));
    REFUSED(phys_ode_enter(&ode, 0, q, NULL, path, &e));
    REFUSED(phys_ode_leave(&ode, 0, NULL, q, v, &e));
    REFUSED(phys_ode_leave(&ode, 0, path, q, NULL, &e));
    REFUSED(phys_typical_sizes(NULL, 0, q, path, &e));
    REFUSED(phys_approach_new(NULL, 0, q, &approach, &e));
    REFUSED(phys_motion_path(&closed, NULL, q, v, 3, 0.1, path, &e));
    REFUSED(phys_first_slices(NULL, q, v, 3, 0.1, true, path, &e));
    REFUSED(phys_reference(&closed, q, v, 2, path, 0.1, NULL, NULL, &reference, &e));
    REFUSED(phys_reference(&pendulum, q, v, 2, NULL, 0.1, NULL, NULL, &reference, &e));
    REFUSED(phys_conserved(&pendulum, 0, NULL, NULL, &conserved, &e));
    REFUSED(phys_conserved(&pendulum, 1, path, NULL, &conserved, &e));
    REFUSED(phys_ode_lagrangian(&closed, &ode, &e));
    REFUSED(phys_ode_canonical(&closed, &ode, &e));
    REFUSED(phys_ode_hamiltonian(NULL, 1, NULL, &ode, &e));
    REFUSED(phys_motion_new(&closed, &motion, &e));
    REFUSED(phys_legendre_new(&closed, &legendre, &e));
    REFUSED(phys_check_finite(&pendulum, &no_time, &e));
    REFUSED(phys_check_gradient(&pendulum, &no_time, 1, 1e-6, 0, &check, &e));
    REFUSED(phys_check_locality(&pendulum, NULL, &locality, &e));
    REFUSED(phys_step_limits(NULL, &limits, &e));
    REFUSED(phys_system_open(NULL, &closed, &e));
    REFUSED(phys_system_set(&closed, "m", 1, &e));
    REFUSED((phys_integrator_find(NULL, &e), e.status));
    REFUSED((phys_solver_find(NULL, &e), e.status));
    REFUSED((phys_rule_find(NULL, &e), e.status));
    phys_system_close(&pendulum);
}

/* G4: components that are zero at the start, and no atol. */
static void test_start_at_rest(void **state)
{
    (void)state;
    static const char *const scenes[] = {"pendulum", "dblpend", "pythagorean", "fall"};
    for (size_t k = 0; k < LENGTH(scenes); k++) {
        struct phys_system system;
        struct phys_ode ode;
        struct phys_simulation_info info;
        struct ad_error error = {0};
        double y[32] = {0};
        assert_int_equal(phys_system_open(scenes[k], &system, &error), AD_OK);
        assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
        assert_int_equal(system.scene->start(system.params, 1, y, y + system.dof, &error), AD_OK);
        struct phys_simulation s = {
            .integrator = phys_integrator_find("dop853", &error), .t1 = 1, .rtol = 1e-9};
        if (phys_simulate(&s, &ode, y, &info, &error) != AD_OK)
            print_error("%s: %s\n", scenes[k], error.message);
        assert_int_equal(error.status, AD_OK);
        assert_true(info.steps > 0 && info.steps < 2000);
        phys_ode_free(&ode);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_failed_searches),
        cmocka_unit_test(test_nothing_given),
        cmocka_unit_test(test_start_at_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
