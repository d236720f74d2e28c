/* Motion by the discrete equations of a rule: for `left` it is the published ODE path, and Newton's
   method finds it between its two ends. */
#include "published.h"
#include "tests/close.h"

#include <stdlib.h>
#include <string.h>

static double *marched(const struct phys_system *system, const struct phys_path_settings *settings,
                       struct phys_path_info *info)
{
    double *path = calloc(settings->rule->degree * system->dof * settings->slices, sizeof *path);
    double *q = malloc(2 * system->dof * sizeof *q);
    phys_motion *motion;
    struct ad_error error = {0};
    system->scene->start(system->params, 1, q, q + system->dof, &error);
    phys_motion_new(system, &motion, &error);
    phys_first_slices(motion, q, q + system->dof, settings->slices, settings->dt, false, path,
                      &error);
    assert_no_error(&error);
    phys_path_solve(&phys_solver_march, system, settings, path, info, &error);
    assert_no_error(&error);
    phys_motion_free(motion);
    free(q);
    return path;
}

static void left_marches_the_ode_path(void **state)
{
    static const char *const scenes[] = {"freebody", "pendulum", "ephemeris", "kepler"};
    (void)state;
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        struct phys_system system;
        struct ad_error error = {0};
        phys_system_open(scenes[k], &system, &error);
        assert_no_error(&error);
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find("left", &error),
                                              .slices = system.scene->slices,
                                              .dt = system.scene->dt,
                                              .learning_rate = 1};
        struct phys_path_info info;
        double *path = marched(&system, &settings, &info);
        size_t n = system.dof * settings.slices;
        double *ode = malloc(n * sizeof *ode), *zero = calloc(n, sizeof *zero);
        memcpy(ode, path, n * sizeof *ode);
        phys_motion *motion;
        phys_motion_new(&system, &motion, &error);
        phys_ode_path(motion, settings.slices, settings.dt, 1, ode, &error);
        assert_no_error(&error);
        assert_true(mean_square_distance(n, path, ode) <
                    1e-22 * mean_square_distance(n, zero, ode));
        phys_motion_free(motion);
        free(path);
        free(ode);
        free(zero);
        phys_system_close(&system);
    }
}

static void marched_paths_are_stationary(void **state)
{
    static const char *const rules[] = {"left", "midpoint", "trapezoid", "gauss2", "gauss5"};
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("dblpend", &system, &error); /* does not separate */
    for (size_t k = 0; k < sizeof rules / sizeof *rules; k++) {
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find(rules[k], &error),
                                              .slices = 40,
                                              .dt = 0.06,
                                              .steps = 20,
                                              .learning_rate = 1};
        struct phys_path_info info, again;
        double *path = marched(&system, &settings, &info);
        size_t n = settings.rule->degree * system.dof * settings.slices;
        double *found = malloc(n * sizeof *found);
        memcpy(found, path, n * sizeof *found);
        phys_noise_add(&(struct phys_noise){.sigma = 1e-3}, &system, settings.slices, 5, found);
        phys_path_solve(phys_solver_find("newton", &error), &system, &settings, found, &again,
                        &error);
        assert_no_error(&error);
        assert_true(again.steps > 1);
        assert_true(mean_square_distance(n, path, found) < 1e-22);
        assert_close(again.action, info.action, 1e-12, 0);
        free(path);
        free(found);
    }
    phys_system_close(&system);
}

static void a_rule_that_cannot_march_is_refused(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("spring", &system, &error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("left+repeat", &error),
                                          .slices = 10,
                                          .dt = 0.1,
                                          .learning_rate = 1};
    struct phys_path_info info;
    double path[10] = {1, 1};
    assert_int_equal(phys_path_solve(&phys_solver_march, &system, &settings, path, &info, &error),
                     AD_E_ARGUMENT);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(left_marches_the_ode_path),
        cmocka_unit_test(marched_paths_are_stationary),
        cmocka_unit_test(a_rule_that_cannot_march_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
