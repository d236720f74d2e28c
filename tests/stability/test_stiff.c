/* Stiff motions are told, with a method that costs less; others are not. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/physics/published.h"
#include "physics/stability/diagnostics.h"
#include "physics/stability/stability.h"

#include <stdlib.h>
#include <string.h>

static double strong = 1e4;
static const double asked = 1e-6;

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(strong, ad_sub(ad_mul(0.5, ad_square(q)), q)));
}

static ad_var dissipation(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)q, (void)t;
    return ad_mul(0.5 * strong, ad_square(v));
}

/* On the slow one of its two motions, 1 - exp(s t) / 2. */
static double slow(void) { return -2 * strong / (strong + sqrt(strong * strong - 4 * strong)); }

static enum ad_status begin(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.5;
    v[0] = -0.5 * slow();
    return AD_OK;
}

static void solve(const struct phys_system *system, const struct phys_motion_settings *settings,
                  struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    struct ad_error error = {0};
    phys_motion_solve(system, settings, m, &error);
    phys_motion_diagnose(settings, m, 0, d, &error);
    assert_int_equal(error.status, AD_OK);
}

/* The method named is as good, and takes as many evaluations as were told. */
static void strong_friction_is_told(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("strong", 1, lagrangian, 11, 0.1, begin);
    struct phys_motion_settings settings = {.size = sizeof settings, .time = 1, .error = asked};
    struct phys_system system;
    struct phys_motion_solution m, better;
    struct phys_diagnosis d, after;
    struct ad_error error = {0};
    scene.dissipation = dissipation;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    solve(&system, &settings, &m, &d);
    assert_int_equal(d.n_warnings, 1);
    assert_non_null(strstr(d.warning[0], "gauss3"));
    assert_close(d.stiff.rate, strong, 1e-3, 0);
    assert_true(3 * d.stiff.evaluations <= m.info.evaluations);
    settings.integrator = phys_integrator_find("gauss3", &error);
    settings.dt = d.stiff.dt;
    solve(&system, &settings, &better, &after);
    assert_int_equal(better.info.evaluations, d.stiff.evaluations);
    for (size_t i = 0; i < better.n; i++)
        assert_close(better.x[2 * i], 1 - 0.5 * exp(slow() * better.t[i]), 0, asked);
    phys_motion_solution_free(&m);
    phys_motion_solution_free(&better);
    phys_system_close(&system);
}

/* Where no explicit method gets through; the steps that are named are as good. */
static void too_strong_friction_is_told(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("strong", 1, lagrangian, 11, 0.1, begin);
    struct phys_motion_settings settings = {.size = sizeof settings, .time = 1, .error = asked};
    struct phys_system system;
    struct phys_motion_solution m, better;
    struct ad_error error = {0};
    strong = 1e10;
    scene.dissipation = dissipation;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    phys_motion_solve(&system, &settings, &m, &error);
    assert_int_equal(error.status, AD_E_ACCURACY);
    const char *named = strstr(error.message, "--integrator gauss3 --dt ");
    assert_non_null(named);
    settings.dt = strtod(strstr(named, "dt ") + 3, NULL);
    settings.error = 0;
    settings.no_reference = true;
    error.status = AD_OK;
    settings.integrator = phys_integrator_find("gauss3", &error);
    phys_motion_solve(&system, &settings, &better, &error);
    assert_no_error(&error);
    for (size_t i = 0; i < better.n; i++)
        assert_close(better.x[2 * i], 1 - 0.5 * exp(slow() * better.t[i]), 0, asked);
    phys_motion_solution_free(&m);
    phys_motion_solution_free(&better);
    phys_system_close(&system);
    strong = 1e4;
}

/* A fall onto the centre is none of that: implicit steps pass over it, each somewhere else. */
static void collisions_are_not(void **state)
{
    (void)state;
    struct phys_system system;
    struct phys_motion_solution m;
    struct ad_error error = {0};
    const struct phys_motion_settings settings = {.size = sizeof settings,
                                                  .time = 3,
                                                  .error = asked,
                                                  .q = (const double[]){1, 0},
                                                  .v = (const double[]){0, 0}};
    assert_int_equal(phys_system_open("kepler", &system, &error), AD_OK);
    phys_motion_solve(&system, &settings, &m, &error);
    assert_int_not_equal(error.status, AD_OK);
    assert_null(strstr(error.message, "stiff"));
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* Where friction is, no resonance: it damps what that would let grow. */
static void resonance_is_not_told_with_friction(void **state)
{
    (void)state;
    struct ad_error error = {0};
    const struct phys_integrator *midpoint = phys_integrator_find("implicit-midpoint", &error);
    for (int damped = 0; damped < 2; damped++) {
        struct phys_scene scene = scene_of("strong", 1, lagrangian, 11, 0.1, begin);
        struct phys_system system;
        struct phys_step_advice advice;
        const double x[2] = {0.5, 0.5}, t = 0;
        scene.dissipation = damped ? dissipation : NULL;
        assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
        phys_step_advise(midpoint, &system, 1, x, &t, 0.1, &advice, &error);
        assert_no_error(&error);
        assert_int_equal(advice.verdict, damped ? PHYS_STEP_GOOD : PHYS_STEP_RESONANT);
        phys_system_close(&system);
    }
}

static void others_are_not(void **state)
{
    (void)state;
    static const struct {
        const char *scene, *name;
        double value, time;
    } runs[] = {{"pendulum", "l", 1, 200}, {"kepler", "e", 0.6, 13},  {"kepler", "e", 0.99, 13},
                {"dblpend", "g", 9.8, 5},  {"spring", "k", 1e6, 0.2}, {"figure8", NULL, 0, 6}};
    for (size_t k = 0; k < LENGTH(runs); k++) {
        struct ad_error error = {0};
        const struct phys_motion_settings settings = {.size = sizeof settings,
                                                      .time = runs[k].time,
                                                      .error = asked,
                                                      .integrator =
                                                          phys_integrator_find("dop853", &error)};
        struct phys_system system;
        struct phys_motion_solution m;
        struct phys_diagnosis d;
        assert_int_equal(phys_system_open(runs[k].scene, &system, &error), AD_OK);
        if (runs[k].name)
            assert_int_equal(phys_system_set(&system, runs[k].name, runs[k].value, &error), AD_OK);
        solve(&system, &settings, &m, &d);
        assert_true(d.stiff.rate == 0);
        phys_motion_solution_free(&m);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(strong_friction_is_told),
        cmocka_unit_test(too_strong_friction_is_told),
        cmocka_unit_test(collisions_are_not),
        cmocka_unit_test(resonance_is_not_told_with_friction),
        cmocka_unit_test(others_are_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
