/* All paths where the mass depends on velocity or position, or with many coordinates; interrupted
   searches, and refusals. */
#include "physics/path/verify/grid_independence.h"
#include "physics/path/internal.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An oscillator with the mass of relativity, c = 1: L = 1 - sqrt(1 - v^2) - x^2 / 2. */
static ad_var relativistic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    (void)params;
    return ad_sub(ad_sub(1.0, ad_sqrt(ad_sub(1.0, ad_square(v)))), ad_mul(0.5, ad_square(q)));
}

/* Half of its period: with E = (1 - v^2)^(-1/2) - 1 + x^2 / 2, the integral over x = a sin u of
   du (1 + a^2 cos^2 u / 2) / sqrt(1 + a^2 cos^2 u / 4). */
static double half_period(double a)
{
    enum { POINTS = 200 }; /* periodic: midpoints converge at once */
    double sum = 0;
    for (size_t k = 0; k < POINTS; k++) {
        double square = a * a * pow(cos(M_PI * ((double)k + 0.5) / POINTS), 2);
        sum += (1 + square / 2) / sqrt(1 + square / 4);
    }
    return M_PI * sum / POINTS;
}

static enum ad_status slowly_at_zero(const void *params, uint64_t seed, double *q, double *v,
                                     struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    *q = 0;
    *v = 0.1;
    return AD_OK;
}

/* From x = 0 back to it: rest, and whole halves of a period, each in both directions. */
static void a_mass_that_depends_on_the_velocity(void **state)
{
    enum { SLICES = 101, TURNS = 3 };
    const double time = 10;
    const struct phys_scene scene =
        scene_of("relativistic", 1, relativistic, SLICES, time / (SLICES - 1), slowly_at_zero);
    struct phys_system system;
    struct ad_error error = {0};
    double path[4 * SLICES] = {0};
    size_t expected = 1;
    (void)state;
    phys_system_make(&scene, &system, &error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss4", &error),
                                          .slices = SLICES,
                                          .dt = scene.dt,
                                          .learning_rate = 1};
    struct phys_solutions all;
    phys_path_all(&system, &settings, path, 0, 1, &all, &error);
    assert_no_error(&error);
    assert_true(all.exhaustive);
    for (size_t turns = 1; turns <= TURNS; turns++) {
        double low = 0, high = 20, share = time / (double)turns;
        for (int k = 0; k < 60; k++) {
            double middle = 0.5 * (low + high);
            *(half_period(middle) < share ? &low : &high) = middle;
        }
        size_t found = 0;
        for (size_t k = 0; k < all.n; k++)
            if (is_close(all.solution[k].energy, 0.5 * low * low, 1e-6, 0))
                found = all.solution[k].copies;
        assert_int_equal(found, 2);
        expected++;
    }
    assert_int_equal(all.n, expected);
    phys_solutions_free(&all);
    phys_system_close(&system);
}

enum { MANY = PHYS_SHOOTING_DOF + 2 };

static enum ad_status at_zero(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    *q = 0;
    *v = 1;
    return AD_OK;
}

/* The pendulum in x with theta = x + x^3 / 9, so that its mass depends on x. */
static ad_var bent(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var square = ad_square(q), stretch = ad_add(1.0, ad_mul(1. / 3, square));
    ad_var theta = ad_mul(q, ad_add(1.0, ad_mul(1. / 9, square)));
    (void)t;
    (void)params;
    return ad_sub(ad_mul(0.5, ad_square(ad_mul(stretch, v))), ad_sub(1.0, ad_cos(theta)));
}

static void a_mass_that_depends_on_the_place(void **state)
{
    static const double known[] = {0, 0.42766904, 1.76375516, 1.99854509};
    enum { SLICES = 81 };
    const struct phys_scene scene = scene_of("bent", 1, bent, SLICES, 10. / (SLICES - 1), at_zero);
    struct phys_system system;
    struct ad_error error = {0};
    double path[4 * SLICES] = {0};
    (void)state;
    phys_system_make(&scene, &system, &error);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss4", &error),
                                          .slices = SLICES,
                                          .dt = scene.dt,
                                          .learning_rate = 1};
    struct phys_solutions all;
    phys_path_all(&system, &settings, path, 0, 1, &all, &error);
    assert_no_error(&error);
    assert_true(all.exhaustive);
    assert_int_equal(all.n, LENGTH(known));
    for (size_t k = 0; k < all.n; k++) {
        assert_close(all.solution[k].energy, known[k], 0, 1e-7);
        assert_int_equal(all.solution[k].copies, k ? 2 : 1);
    }
    phys_solutions_free(&all);
    phys_system_close(&system);
}

static ad_var oscillators(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    (void)params;
    return ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(v)), ad_sum_rows(ad_square(q))));
}

static enum ad_status all_at_one(const void *params, uint64_t seed, double *q, double *v,
                                 struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    for (size_t k = 0; k < MANY; k++) {
        q[k] = 1;
        v[k] = 0;
    }
    return AD_OK;
}

/* With more coordinates than shooting takes, paths are listed, and those that the motion does not
   follow are marked: steps of 1.5 turn an oscillator by an angle that is not 1.5. */
