/* The kind of a stationary path and the points conjugate to its start: against closed forms, and
   against the determinant of ends by differences of the initial velocity. */
#include "physics/path/internal.h"
#include "physics/physics.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLICES = 101, MOST_DOF = 20 };

static enum ad_status at_one(const void *params, uint64_t seed, double *q, double *v,
                             struct ad_error *error)
{
    static const double q0[] = {12, 0, 0}, v0[] = {0, 1.15, 0.026625};
    (void)params, (void)seed, (void)error;
    memcpy(q, q0, sizeof q0);
    memcpy(v, v0, sizeof v0);
    return AD_OK;
}

/* A plane oscillator of frequency 1 seen from a frame that turns: every motion meets at k pi. */
static ad_var foucault(ad_var q, ad_var v, ad_var t, const void *params)
{
    static const double turn = 0.1;
    ad_var x = ad_row(q, 0), y = ad_row(q, 1);
    ad_var twist = ad_sub(ad_mul(x, ad_row(v, 1)), ad_mul(y, ad_row(v, 0)));
    (void)t, (void)params;
    return ad_add(ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))),
                         ad_mul(0.5 * (1 - turn * turn), ad_sum_rows(ad_square(q)))),
                  ad_mul(turn, twist));
}

static ad_var falling(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(-0.5, ad_square(v));
}

/* A geodesic of Schwarzschild's metric in proper time, M = 1; r, t and the angle: L_vv has both
   signs. */
static ad_var geodesic(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var r = ad_row(q, 0), f = ad_sub(1.0, ad_div(2.0, r));
    (void)t, (void)params;
    return ad_mul(
        0.5, ad_add(ad_sub(ad_div(ad_square(ad_row(v, 0)), f), ad_mul(f, ad_square(ad_row(v, 1)))),
                    ad_mul(ad_square(r), ad_square(ad_row(v, 2)))));
}

/* Of a path made stationary by the rule, from the motion of the scene's start. */
static struct phys_spectrum examine(const struct phys_system *system, const char *rule, double dt)
{
    struct ad_error error = {0};
    struct phys_spectrum found;
    struct phys_path_info info;
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = phys_rule_find(rule, &error),
                                          .slices = SLICES,
                                          .steps = 100,
                                          .dt = dt};
    double q[20], v[20], *path = calloc(settings.rule->degree * system->dof * SLICES, sizeof *path);
    system->scene->start(system->params, 1, q, v, &error);
    phys_motion_path(system, NULL, q, v, SLICES, dt, path, &error);
    phys_rule_interpolate(settings.rule, system->dof, SLICES, path);
    phys_path_solve(phys_solver_find("newton", &error), system, &settings, path, &info, &error);
    assert_no_error(&error);
    assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
    phys_path_spectrum(system, &settings, path, &found, &error);
    phys_path_conjugate(system, &settings, path, &found, &error);
    assert_no_error(&error);
    free(path);
    return found;
}

/* A9: to the digits that are said to be known, on a coarse rule and on a fine one; beyond 32. */
static void oscillator_meets_again_at_half_periods(void **state)
{
    static const char *const rules[] = {"left", "gauss4"};
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    for (size_t r = 0; r < 2; r++) {
        struct phys_spectrum found = examine(&spring, rules[r], r ? 1.1 : 0.3);
        assert_true(found.of_motion && found.legendre == PHYS_POSITIVE);
        assert_int_equal(found.n_conjugate, r ? 35 : 9);
        for (size_t k = 0; k < found.n_conjugate; k++) {
            assert_close(found.conjugate[k].time, M_PI * (double)(k + 1), 1e-9, 0);
            assert_true(fabs(found.conjugate[k].time - M_PI * (double)(k + 1)) <
                        2 * found.conjugate[k].error);
        }
        phys_spectrum_free(&found);
    }
    phys_system_close(&spring);
}

/* A9: two at a time, counted twice. */
static void foucault_meets_again_in_both_directions(void **state)
{
    struct phys_scene scene = scene_of("test", 2, foucault, SLICES, 0.1, at_one);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    scene.start = at_one;
    phys_system_make(&scene, &system, &error);
    struct phys_spectrum found = examine(&system, "left", 0.07);
    assert_int_equal(found.index, 4);
    assert_int_equal(found.n_conjugate, 4);
    for (size_t k = 0; k < 4; k++)
        assert_close(found.conjugate[k].time, M_PI * (double)(k / 2 + 1), 1e-9, 0);
    phys_spectrum_free(&found);
    phys_system_close(&system);
}

/* A9: the figure of eight and the double pendulum, by the same determinant that the next test
   takes, at 1e-12. */
static void known_times(void **state)
{
    static const struct {
        const char *scene, *rule;
        double dt, first, second;
        size_t n;
    } cases[] = {{"figure8", "gauss4", 0.0632591, 4.798, 6.022, 2}};
    (void)state;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct phys_system system;
        struct ad_error error = {0};
        phys_system_open(cases[k].scene, &system, &error);
        struct phys_spectrum found = examine(&system, cases[k].rule, cases[k].dt);
        assert_int_equal(found.index, cases[k].n);
        assert_int_equal(found.n_conjugate, cases[k].n);
        assert_close(found.conjugate[0].time, cases[k].first, 0, 5e-4);
        assert_close(found.conjugate[1].time, cases[k].second, 0, 5e-4);
        phys_spectrum_free(&found);
        phys_system_close(&system);
    }
}

