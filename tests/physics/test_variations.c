/* Variations of motions: against differences of motions, the symplectic form, and exponents that
   are known. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "physics/physics.h"

#include <math.h>
#include <string.h>

enum { MOST = 8 };

static const char *const taylor = "taylor";

/* The motion and state-transition matrix [2 dof][2 dof], column after column, at t. */
static void transition(const struct phys_system *system, const double *x, double t, double *end,
                       double *matrix)
{
    const size_t d = 2 * system->dof;
    double y[MOST * (MOST + 1)] = {0}, scale[MOST * (MOST + 1)];
    struct ad_error error = {0};
    struct phys_ode ode;
    struct phys_simulation_info info;
    assert_true(d <= MOST);
    assert_int_equal(phys_ode_variations(system, d, &ode, &error), AD_OK);
    memcpy(y, x, d * sizeof *x);
    for (size_t k = 0; k < d; k++)
        y[d + k * d + k] = 1;
    for (size_t k = 0; k < d * (d + 1); k++)
        scale[k] = 1;
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_integrator_find(taylor, &error),
                                        .t1 = t,
                                        .rtol = 1e-14,
                                        .atol = 1e-14,
                                        .scale = scale};
    assert_int_equal(phys_simulate(&how, &ode, y, &info, &error), AD_OK);
    memcpy(end, y, d * sizeof *y);
    memcpy(matrix, y + d, d * d * sizeof *y);
    phys_ode_free(&ode);
}

static void follow(const struct phys_system *system, const double *x, double t, double *end)
{
    struct ad_error error = {0};
    struct phys_ode ode;
    const struct phys_simulation how = {.size = sizeof how,
                                        .integrator = phys_integrator_find("dop853", &error),
                                        .t1 = t,
                                        .rtol = 1e-14};
    assert_int_equal(phys_ode_lagrangian(system, &ode, &error), AD_OK);
    memcpy(end, x, ode.n * sizeof *x);
    assert_int_equal(phys_simulate(&how, &ode, end, NULL, &error), AD_OK);
    phys_ode_free(&ode);
}

static void begin(struct phys_system *system, double *x)
{
    struct ad_error error = {0};
    assert_int_equal(system->scene->start(system->params, 1, x, x + system->dof, &error), AD_OK);
}

static void open_system(struct phys_system *system, const char *name, double *x)
{
    struct ad_error error = {0};
    assert_int_equal(phys_system_open(name, system, &error), AD_OK);
    begin(system, x);
}

/* The library's own, with its uncertainty: of the spring and of a free body, which are known; and
   of a chaotic motion, where it is lost. */
static void test_transition(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    double x[MOST], matrix[MOST * MOST], u[MOST * MOST];
    struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 2};
    open_system(&system, "spring", x);
    assert_int_equal(phys_system_set(&system, "m", 1, &error), AD_OK);
    assert_int_equal(phys_system_set(&system, "k", 9, &error), AD_OK);
    assert_int_equal(phys_transition(&system, x, &how, matrix, u, &error), AD_OK);
    const double exact[] = {cos(6), sin(6) / 3, -3 * sin(6), cos(6)};
    for (size_t k = 0; k < 4; k++) {
        assert_close(matrix[k], exact[k], 1e-14, 1e-14);
        assert_true(u[k] > 0 && u[k] < 1e-11);
    }
    phys_system_close(&system);
    open_system(&system, "freebody", x);
    how.t1 = -3; /* backwards */
    assert_int_equal(phys_transition(&system, x, &how, matrix, u, &error), AD_OK);
    const double free_body[] = {1, -3, 0, 1};
    for (size_t k = 0; k < 4; k++)
        assert_close(matrix[k], free_body[k], 1e-15, 1e-15);
    phys_system_close(&system);
    open_system(&system, "dblpend", x);
    how.t1 = 120;
    assert_int_equal(phys_transition(&system, x, &how, matrix, u, &error), AD_E_ACCURACY);
    phys_system_close(&system);
}

/* The stiffness of an oscillator drops for 1e-4 s: a kick dv = 0.0709 q at t = 5. */
static ad_var pulsed(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var pulse = ad_exp(ad_mul(-1e8, ad_square(ad_sub(t, 5.0))));
    ad_var stiffness = ad_sub(0.5, ad_mul(200.0, pulse));
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(stiffness, ad_square(q)));
}

