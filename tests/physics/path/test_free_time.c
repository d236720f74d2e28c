/* Paths whose end time is free, and paths of a given energy. */
#include "tests/physics/published.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>

static bool count(void *context, const struct phys_path_step *step)
{
    (void)step;
    ++*(size_t *)context;
    return true;
}

/* From (0, 10) to (x1, 5), g = 9.80665, from a straight chute and a wrong time: with x1 = 30 the
   curve dips below its end, and Newton's method alone ends on another path. */
static void quickest_descent(void **state)
{
    static const struct {
        const char *rule;
        size_t slices;
        double x1, time, tolerance;
        size_t adam_steps;
    } cases[] = {{"gauss2", 41, 10, 1.801603122, 1e-8, 0},
                 {"gauss4", 21, 10, 1.801603122, 5e-10, 0},
                 {"gauss6", 5, 10, 1.801603122, 5e-10, 0},
                 {"gauss4", 21, 30, 3.46645492727, 1e-10, 200}};
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("brachistochrone", &system, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        size_t n = cases[k].slices, calls = 0;
        phys_system_set(&system, "x1", cases[k].x1, &error);
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find(cases[k].rule, &error),
                                              .slices = n,
                                              .steps = 60,
                                              .dt = 2.5 / (double)(n - 1),
                                              .learning_rate = 1e-2,
                                              .adam_steps = cases[k].adam_steps,
                                              .progress = count,
                                              .context = &calls};
        double *path = calloc(settings.rule->degree * 2 * n, sizeof *path);
        double *cycloid = malloc(2 * n * sizeof *cycloid);
        system.scene->between(system.params, n, cycloid, &error);
        for (size_t i = 0; i < 2 * n; i++)
            path[i] = cycloid[i / n * n + n - 1] * (double)(i % n) / (double)(n - 1);
        phys_rule_interpolate(settings.rule, 2, n, path);
        struct phys_path_info info;
        phys_path_free_time(&system, &settings, 0, path, &info, &error);
        assert_no_error(&error);
        assert_close(settings.dt * (double)(n - 1), cases[k].time, 0, cases[k].tolerance);
        assert_close(info.action, cases[k].time, 0, cases[k].tolerance);
        assert_int_equal(calls, 0);
        assert_true(mean_square_distance(2 * n, path, cycloid) < 1e-12);
        free(path);
        free(cycloid);
    }
    phys_system_close(&system);
}

/* A free body between two heights with an energy: the time follows from that energy. */
static void time_of_a_given_energy(void **state)
{
    enum { SLICES = 11 };
    const double energy = 3.2, x1 = 0.8;
    (void)state;
    struct phys_system body;
    struct ad_error error = {0};
    phys_system_open("freebody", &body, &error); /* m = g = 1 */
    assert_no_error(&error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss2", &error),
                                          .slices = SLICES,
                                          .steps = 20,
                                          .dt = 0.03,
                                          .learning_rate = 1};
    double path[2 * SLICES] = {[SLICES - 1] = x1};
    struct phys_path_info info;
    phys_path_free_time(&body, &settings, energy, path, &info, &error);
    assert_no_error(&error);
    /* upwards with v0 = sqrt(2 E), past x1 for the first time */
    double v0 = sqrt(2 * energy), v1 = sqrt(2 * (energy - x1));
    assert_close(settings.dt * (SLICES - 1), v0 - v1, 1e-12, 0);
    phys_system_close(&body);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quickest_descent),
        cmocka_unit_test(time_of_a_given_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
