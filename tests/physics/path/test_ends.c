/* Paths with coordinates left free at an end, free end times and windings, against closed forms. A
   momentum is measured on the motion from the path's start, never on the path's own equations. */
#include "tests/close.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "physics/path/newton.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const bool free_one[] = {true};

/* Error of the path of a rule at all slices; info and spectrum of it, where wanted. */
static double error_of(const struct phys_system *system, const char *rule, size_t slices, double T,
                       const struct phys_ends *ends, double first, double last,
                       double (*exact)(double t, double T), struct phys_path_found *found)
{
    struct ad_error error = {0};
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find(rule, &error),
                                          .slices = slices,
                                          .steps = 100,
                                          .dt = T / (double)(slices - 1),
                                          .ends = ends};
    double *path = calloc(settings.rule->degree * slices, sizeof *path), most = 0;
    for (size_t i = 0; i < slices; i++)
        path[i] = first + (last - first) * (double)i / (double)(slices - 1);
    phys_rule_interpolate(settings.rule, 1, slices, path);
    phys_path_find(&phys_solver_newton, system, &settings, path, found, &error);
    assert_no_error(&error);
    assert_int_equal(found->info.stop, PHYS_STOP_ROUNDING);
    for (size_t i = 0; i < slices; i++)
        most = fmax(most, fabs(path[i] - exact((double)i * settings.dt, T)));
    free(path);
    return most;
}

static double end_at_rest(double t, double T) { return 0.7 * cos(T - t) / cos(T); }
static double start_at_rest(double t, double T) { return 0.7 * cos(t) / cos(T); }

/* Oscillator: x = cos(T - t) / cos T has no momentum at T. By every rule, to its order; the index
   counts the zeros of the cosine. */
static void oscillator_with_a_free_end(void **state)
{
    (void)state;
    const struct phys_ends end = {.size = sizeof end, .free = {NULL, free_one}},
                           start = {.size = sizeof start, .free = {free_one, NULL}};
    const struct {
        const struct phys_ends *ends;
        double T, first, last;
        double (*exact)(double, double);
        size_t index;
    } cases[] = {{&end, 1.1, 0.7, 0.3, end_at_rest, 0},
                 {&end, 2.3, 0.7, 0.3, end_at_rest, 1},
                 {&end, 5.3, 0.7, 0.3, end_at_rest, 2},
                 {&start, 1.1, 0.2, 0.7, start_at_rest, 0},
                 {&start, 2.3, 0.2, 0.7, start_at_rest, 1}};
    struct phys_system system = system_opened("spring");
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (const struct phys_rule *const *rule = phys_rules; *rule; rule++) {
            double error[2];
            struct phys_path_found found;
            for (size_t fine = 0; fine < 2; fine++) {
                error[fine] =
                    error_of(&system, (*rule)->name, fine ? 129 : 65, cases[k].T, cases[k].ends,
                             cases[k].first, cases[k].last, cases[k].exact, &found);
                assert_int_equal(found.spectrum.index, cases[k].index);
                assert_int_equal(found.spectrum.n_conjugate, 0);
                if (cases[k].ends == &end && (*rule)->order > 1)
                    assert_true(found.free_momentum < 20 * error[fine] + 1e-10);
                phys_path_found_free(&found);
            }
            double fall = 0.8 * pow(2, (double)(*rule)->order);
            if (error[1] > 1e-12)
                assert_true(error[0] > fall * error[1]);
            assert_true(error[1] < ((*rule)->order == 1 ? 0.3 : 2e-3));
        }
    phys_system_close(&system);
}

static double thrown(double t, double T) { return 0.4 + T * t - t * t / 2; }

/* x'' = -1 to a height left free: it arrives at rest. All rules from the second order on have the
   exact path; it is the same where the start is free and the motion runs the other way. */
static void body_in_gravity(void **state)
{
    (void)state;
    const struct phys_ends end = {.size = sizeof end, .free = {NULL, free_one}};
    struct phys_system system = system_opened("freebody");
    struct phys_path_found found;
    double error = error_of(&system, "gauss2", 9, 3.1, &end, 0.4, 0.4, thrown, &found);
    assert_true(error < 1e-12);
    assert_true(found.true_distance < 1e-10); /* the motion from its own start */
    phys_path_found_free(&found);
    error = error_of(&system, "left", 65, 3.1, &end, 0.4, 0.4, thrown, &found);
    assert_true(error < 0.2 && error > 1e-3);
    phys_path_found_free(&found);
    phys_system_close(&system);
}

/* ---- quickest descent to a wall ---- */

/* The Lagrangian of the brachistochrone in x itself and u = sqrt(drop), g = 1. */
static ad_var chute(ad_var q, ad_var v, ad_var t, const void *p)
{
    ad_var u = ad_row(q, 1), dx = ad_row(v, 0), du = ad_row(v, 1);
    (void)t, (void)p;
    ad_var metric = ad_add(ad_mul(4, ad_square(du)), ad_square(ad_div(dx, u)));
    return ad_add(ad_mul(0.25, metric), 0.5);
}

