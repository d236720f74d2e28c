/* Paths whose ends keep linear relations, against closed forms. */
#include "physics/path/internal.h"
#include "tests/close.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const bool both[] = {true, true, true, true, true, true};

/* ---- an oscillator with x(T) = a x(0) + b ---- */

/* A cos t + B sin t, with a p(T) = p(0) by transversality. */
static void coefficients(double a, double b, double T, double *A, double *B)
{
    double c = cos(T), s = sin(T), m[4] = {c - a, s, -a * s, a * c - 1};
    double det = m[0] * m[3] - m[1] * m[2];
    *A = b * m[3] / det;
    *B = -b * m[2] / det;
}

/* Jacobi fields that keep the relation with b = 0 have frequencies with cos(w T) = 2 a / (1 + a^2),
   and the second variation the eigenvalues w^2 - 1. */
static size_t negative(double a, double T, double *smallest)
{
    double angle = acos(2 * a / (1 + a * a));
    size_t count = angle < T;
    *smallest = angle / T * angle / T - 1;
    for (double turn = 2 * M_PI; turn - angle < T; turn += 2 * M_PI)
        count += turn + angle < T ? 2 : 1;
    return count;
}

static double oscillator_error(const struct phys_system *system, const struct phys_solver *solver,
                               const struct phys_rule *rule, size_t slices, double a, double b,
                               double T, struct phys_path_found *found)
{
    const double relation[] = {-a, 1, b};
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {both, both}, .n_relations = 1, .relation = relation};
    struct ad_error error = {0};
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = rule,
                                                .slices = slices,
                                                .steps = 10000,
                                                .learning_rate = 0.1,
                                                .dt = T / (double)(slices - 1),
                                                .ends = &ends};
    double *path = calloc(rule->degree * slices, sizeof *path), A, B, most = 0;
    phys_path_find(solver, system, &settings, path, found, &error);
    assert_no_error(&error);
    coefficients(a, b, T, &A, &B);
    for (size_t i = 0; i < slices; i++) {
        double t = (double)i * settings.dt;
        most = fmax(most, fabs(path[i] - A * cos(t) - B * sin(t)));
    }
    assert_close(path[slices - 1], a * path[0] + b, 1e-14, 1e-14);
    free(path);
    return most;
}

static void oscillator(void **state)
{
    static const double as[] = {-1, 1, 0.6, -1.7}, times[] = {1.1, 2.3, 5.3, 7.7};
    struct phys_system system = system_opened("spring");
    (void)state;
    for (size_t k = 0; k < LENGTH(as) * LENGTH(times); k++)
        for (const struct phys_rule *const *rule = phys_rules; *rule; rule++) {
            const double a = as[k % LENGTH(as)], T = times[k / LENGTH(as)];
            double error[2], smallest;
            const size_t index = negative(a, T, &smallest);
            for (size_t fine = 0; fine < 2; fine++) {
                struct phys_path_found found;
                error[fine] = oscillator_error(&system, &phys_solver_newton, *rule, fine ? 129 : 65,
                                               a, 0.7, T, &found);
                assert_int_equal(found.info.stop, PHYS_STOP_ROUNDING);
                assert_false(found.spectrum.undetermined);
                assert_int_equal(found.spectrum.index, index);
                assert_int_equal(found.spectrum.n_conjugate, 0);
                if ((*rule)->order > 3)
                    assert_close(found.spectrum.second_variation, smallest, 1e-6, 1e-9);
                if ((*rule)->order > 1)
                    assert_true(found.free_momentum < 100 * error[fine] + 1e-10);
                phys_path_found_free(&found);
            }
            if (error[1] > 1e-11)
                assert_true(error[0] > 0.75 * pow(2, (double)(*rule)->order) * error[1]);
            assert_true(error[1] < ((*rule)->order == 1 ? 1 : 6e-3));
        }
    phys_system_close(&system);
}

/* A minimum, by descent. */
static void oscillator_by_descent(void **state)
{
    struct phys_system system = system_opened("spring");
    struct phys_path_found found;
    struct ad_error error = {0};
    (void)state;
    const double away = oscillator_error(
        &system, &phys_solver_lbfgs, phys_rule_find("gauss2", &error), 17, -1, 0.7, 1.3, &found);
    assert_true(away < 1e-6);
    assert_true(found.free_momentum < 1e-5);
    phys_path_found_free(&found);
    phys_system_close(&system);
}

/* ---- Kepler's problem: the end is the start, turned ---- */

