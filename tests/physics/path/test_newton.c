/* Newton's stationary paths: from the published noisy starts to the path of the discrete equations
   of motion, and the kind of stationary point. */
#include "tests/physics/published.h"
#include "physics/physics.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct phys_path_settings settings_of(const struct phys_system *system, const char *rule)
{
    struct ad_error error = {0};
    struct phys_path_settings settings = phys_path_defaults(system);
    settings.rule = phys_rule_find(rule, &error);
    settings.steps = 200;
    assert_no_error(&error);
    return settings;
}

static struct phys_path_info solve(const struct phys_system *system,
                                   const struct phys_path_settings *settings, double *path)
{
    struct phys_path_info info = {0};
    struct ad_error error = {0};
    phys_path_solve(phys_solver_find("newton", &error), system, settings, path, &info, &error);
    assert_no_error(&error);
    return info;
}

static struct phys_spectrum spectrum(const struct phys_system *system,
                                     const struct phys_path_settings *settings, const double *path)
{
    struct phys_spectrum found;
    struct ad_error error = {0};
    phys_path_spectrum(system, settings, path, &found, &error);
    assert_no_error(&error);
    return found;
}

/* The motion of the scene by a fine integration, its inner nodes in place: [degree*dof x slices].
 */
static double *motion(const struct phys_system *system, const struct phys_path_settings *settings)
{
    size_t dof = system->dof, slices = settings->slices;
    double *path = malloc(settings->rule->degree * dof * slices * sizeof *path);
    double *q = malloc(2 * dof * sizeof *q);
    struct ad_error error = {0};
    system->scene->start(system->params, 1, q, q + dof, &error);
    phys_motion_path(system, NULL, q, q + dof, slices, settings->dt, path, &error);
    assert_no_error(&error);
    phys_rule_interpolate(settings->rule, dof, slices, path);
    free(q);
    return path;
}

/* ---- the published starts ---- */

/* For separable L the stationary path of rule `left` is the published ODE path. */
static void published_starts_reach_the_ode_path(void **state)
{
    static const struct {
        const char *scene;
        size_t adam_steps, most_steps, index;
    } cases[] = {{"freebody", 0, 5, 0},
                 {"pendulum", 0, 12, 1},
                 {"threebody", 200, 12, 0},
                 {"ephemeris", 0, 12, 0}};
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct phys_system system = published_system(cases[k].scene);
        struct phys_path_settings settings = settings_of(&system, "left");
        settings.adam_steps = cases[k].adam_steps;
        size_t n = system.dof * settings.slices;
        double *path = published_path(&system, "init"), *ode = published_path(&system, "ode");
        double *zero = calloc(n, sizeof *zero);
        struct phys_path_info info = solve(&system, &settings, path);
        double error = mean_square_distance(n, path, ode) / mean_square_distance(n, zero, ode);
        print_message("%s: %zu steps, %.1f ms, relative mean square distance %.1e\n",
                      cases[k].scene, info.steps, 1e3 * info.seconds, error);
        assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
        assert_in_range(info.steps, 1, cases[k].most_steps);
        assert_true(error < 1e-20);
        settings.adam_steps = 50; /* not taken where there is nothing to gain */
        assert_int_equal(solve(&system, &settings, path).steps, 0);
        struct phys_spectrum found = spectrum(&system, &settings, path);
        assert_int_equal(found.index, cases[k].index);
        phys_spectrum_free(&found);
        free(path);
        free(ode);
        free(zero);
        phys_system_close(&system);
    }
}

static void published_double_pendulum_becomes_stationary(void **state)
{
    (void)state;
    struct phys_system system = published_system("dblpend");
    struct phys_path_settings settings = settings_of(&system, "left");
    settings.adam_steps = 100;
    settings.tolerance = 1e-10;
    double *path = published_path(&system, "init");
    struct phys_path_info info = solve(&system, &settings, path);
    print_message("dblpend: %zu steps, %.1f ms\n", info.steps, 1e3 * info.seconds);
    assert_int_equal(info.stop, PHYS_STOP_TOLERANCE);
    free(path);
    phys_system_close(&system);
}