static enum ad_status at_the_top(const void *p, uint64_t seed, double *q, double *v,
                                 struct ad_error *error)
{
    (void)p, (void)seed, (void)error;
    q[0] = 0, q[1] = 0.5, v[0] = v[1] = 1;
    return AD_OK;
}

static const struct phys_scene wall = {.version = PHYS_SCENE_VERSION,
                                       .size = sizeof(struct phys_scene),
                                       .name = "wall",
                                       .what = "quickest descent to a wall",
                                       .dof = 2,
                                       .dims = 2,
                                       .coordinates = (const char *const[]){"x", "u"},
                                       .unit = "m",
                                       .time_unit = "s",
                                       .energy_unit = "J",
                                       .lagrangian = chute,
                                       .slices = 21,
                                       .dt = 0.1,
                                       .start = at_the_top};

/* Height of arrival free: the cycloid arrives at the wall horizontally, at half a turn of its
   circle. From a point of it, where the circle has turned by phi. */
static void chute_to_a_wall(void **state)
{
    enum { N = 17 };
    const double phi = 0.9, r = 0.8;
    const double x0 = r * (phi - sin(phi)), x1 = r * M_PI, T = (M_PI - phi) * sqrt(r);
    (void)state;
    struct ad_error error = {0};
    struct phys_system system;
    phys_system_make(&wall, &system, &error);
    assert_no_error(&error);
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {NULL, (const bool[]){false, true}}, .free_time = true};
    const double u0 = sqrt(2 * r) * sin(phi / 2);
    struct phys_path_settings settings = {
        .size = sizeof settings, .slices = N, .steps = 100, .dt = 3.0 / (N - 1), .ends = &ends};
    double line[2 * N];
    for (size_t i = 0; i < N; i++) {
        line[i] = x0 + (x1 - x0) * (double)i / (N - 1);
        line[N + i] = u0;
    }
    struct phys_refined refined;
    phys_path_refine(&system, &settings, line, 0, 1e-9, &refined, &error);
    assert_no_error(&error);
    const struct phys_path_settings *s = refined.settings;
    size_t n = s->slices;
    assert_close(s->dt * (double)(n - 1), T, 0, 1e-9);
    for (size_t i = 0; i < n; i++) {
        double angle = phi + (M_PI - phi) * (double)i / (double)(n - 1);
        assert_close(refined.path[i], r * (angle - sin(angle)), 1e-9, 0);
        assert_close(refined.path[n + i], sqrt(2 * r) * sin(angle / 2), 1e-9, 0);
    }
    assert_true(refined.level[refined.n - 1].estimate < 1e-9);
    phys_refined_free(&refined);
    phys_system_close(&system);
}

/* ---- windings ---- */

static double agm(double a, double b)
{
    while (fabs(a - b) > 1e-15 * a) {
        double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
    }
    return a;
}

/* A pendulum that turns over w times, from below to below: with the rate W there and k = 2 / W a
   turn takes 4 K(k) / W. Fixed time gives the rate, and the energy the time. */
static void pendulum_that_turns_over(void **state)
{
    enum { N = 33 };
    const double W = 2.3, k = 2 / W, turn = 4 / W * M_PI / (2 * agm(1, sqrt(1 - k * k)));
    (void)state;
    struct phys_system system = system_opened("pendulum");
    system_set(&system, "l", 1);
    const struct phys_ends of_energy = {
        .size = sizeof of_energy, .free_time = true, .energy = W * W / 2};
    for (int turns = -2; turns <= 2; turns++)
        for (int free_time = 0; turns != 0 && free_time < 2; free_time++) {
            double line[N], p, time = turn * abs(turns) * (free_time ? 1.1 : 1);
            struct ad_error error = {0};
            struct phys_refined refined;
            struct phys_path_info info;
            struct phys_path_settings settings = {.size = sizeof settings,
                                                  .slices = N,
                                                  .steps = 100,
                                                  .dt = time / (N - 1),
                                                  .ends = free_time ? &of_energy : NULL};
            for (size_t i = 0; i < N; i++)
                line[i] = 2 * M_PI * turns * (double)i / (N - 1);
            phys_path_refine(&system, &settings, line, 0, 1e-8, &refined, &error);
            assert_no_error(&error);
            struct phys_path_settings s = *refined.settings;
            size_t n = s.slices;
            assert_true(refined.path[n - 1] == line[N - 1]);
            assert_close(s.dt * (double)(n - 1), turn * abs(turns), 0, 1e-8);
            s.start_momentum = &p;
            phys_path_solve(&phys_solver_newton, &system, &s, refined.path, &info, &error);
            assert_no_error(&error);
            assert_close(p, turns > 0 ? W : -W, 1e-7, 0);
            assert_close(info.energy_mean, W * W / 2, 1e-7, 0);
            phys_refined_free(&refined);
        }
    phys_system_close(&system);
}