static void many_coordinates_are_listed(void **state)
{
    enum { SLICES = 9 };
    const struct phys_scene scene =
        scene_of("oscillators", MANY, oscillators, SLICES, 0.1, all_at_one);
    static const double steps[] = {0.1, 1.5};
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    phys_system_make(&scene, &system, &error);
    for (size_t c = 0; c < LENGTH(steps); c++) {
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find("left", &error),
                                              .slices = SLICES,
                                              .dt = steps[c],
                                              .learning_rate = 1};
        double path[MANY * SLICES];
        for (size_t k = 0; k < MANY * SLICES; k++)
            path[k] = cos(steps[c] * (double)(k % SLICES));
        struct phys_solutions all;
        phys_path_all(&system, &settings, path, 5, 1, &all, &error);
        assert_no_error(&error);
        assert_int_equal(all.n, 1);
        assert_int_equal(all.unresolved, 0);
        assert_int_equal(all.solution[0].resolved, c == 0);
        phys_solutions_free(&all);
    }
    phys_system_close(&system);
}

/* The slices of a rule of several nodes: cos t is the motion; with a force in the last element it
   is not. */
static void many_coordinates_are_followed_to_the_last_element(void **state)
{
    enum { SLICES = 9 };
    const double dt = 0.3, last = (SLICES - 2) * dt;
    const struct phys_scene scene =
        scene_of("oscillators", MANY, oscillators, SLICES, dt, all_at_one);
    static double path[4 * MANY * SLICES];
    struct phys_system system;
    struct phys_rule_table table;
    struct ad_error error = {0};
    (void)state;
    phys_system_make(&scene, &system, &error);
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = phys_rule_find("gauss4", &error),
                                                .slices = SLICES,
                                                .dt = dt,
                                                .learning_rate = 1};
    settings.rule->fill(settings.rule, &table);
    for (int forced = 0; forced < 2; forced++) {
        bool confirmed = forced;
        for (size_t k = 0; k < LENGTH(path); k++) {
            double t = dt * ((double)(k % SLICES) + table.node[k / (MANY * SLICES)]);
            path[k] = cos(t) + (forced ? 0.5 * pow(fmax(0, t - last), 2) : 0);
        }
        phys_path_grid_independent(&system, &settings, path, &confirmed, &error);
        assert_no_error(&error);
        assert_int_equal(confirmed, !forced);
    }
    phys_system_close(&system);
}

static bool ask_again(void *context)
{
    int *left = context;
    return (*left)-- > 0;
}

/* B3: a search that is asked to end has what it found so far, and never claims to have all;
   Newton's method ends within a step, the path being that of the last. */
static void a_search_that_is_ended(void **state)
{
    enum { SLICES = 101 };
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    phys_system_open("pendulum", &pendulum, &error);
    phys_system_set(&pendulum, "l", 1, &error);
    int left = 5000; /* a spectrum asks at every slice */
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss4", &error),
                                          .slices = SLICES,
                                          .steps = 50,
                                          .dt = 10. / (SLICES - 1),
                                          .proceed = ask_again,
                                          .context = &left,
                                          .learning_rate = 1};
    double path[4 * SLICES] = {0}, before[4 * SLICES];
    struct phys_solutions all;
    phys_path_all(&pendulum, &settings, path, 0, 1, &all, &error);
    assert_no_error(&error);
    assert_true(all.interrupted && !all.exhaustive);
    assert_in_range(all.n, 1, 3);
    phys_solutions_free(&all);
    struct phys_path_info info;
    for (size_t k = 1; k + 1 < SLICES; k++)
        path[k] = 1;
    memcpy(before, path, sizeof before);
    left = 0;
    phys_path_solve(phys_solver_find("newton", &error), &pendulum, &settings, path, &info, &error);
    assert_no_error(&error);
    assert_int_equal(info.stop, PHYS_STOP_INTERRUPTED);
    assert_int_equal(info.steps, 0);
    assert_memory_equal(path, before, sizeof before);
    phys_system_close(&pendulum);
}

/* C12: what does not fit into the memory is refused before anything is allocated. */
static void newton_refuses_what_does_not_fit(void **state)
{
    (void)state;
    enum { TOO_MANY = 10000000 };
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("pendulum", &system, &error);
    system.dof = TOO_MANY;
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find("gauss5", &error),
                                          .slices = 1000,
                                          .steps = 1,
                                          .dt = 1,
                                          .learning_rate = 1};
    struct phys_path_info info;
    double never_read = 0;
    assert_int_equal(
        phys_solver_find("newton", &error)->solve(&system, &settings, &never_read, &info, &error),
        AD_E_ARGUMENT);
    assert_mentions(error.message, "10000000");
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mass_that_depends_on_the_velocity),
        cmocka_unit_test(a_mass_that_depends_on_the_place),
        cmocka_unit_test(many_coordinates_are_listed),
        cmocka_unit_test(many_coordinates_are_followed_to_the_last_element),
        cmocka_unit_test(a_search_that_is_ended),
        cmocka_unit_test(newton_refuses_what_does_not_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