/* Bodies overlap in the published start, so that the first steps climb out of poles: from there on
   the last bit decides how many there are. Measured where the start moves by 1e-15 of itself: 2
   to 16. */
static void published_gas_becomes_stationary(void **state)
{
    (void)state;
    struct phys_system published_gas = published_system("gas"), gas;
    struct ad_error error = {0};
    phys_system_open("gas", &gas, &error); /* without clamp and cap */
    assert_no_error(&error);
    struct phys_path_settings settings = settings_of(&gas, "left");
    settings.tolerance = 1e-10;
    settings.steps = 40;
    double *path = published_path(&published_gas, "init");
    size_t slices = settings.slices;
    settings.slices = 40; /* its first: overlaps of bodies enough */
    for (size_t k = 0; k < gas.dof; k++)
        memmove(path + k * settings.slices, path + k * slices, settings.slices * sizeof *path);
    struct phys_path_info info = solve(&gas, &settings, path);
    print_message("gas: %zu steps, %.2f s\n", info.steps, info.seconds);
    assert_int_equal(info.stop, PHYS_STOP_TOLERANCE);
    free(path);
    phys_system_close(&gas);
    phys_system_close(&published_gas);
}

/* The lattice gas: from its own motion and noise back to that motion. */
static void gas_returns_to_its_motion(void **state)
{
    (void)state;
    struct phys_system gas;
    struct ad_error error = {0};
    phys_system_open("gas", &gas, &error);
    phys_system_set(&gas, "bodies", 12, &error);
    assert_no_error(&error);
    struct phys_path_settings settings = settings_of(&gas, "left");
    size_t n = gas.dof * settings.slices;
    double *start = motion(&gas, &settings), *path = malloc(n * sizeof *path);
    phys_motion *march;
    phys_motion_new(&gas, &march, &error);
    phys_ode_path(march, settings.slices, settings.dt, 1, start, &error);
    assert_no_error(&error);
    memcpy(path, start, n * sizeof *path);
    phys_noise_add(&(struct phys_noise){.sigma = 2e-3}, &gas, settings.slices, 7, path);
    assert_true(mean_square_distance(n, path, start) > 1e-6);
    assert_int_equal(solve(&gas, &settings, path).stop, PHYS_STOP_ROUNDING);
    assert_true(mean_square_distance(n, path, start) < 1e-20);
    phys_motion_free(march);
    free(start);
    free(path);
    phys_system_close(&gas);
}

/* ---- what kind of stationary point ---- */

static void index_on_the_true_path(void **state)
{
    static const struct {
        const char *scene, *rule, *parameter;
        double value, dt; /* dt 0: the scene's */
        size_t slices, index;
    } cases[] = {
        {"pendulum", "left", "l", 180, 0, 100, 1},     {"pendulum", "gauss3", "l", 180, 0, 100, 1},
        {"threebody", "left", "G", 1.3e-4, 0, 100, 0}, {"dblpend", "midpoint", "g", 1, 0, 200, 6},
        {"dblpend", "midpoint", "g", 1, 0, 100, 3},    {"dblpend", "trapezoid", "g", 1, 0, 200, 6},
        {"dblpend", "gauss2", "g", 1, 0.12, 101, 6},   {"ephemeris", "left", "dims", 2, 0, 65, 0},
        {"ephemeris", "left", "dims", 3, 0, 65, 1},    {"ephemeris", "gauss2", "dims", 3, 0, 65, 1},
    };
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct phys_system system;
        struct ad_error error = {0};
        phys_system_open(cases[k].scene, &system, &error);
        phys_system_set(&system, cases[k].parameter, cases[k].value, &error);
        assert_no_error(&error);
        struct phys_path_settings settings = settings_of(&system, cases[k].rule);
        settings.slices = cases[k].slices;
        if (cases[k].dt > 0)
            settings.dt = cases[k].dt;
        double *path = motion(&system, &settings);
        assert_int_equal(solve(&system, &settings, path).stop, PHYS_STOP_ROUNDING);
        struct phys_spectrum found = spectrum(&system, &settings, path);
        if (found.index != cases[k].index || found.n_conjugate != cases[k].index)
            fail_msg("%s, %s, %zu slices: index %zu with %zu conjugate points, expected %zu",
                     cases[k].scene, cases[k].rule, cases[k].slices, found.index, found.n_conjugate,
                     cases[k].index);
        assert_true(cases[k].index == 0 ? found.smallest > 0 : found.smallest < 0);
        phys_spectrum_free(&found);
        free(path);
        phys_system_close(&system);
    }
}