/* ---- by shooting ---- */

/* Determinant of the end positions by the start velocities, at time t. */
static double determinant(const struct phys_system *system, double t)
{
    size_t n = system->dof;
    struct ad_error error = {0};
    struct phys_ode ode;
    double d[MOST_DOF][MOST_DOF], det = 1;
    phys_ode_lagrangian(system, &ode, &error);
    for (size_t c = 0; c < n; c++)
        for (int side = -2; side <= 2; side++) {
            static const double weight[] = {1. / 12, -2. / 3, 0, 2. / 3, -1. / 12};
            struct phys_simulation run = {.size = sizeof run,
                                          .integrator = phys_integrator_find("dop853", &error),
                                          .t1 = t,
                                          .rtol = 1e-13,
                                          .atol = 1e-13};
            struct phys_simulation_info info;
            double y[2 * MOST_DOF], h = 2e-5;
            system->scene->start(system->params, 1, y, y + n, &error);
            y[n + c] += side * h;
            phys_simulate(&run, &ode, y, &info, &error);
            for (size_t r = 0; r < n; r++)
                d[r][c] = (side == -2 ? 0 : d[r][c]) + weight[side + 2] * y[r] / h;
        }
    assert_no_error(&error);
    phys_ode_free(&ode);
    for (size_t k = 0; k < n; k++) {
        size_t pivot = k;
        for (size_t r = k + 1; r < n; r++)
            if (fabs(d[r][k]) > fabs(d[pivot][k]))
                pivot = r;
        det *= pivot == k ? d[k][k] : -d[pivot][k];
        for (size_t c = k; c < n; c++) {
            double swapped = d[k][c];
            d[k][c] = d[pivot][c];
            d[pivot][c] = swapped;
        }
        for (size_t r = k + 1; r < n; r++)
            for (size_t c = n; c-- > k;)
                d[r][c] -= d[r][k] / d[k][k] * d[k][c];
    }
    return det;
}

/* The determinant changes its sign at each. */
static void assert_signs_change(const struct phys_system *system, const struct phys_spectrum *found)
{
    for (size_t k = 0; k < found->n_conjugate; k++) {
        double t = found->conjugate[k].time, before = determinant(system, t * (1 - 1e-6)),
               after = determinant(system, t * (1 + 1e-6));
        assert_true((before < 0) != (after < 0));
    }
}

/* A8: L_vv is indefinite: no index, but the fields are singular where the determinant is. */
static void geodesic_has_no_index(void **state)
{
    struct phys_scene scene = scene_of("test", 3, geodesic, SLICES, 0.1, at_one);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    phys_system_make(&scene, &system, &error);
    struct phys_spectrum found = examine(&system, "gauss3", 4);
    assert_int_equal(found.legendre, PHYS_INDEFINITE);
    assert_true(found.not_definite >= 0 && found.not_definite < 4);
    assert_true(found.n_conjugate > 0);
    assert_signs_change(&system, &found);
    phys_spectrum_free(&found);
    phys_system_close(&system);
}

/* A heavy symmetric top in Euler's angles. */
static ad_var top(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var tilt = ad_row(q, 0), turn = ad_row(v, 1);
    ad_var spin = ad_add(ad_row(v, 2), ad_mul(turn, ad_cos(tilt)));
    (void)t, (void)params;
    return ad_sub(ad_add(ad_mul(0.5, ad_add(ad_square(ad_row(v, 0)),
                                            ad_mul(ad_square(ad_sin(tilt)), ad_square(turn)))),
                         ad_mul(0.25, ad_square(spin))),
                  ad_cos(tilt));
}

static enum ad_status spinning(const void *params, uint64_t seed, double *q, double *v,
                               struct ad_error *error)
{
    static const double q0[] = {0.5, 0, 0}, v0[] = {0, 0, 10};
    (void)params, (void)seed, (void)error;
    memcpy(q, q0, sizeof q0);
    memcpy(v, v0, sizeof v0);
    return AD_OK;
}

/* A9: twos that lie 0.2 % apart. */
static void top_meets_twice_in_short_order(void **state)
{
    struct phys_scene scene = scene_of("test", 3, top, SLICES, 0.1, at_one);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    scene.start = spinning;
    phys_system_make(&scene, &system, &error);
    struct phys_spectrum found = examine(&system, "gauss3", 0.03);
    assert_int_equal(found.n_conjugate, 4);
    assert_close(found.conjugate[2].time, 2.7014012, 0, 1e-7);
    assert_close(found.conjugate[3].time, 2.7067544, 0, 1e-7);
    assert_signs_change(&system, &found);
    phys_spectrum_free(&found);
    phys_system_close(&system);
}