/* Steps of either run are much longer: it is seen in both directions of time. */
static void test_transition_through_a_pulse(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    double x[MOST], matrix[4], u[4];
    open_system(&system, "spring", x);
    struct phys_scene scene = *system.scene;
    scene.lagrangian = pulsed;
    scene.kinetic = scene.potential = NULL;
    system.scene = &scene;
    for (int back = 0; back < 2; back++) {
        const struct phys_lyapunov_settings how = {
            .size = sizeof how, .t0 = back ? 8 : 0, .t1 = back ? 0 : 8};
        const double a = back ? -3 : 5, b = back ? -5 : 3,
                     kick = (back ? -400 : 400) * sqrt(M_PI / 1e8);
        const double exact[] = {
            cos(a + b) + kick * sin(b) * cos(a), sin(a + b) + kick * sin(b) * sin(a),
            -sin(a + b) + kick * cos(b) * cos(a), cos(a + b) + kick * cos(b) * sin(a)};
        assert_int_equal(phys_transition(&system, x, &how, matrix, u, &error), AD_OK);
        for (size_t k = 0; k < 4; k++)
            assert_close(matrix[k], exact[k], 0, 1e-5);
    }
    phys_system_close(&system);
}

/* Against central differences of dop853's motions: constant masses, and masses that vary. */
static void test_against_differences(void **state)
{
    (void)state;
    const char *const scenes[] = {"kepler", "dblpend"};
    for (size_t i = 0; i < LENGTH(scenes); i++) {
        struct phys_system system;
        double x[MOST], end[MOST], matrix[MOST * MOST], ahead[MOST], behind[MOST], h = 1e-4;
        open_system(&system, scenes[i], x);
        const size_t d = 2 * system.dof;
        transition(&system, x, 2, end, matrix);
        follow(&system, x, 2, ahead);
        for (size_t k = 0; k < d; k++)
            assert_close(end[k], ahead[k], 1e-11, 1e-11);
        for (size_t c = 0; c < d; c++) {
            double beside[MOST];
            memcpy(beside, x, sizeof beside);
            beside[c] = x[c] + h;
            follow(&system, beside, 2, ahead);
            beside[c] = x[c] - h;
            follow(&system, beside, 2, behind);
            for (size_t k = 0; k < d; k++)
                assert_close(matrix[c * d + k], (ahead[k] - behind[k]) / (2 * h), 1e-5, 1e-5);
        }
        phys_system_close(&system);
    }
}

/* With unit masses v is the momentum: M^T J M = J. */
static void test_symplectic(void **state)
{
    (void)state;
    struct phys_system system;
    double x[4], end[4], m[16];
    open_system(&system, "kepler", x);
    transition(&system, x, 4, end, m);
    double size = 0;
    for (size_t k = 0; k < 16; k++)
        size = fmax(size, fabs(m[k]));
    for (size_t a = 0; a < 4; a++)
        for (size_t b = 0; b < 4; b++) {
            double form = 0;
            for (size_t k = 0; k < 2; k++)
                form += m[4 * a + k] * m[4 * b + 2 + k] - m[4 * a + 2 + k] * m[4 * b + k];
            assert_close(form, b == a + 2 ? 1 : a == b + 2 ? -1 : 0, 0, 1e-13 * size * size);
        }
    phys_system_close(&system);
}

static ad_var saddle(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    ad_var x = ad_slice_rows(q, 0, 1), y = ad_slice_rows(q, 1, 1);
    return ad_mul(
        0.5, ad_add(ad_sum_rows(ad_square(v)), ad_sub(ad_mul(2.25, ad_square(x)), ad_square(y))));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = q[1] = 1e-3;
    v[0] = v[1] = 0;
    return AD_OK;
}

static void spectrum_of(const struct phys_system *system, const double *x, double t, size_t k,
                        double *exponents, double *spread, enum ad_status status)
{
    struct ad_error error = {0};
    const double ones[MOST] = {1, 1, 1, 1, 1, 1, 1, 1};
    const struct phys_lyapunov_settings settings = {
        .size = sizeof settings, .t1 = t, .tolerance = 1e-12, .scale = ones};
    assert_int_equal(phys_lyapunov_spectrum(system, x, &settings, k, exponents, spread, &error),
                     status);
}