/* The figure of eight, m = G = 1: its action over a period, to the digits known. */
static void action_of_the_figure_eight(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("figure8", &system, &error);
    assert_no_error(&error);
    struct phys_path_settings settings = settings_of(&system, "gauss4");
    settings.slices = 65;
    settings.dt = 6.3259138908 / 64;
    double *path = motion(&system, &settings);
    struct phys_path_info info = solve(&system, &settings, path);
    assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
    assert_close(info.action, 24.42704853, 0, 1e-8);
    free(path);
    phys_system_close(&system);
}

/* F2: the least eigenvalue of the second variation -x'' - x between fixed ends is (pi/T)^2 - 1, for
   every rule; the error of the coarse grid falls with the order of the rule. */
static void second_variation_of_every_rule(void **state)
{
    static const struct {
        const char *rule;
        double tolerance;
    } cases[] = {{"left", 2e-3},   {"left+repeat", 7e-2}, {"midpoint", 2e-3}, {"trapezoid", 2e-3},
                 {"gauss2", 2e-6}, {"gauss3", 1e-9},      {"gauss4", 1e-10},  {"gauss7", 1e-10}};
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    for (size_t k = 0; k < LENGTH(cases); k++)
        for (double time = 2; time < 8; time *= 1.7) {
            struct phys_path_settings settings = settings_of(&spring, cases[k].rule);
            settings.slices = 41;
            settings.dt = time / 40;
            double path[7 * 41] = {[0] = 1}, exact = M_PI * M_PI / time / time - 1;
            struct phys_spectrum found = spectrum(&spring, &settings, path);
            assert_close(found.second_variation, exact, 0, cases[k].tolerance);
            if (settings.rule->degree == 1)
                assert_close(found.smallest, exact * settings.dt, 0, cases[k].tolerance);
            phys_spectrum_free(&found);
        }
    phys_system_close(&spring);
}

/* Half a period is where an oscillator's action turns into a saddle. */
static void oscillator_turns_into_a_saddle(void **state)
{
    static const struct {
        double time, eigenvalue;
        size_t index;
    } cases[] = {{3.1, 0.0269, 0}, {3.2, -0.0363, 1}};
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    assert_no_error(&error);
    struct phys_path_settings settings = settings_of(&spring, "left");
    for (size_t k = 0; k < 2; k++) {
        settings.slices = 100;
        settings.dt = cases[k].time / 99;
        double path[100] = {[0] = 1};
        solve(&spring, &settings, path);
        struct phys_spectrum found = spectrum(&spring, &settings, path);
        assert_int_equal(found.index, cases[k].index);
        assert_close(found.smallest / settings.dt, cases[k].eigenvalue, 0, 5e-5);
        phys_spectrum_free(&found);
    }
    phys_system_close(&spring);
}

/* Adam throws the two bodies together or out of their well, whence no step of Newton leads back:
   then it begins again at the line. */