/* Toda's chain of 20. */
static ad_var toda(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var stretch = ad_sub(ad_slice_rows(q, 1, 19), ad_slice_rows(q, 0, 19));
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))),
                  ad_sum_rows(ad_add(ad_exp(ad_neg(stretch)), stretch)));
}

static enum ad_status by_sines(const void *params, uint64_t seed, double *q, double *v,
                               struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (size_t k = 0; k < 20; k++) {
        q[k] = 0;
        v[k] = sin((double)k + 1);
    }
    return AD_OK;
}

/* A9: many coordinates, several points. */
static void toda_meets_where_the_determinant_vanishes(void **state)
{
    struct phys_scene scene = scene_of("test", 20, toda, SLICES, 0.1, at_one);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    scene.start = by_sines;
    phys_system_make(&scene, &system, &error);
    struct phys_spectrum found = examine(&system, "gauss3", 0.02);
    assert_in_range(found.n_conjugate, 1, 9);
    assert_int_equal(found.n_conjugate, found.index);
    assert_signs_change(&system, &found);
    phys_spectrum_free(&found);
    phys_system_close(&system);
}

/* F3: where L_vv is negative definite the index is that of -S. */
static void negative_masses_make_a_maximum(void **state)
{
    struct phys_scene scene = scene_of("test", 1, falling, SLICES, 0.1, at_one);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    phys_system_make(&scene, &system, &error);
    struct phys_spectrum found = examine(&system, "left", 0.1);
    assert_int_equal(found.legendre, PHYS_NEGATIVE);
    assert_int_equal(found.index, 0);
    assert_int_equal(found.n_conjugate, 0);
    assert_true(found.smallest > 0);
    phys_spectrum_free(&found);
    phys_system_close(&system);
}

/* The spring from 1 to `end`: a family of paths or none where the time is k pi. */
static void conjugate_ends_have_no_index(void **state)
{
    static const struct {
        const char *rule;
        size_t slices;
        double time, end;
        bool undetermined, unknown;
        size_t index;
    } cases[] = {
        {"gauss2", 101, M_PI, -1, true, false, 0},    {"left", 101, M_PI, -1, true, false, 0},
        {"gauss3", 21, 2 * M_PI, 1, true, false, 0},  {"gauss3", 101, M_PI, -2, true, true, 0},
        {"left", 11, M_PI, -2, true, true, 0},        {"left", 101, M_PI, -2, true, true, 0},
        {"gauss2", 41, 3 * M_PI, 0.5, true, true, 0}, {"gauss2", 101, 3, -1, false, false, 0},
        {"left", 101, 3.3, -2, false, false, 1},      {"gauss3", 41, 6.2, 1, false, false, 1},
        {"gauss4", 401, 6.29, -1, false, false, 2},
    };
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find(cases[k].rule, &error),
                                              .slices = cases[k].slices,
                                              .steps = 100,
                                              .dt = cases[k].time / (double)(cases[k].slices - 1)};
        struct phys_path_found found;
        double *path = calloc(settings.rule->degree * cases[k].slices, sizeof *path);
        path[0] = 1;
        path[cases[k].slices - 1] = cases[k].end;
        phys_rule_interpolate(settings.rule, 1, cases[k].slices, path);
        phys_path_find(phys_solver_find("newton", &error), &spring, &settings, path, &found,
                       &error);
        assert_no_error(&error);
        if (found.spectrum.undetermined != cases[k].undetermined ||
            found.unknown != cases[k].unknown ||
            (!cases[k].undetermined && found.spectrum.index != cases[k].index))
            fail_msg("case %zu: undetermined %d, unknown %d, index %zu", k,
                     found.spectrum.undetermined, found.unknown, found.spectrum.index);
        phys_path_found_free(&found);
        free(path);
    }
    phys_system_close(&spring);
}

/* By one rule alone, as far as rounding says. */
static void an_eigenvalue_within_rounding_has_no_sign(void **state)
{
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    for (int conjugate = 0; conjugate < 2; conjugate++) {
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find("gauss4", &error),
                                              .slices = SLICES,
                                              .dt = (conjugate ? M_PI : 3) / (SLICES - 1)};
        struct phys_spectrum found;
        double path[4 * SLICES] = {0};
        phys_path_spectrum(&spring, &settings, path, &found, &error);
        assert_no_error(&error);
        assert_int_equal(found.undetermined, conjugate);
        phys_spectrum_free(&found);
    }
    phys_system_close(&spring);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(oscillator_meets_again_at_half_periods),
        cmocka_unit_test(foucault_meets_again_in_both_directions),
        cmocka_unit_test(known_times),
        cmocka_unit_test(geodesic_has_no_index),
        cmocka_unit_test(top_meets_twice_in_short_order),
        cmocka_unit_test(toda_meets_where_the_determinant_vanishes),
        cmocka_unit_test(conjugate_ends_have_no_index),
        cmocka_unit_test(an_eigenvalue_within_rounding_has_no_sign),
        cmocka_unit_test(negative_masses_make_a_maximum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