/* On the x axis and turned by `angle` after T: a circle. Radial momenta agree. */
static void turned_orbit(void **state)
{
    enum { N = 9 };
    const double angle = 2 * M_PI / 3, T = 3, r = pow(T / angle, 2.0 / 3);
    const double relation[] = {-cos(angle), 0, 1, 0, 0, -sin(angle), 0, 0, 1, 0};
    static const bool on_axis[] = {true, false};
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {on_axis, both}, .n_relations = 2, .relation = relation};
    struct phys_path_settings settings = {
        .size = sizeof settings, .slices = N, .steps = 100, .dt = T / (N - 1), .ends = &ends};
    struct phys_system system = system_opened("kepler");
    struct phys_refined refined;
    struct ad_error error = {0};
    double line[2 * N];
    (void)state;
    for (size_t i = 0; i < N; i++) {
        line[i] = 1 - 1.5 * (double)i / (N - 1);
        line[N + i] = 0.9 * (double)i / (N - 1);
    }
    phys_path_refine(&system, &settings, line, 0, 1e-10, &refined, &error);
    assert_no_error(&error);
    const size_t n = refined.settings->slices;
    for (size_t i = 0; i < n; i++) {
        double at = angle * (double)i / (double)(n - 1);
        assert_close(refined.path[i], r * cos(at), 0, 1e-10);
        assert_close(refined.path[n + i], r * sin(at), 0, 1e-10);
    }
    assert_false(refined.spectrum.undetermined);
    phys_refined_free(&refined);
    phys_system_close(&system);
}

/* Left free to be turned as a whole it is one of a family: no index, and no tolerance is met. */
static void orbit_of_a_family(void **state)
{
    enum { N = 9, FINE = 17 };
    const double angle = 2 * M_PI / 3, T = 3, r = pow(T / angle, 2.0 / 3);
    const double relation[] = {-cos(angle), sin(angle), 1, 0, 0, -sin(angle), -cos(angle), 0, 1, 0};
    const struct phys_ends ends = {
        .size = sizeof ends, .free = {both, both}, .n_relations = 2, .relation = relation};
    struct phys_path_settings settings = {
        .size = sizeof settings, .slices = N, .steps = 100, .dt = T / (N - 1), .ends = &ends};
    struct phys_system system = system_opened("kepler");
    struct phys_refined refined;
    struct phys_path_found found;
    struct ad_error error = {0};
    double path[8 * FINE];
    (void)state;
    for (size_t i = 0; i < FINE; i++) {
        double at = angle * (double)i / (FINE - 1);
        path[i] = 1.1 * r * cos(at) + 0.02;
        path[FINE + i] = 0.9 * r * sin(at);
    }
    double coarse[2 * N];
    for (size_t k = 0; k < 2 * N; k++)
        coarse[k] = path[k / N * FINE + k % N * 2];
    assert_int_equal(phys_path_refine(&system, &settings, coarse, 0, 1e-6, &refined, &error),
                     AD_E_ACCURACY);
    phys_refined_free(&refined);
    error = (struct ad_error){0};
    settings.rule = phys_rule_find("gauss4", &error);
    settings.slices = FINE;
    settings.dt = T / (FINE - 1);
    phys_rule_interpolate(settings.rule, 2, FINE, path);
    phys_path_find(&phys_solver_newton, &system, &settings, path, &found, &error);
    assert_no_error(&error);
    assert_int_equal(found.info.stop, PHYS_STOP_ROUNDING);
    for (size_t i = 0; i < FINE; i++)
        assert_close(hypot(path[i], path[FINE + i]), r, 0, 1e-9);
    assert_true(found.free_momentum < 1e-9);
    assert_true(found.spectrum.undetermined);
    phys_path_found_free(&found);
    phys_system_close(&system);
}

/* ---- refusals ---- */

static void what_is_refused(void **state)
{
    static const bool end_given[] = {false};
    static const struct {
        const bool *free[2];
        size_t n;
        double relation[6];
        const char *what;
    } cases[] = {
        {{both, both}, 2, {1, -1, 0.2, 2, -2, 0.4}, "relation 2 between the ends follows"},
        {{both, both}, 2, {1, -1, 0.2, 2, -2, 0.5}, "relation 2 between the ends contradicts"},
        {{both, both}, 1, {0, 0, 0}, "relation 1 between the ends follows"},
        {{both, both}, 1, {0, 0, 1}, "relation 1 between the ends contradicts"},
        {{NULL, end_given}, 1, {1, -1, -0.3}, "relation 1 between the ends follows"},
        {{NULL, end_given}, 1, {1, -1, 0.3}, "relation 1 between the ends contradicts"},
        {{both, both}, 1, {1, NAN, 0.3}, "relation 1 between the ends: got nan"},
    };
    struct phys_system system = system_opened("spring");
    (void)state;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        const struct phys_ends ends = {.size = sizeof ends,
                                       .free = {cases[k].free[0], cases[k].free[1]},
                                       .n_relations = cases[k].n,
                                       .relation = cases[k].relation};
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct phys_path_info info;
        struct ad_error error = {0};
        double path[5] = {0, 0, 0, 0, 0.3};
        settings.slices = 5;
        settings.ends = &ends;
        assert_int_equal(
            phys_path_solve(&phys_solver_newton, &system, &settings, path, &info, &error),
            AD_E_ARGUMENT);
        if (!strstr(error.message, cases[k].what))
            fail_msg("'%s' for '%s'", error.message, cases[k].what);
        error = (struct ad_error){0};
        assert_int_equal(phys_path_solve(&phys_solver_sgd, &system, &settings, path, &info, &error),
                         AD_E_ARGUMENT);
    }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(oscillator),      cmocka_unit_test(oscillator_by_descent),
        cmocka_unit_test(turned_orbit),    cmocka_unit_test(orbit_of_a_family),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