/* ---- refusals ---- */

static ad_var driven(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)p;
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(q, ad_sin(t)));
}

static void what_is_refused(void **state)
{
    (void)state;
    const struct phys_ends end = {.size = sizeof end, .free = {NULL, free_one}};
    struct phys_system spring = system_opened("spring"), body = system_opened("freebody"), pushed;
    struct phys_path_settings settings = phys_path_defaults(&spring);
    struct phys_path_info info;
    struct phys_solutions all;
    struct ad_error error = {0};
    double path[100] = {0};
    settings.ends = &end;
    assert_int_equal(phys_path_solve(phys_solvers[0], &spring, &settings, path, &info, &error),
                     AD_E_ARGUMENT);
    error = (struct ad_error){0};
    const struct phys_ends open = {
        .size = sizeof open, .free_time = true, .free = {NULL, free_one}};
    settings.ends = &open;
    assert_int_equal(phys_path_all(&spring, &settings, path, 10, 1, &all, &error), AD_E_ARGUMENT);
    settings.ends = &end;
    error = (struct ad_error){0};
    settings.hold = 2;
    assert_int_equal(phys_path_solve(&phys_solver_newton, &spring, &settings, path, &info, &error),
                     AD_E_ARGUMENT);
    settings = phys_path_defaults(&body); /* from 0 to 0: energy -5 has no path, there is V >= -0 */
    error = (struct ad_error){0};
    assert_int_equal(phys_path_free_time(&body, &settings, -5, path, &info, &error), AD_E_ACCURACY);
    struct phys_scene scene = wall;
    scene.dof = scene.dims = 1;
    scene.lagrangian = driven;
    scene.coordinates = NULL;
    error = (struct ad_error){0};
    phys_system_make(&scene, &pushed, &error);
    assert_no_error(&error);
    settings = phys_path_defaults(&spring);
    assert_int_equal(phys_path_free_time(&pushed, &settings, 0, path, &info, &error),
                     AD_E_ARGUMENT);
    phys_system_close(&pushed);
    phys_system_close(&spring);
    phys_system_close(&body);
}

/* A path by the derivatives of L that grids share is that by a recording of its own: action,
   energy, gradient and what is held. */
static void shared_derivatives_find_the_same(void **state)
{
    enum { SLICES = 33 };
    static const struct phys_ends given = {.size = sizeof given},
                                  end = {.size = sizeof end, .free = {NULL, free_one}};
    static const struct {
        const char *rule;
        size_t hold;
        const struct phys_ends *ends;
    } cases[] = {{"left", 1, &given},        {"left", 4, &given}, {"gauss3", 3, &given},
                 {"left+repeat", 2, &given}, {"left", 1, &end},   {"gauss2", 1, &end}};
    struct phys_system system = system_opened("spring");
    struct ad_error error = {0};
    (void)state;
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        double path[2][4 * SLICES];
        struct phys_path_info info[2];
        struct phys_derivatives of = {0};
        const struct phys_path_settings settings = {.size = sizeof settings,
                                                    .rule = phys_rule_find(cases[c].rule, &error),
                                                    .slices = SLICES,
                                                    .steps = 100,
                                                    .dt = 2.0 / (SLICES - 1),
                                                    .hold = cases[c].hold,
                                                    .ends = cases[c].ends};
        for (size_t i = 0; i < SLICES; i++)
            path[0][i] = 0.3 + 0.2 * sin(0.4 * (double)i);
        phys_rule_interpolate(settings.rule, 1, SLICES, path[0]);
        memcpy(path[1], path[0], sizeof *path);
        phys_derivatives_new(&of, &system, 20, NULL, &error);
        phys_newton_over(&system, &settings, &of, false, path[0], &info[0], &error);
        phys_path_solve(&phys_solver_newton, &system, &settings, path[1], &info[1], &error);
        assert_no_error(&error);
        for (size_t k = 0; k < 2; k++)
            assert_int_equal(info[k].stop, PHYS_STOP_ROUNDING);
        for (size_t i = 0; i < SLICES; i++)
            assert_close(path[0][i], path[1][i], 0, 1e-12);
        assert_close(info[0].action, info[1].action, 0, 1e-12);
        assert_close(info[0].energy_mean, info[1].energy_mean, 0, 1e-12);
        phys_derivatives_free(&of);
    }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(oscillator_with_a_free_end),
        cmocka_unit_test(body_in_gravity),
        cmocka_unit_test(chute_to_a_wall),
        cmocka_unit_test(pendulum_that_turns_over),
        cmocka_unit_test(shared_derivatives_find_the_same),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