/* x'' = 2.25 x, y'' = -y: 1.5, 0, 0, -1.5. What is left of the start falls like 1 / t; volumes are
   kept at all times. */
static void test_linear_saddle(void **state)
{
    (void)state;
    const struct phys_scene scene = scene_of("saddle", 2, saddle, 11, 0.1, start);
    struct phys_system system;
    double x[4], exponents[4], spread[4];
    const double exact[] = {1.5, 0, 0, -1.5};
    struct ad_error error = {0};
    if (phys_system_make(&scene, &system, &error) != AD_OK)
        fail_msg("%s", error.message);
    begin(&system, x);
    spectrum_of(&system, x, 80, 4, exponents, spread, AD_OK);
    for (size_t k = 0; k < 4; k++)
        assert_close(exponents[k], exact[k], 0, 0.05);
    assert_close(exponents[0] + exponents[1] + exponents[2] + exponents[3], 0, 0, 1e-9);
    double later[4];
    const double ones[] = {1, 1, 1, 1};
    const struct phys_lyapunov_settings from_7 = {
        .size = sizeof from_7, .t0 = 7, .t1 = 11, .tolerance = 1e-12, .scale = ones};
    spectrum_of(&system, x, 4, 4, exponents, spread, AD_OK);
    assert_int_equal(phys_lyapunov_spectrum(&system, x, &from_7, 4, later, spread, &error), AD_OK);
    for (size_t k = 0; k < 4; k++) /* whatever the clock says */
        assert_close(later[k], exponents[k], 0, 1e-9);
    spectrum_of(&system, x, 20, 5, exponents, spread, AD_E_ARGUMENT);
    spectrum_of(&system, x, 20, 0, exponents, spread, AD_E_ARGUMENT);
    spectrum_of(&system, x, 0, 1, exponents, spread, AD_E_ARGUMENT);
    phys_system_close(&system);
}

/* The sum is 0, as volumes are kept; the largest is that of differences of the field. */
static void test_double_pendulum(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_system system;
    struct phys_ode ode;
    struct phys_lyapunov other;
    double x[4], exponents[4], spread[4], sum = 0;
    const double ones[4] = {1, 1, 1, 1};
    const struct phys_lyapunov_settings settings = {
        .size = sizeof settings, .t1 = 30, .scale = ones, .known = 1e-12, .lost = 0.1};
    open_system(&system, "dblpend", x);
    spectrum_of(&system, x, 1, 4, exponents, spread, AD_OK);
    for (size_t k = 1; k < 4; k++) /* before they have settled */
        assert_true(exponents[k] <= exponents[k - 1]);
    spectrum_of(&system, x, 30, 4, exponents, spread, AD_OK);
    for (size_t k = 0; k < 4; k++)
        sum += exponents[k];
    print_message("%g %g %g %g\n", exponents[0], exponents[1], exponents[2], exponents[3]);
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
    assert_int_equal(phys_lyapunov(&ode, x, &settings, &other, &error), AD_OK);
    print_message("%g to %g\n", other.least, other.most);
    assert_close(exponents[0], other.exponent, 0.1, 0);
    assert_close(sum, 0, 0, 0.1);
    phys_ode_free(&ode);
    phys_system_close(&system);
}

static bool never(void *context) { return context != NULL; }

/* What was not computed is no number. */
static void test_interrupted(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    const double x[2] = {1, 0};
    double exponents[2] = {1, 1}, change[2] = {1, 1};
    assert_int_equal(phys_system_open("pendulum", &system, &error), AD_OK);
    assert_int_equal(
        phys_lyapunov_spectrum(
            &system, x,
            &(struct phys_lyapunov_settings){
                .size = sizeof(struct phys_lyapunov_settings), .t1 = 10, .proceed = never},
            2, exponents, change, &error),
        AD_E_ACCURACY);
    for (size_t k = 0; k < 2; k++)
        assert_true(isnan(exponents[k]) && isnan(change[k]));
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_transition),
        cmocka_unit_test(test_transition_through_a_pulse),
        cmocka_unit_test(test_against_differences),
        cmocka_unit_test(test_symplectic),
        cmocka_unit_test(test_linear_saddle),
        cmocka_unit_test(test_double_pendulum),
        cmocka_unit_test(test_interrupted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