static void steps_of_adam_that_lead_away_are_taken_back(void **state)
{
    (void)state;
    struct phys_system dimer;
    struct ad_error error = {0};
    phys_system_open("dimer", &dimer, &error);
    struct phys_path_settings settings = settings_of(&dimer, "left");
    double *expected = motion(&dimer, &settings), *path = motion(&dimer, &settings);
    size_t n = settings.slices;
    for (size_t k = 0; k < dimer.dof; k++)
        for (size_t i = 0; i < n; i++)
            path[k * n + i] =
                path[k * n] + (path[k * n + n - 1] - path[k * n]) * (double)i / (double)(n - 1);
    settings.adam_steps = 200;
    struct phys_path_info info = solve(&dimer, &settings, path);
    assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
    for (size_t k = 0; k < dimer.dof * n; k++)
        assert_close(path[k], expected[k], 0, 1e-3); /* of rule left */
    free(expected);
    free(path);
    phys_system_close(&dimer);
}

/* C12: a chain of neighbours goes by coordinate in Newton's band; where L is quadratic the first
   step is the answer. */
static ad_var chain(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var stretched = ad_sub(ad_slice_rows(q, 1, 11), ad_slice_rows(q, 0, 11));
    (void)t;
    (void)params;
    return ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(v)), ad_sum_rows(ad_square(stretched))));
}

static enum ad_status chain_start(const void *params, uint64_t seed, double *q, double *v,
                                  struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    for (size_t k = 0; k < 12; k++) {
        q[k] = sin(1.7 * (double)k);
        v[k] = cos(2.3 * (double)k);
    }
    return AD_OK;
}

static void chain_of_neighbours(void **state)
{
    static const char *const rules[] = {"left", "gauss2", "gauss3"};
    const struct phys_scene scene = scene_of("chain", 12, chain, 9, 0.05, chain_start);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    phys_system_make(&scene, &system, &error);
    assert_no_error(&error);
    for (size_t r = 0; r < LENGTH(rules); r++) {
        struct phys_path_settings settings = settings_of(&system, rules[r]);
        settings.slices = 9;
        settings.dt = 0.05;
        double *path = motion(&system, &settings), *expected = motion(&system, &settings);
        phys_noise_add(&(struct phys_noise){.sigma = 0.3}, &system, 9, 5, path);
        struct phys_path_info info = solve(&system, &settings, path);
        assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
        assert_in_range(info.steps, 1, 6);
        for (size_t k = 0; k < 12 * 9; k++)
            assert_close(path[k], expected[k], 0, r ? 1e-6 : 1e-2);
        free(path);
        free(expected);
    }
    phys_system_close(&system);
}

/* ---- refusals ---- */

static void wrong_settings_are_refused(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("spring", &system, &error);
    double path[100] = {0};
    struct phys_path_info info;
    const struct phys_solver *newton = phys_solver_find("newton", &error);
    assert_no_error(&error);
    struct phys_path_settings settings = settings_of(&system, "left");
    settings.energy_weight = 1;
    assert_int_equal(phys_path_solve(newton, &system, &settings, path, &info, &error),
                     AD_E_ARGUMENT);
    error = (struct ad_error){0};
    settings = settings_of(&system, "left");
    settings.hold = 50;
    assert_int_equal(phys_path_solve(newton, &system, &settings, path, &info, &error),
                     AD_E_ARGUMENT);
    error = (struct ad_error){0};
    settings = settings_of(&system, "left");
    settings.learning_rate = 0; /* of steps of adam alone */
    assert_int_equal(phys_path_solve(newton, &system, &settings, path, &info, &error), AD_OK);
    settings.adam_steps = 1;
    assert_int_equal(phys_path_solve(newton, &system, &settings, path, &info, &error),
                     AD_E_ARGUMENT);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_starts_reach_the_ode_path),
        cmocka_unit_test(published_double_pendulum_becomes_stationary),
        cmocka_unit_test(published_gas_becomes_stationary),
        cmocka_unit_test(gas_returns_to_its_motion),
        cmocka_unit_test(index_on_the_true_path),
        cmocka_unit_test(action_of_the_figure_eight),
        cmocka_unit_test(second_variation_of_every_rule),
        cmocka_unit_test(oscillator_turns_into_a_saddle),
        cmocka_unit_test(steps_of_adam_that_lead_away_are_taken_back),
        cmocka_unit_test(chain_of_neighbours),
        cmocka_unit_test(wrong_settings_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
