/* Periodic motions and their multipliers against closed forms and published numbers. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <string.h>

static struct phys_periodic found_of(const struct phys_system *system,
                                     struct phys_periodic_settings how, enum ad_status status)
{
    struct phys_periodic found;
    struct ad_error error = {0};
    how.size = sizeof how;
    assert_int_equal(phys_periodic_find(system, &how, &found, &error), status);
    if (status == AD_OK)
        assert_string_equal(error.message, "");
    else
        assert_true(error.message[0] != 0);
    return found;
}

/* Simo, Contemporary Mathematics 292 (2002): the figure eight is stable, its frequencies beside
   those of its integrals are 0.00842272 and 0.29809253 of its own. */
static void the_figure_eight_from_two_digits(void **state)
{
    const double x[] = {0.97, -0.24, -0.97, 0.24, 0, 0, 0.47, 0.43, 0.47, 0.43, -0.93, -0.86};
    size_t slow = 0, fast = 0, trivial = 0;
    (void)state;
    struct phys_system system = system_opened("figure8");
    struct phys_periodic f =
        found_of(&system, (struct phys_periodic_settings){.x = x, .period = 6.3}, AD_OK);
    assert_true(f.closure < 1e-11 && f.uncertainty < 1e-10 && f.turns == 1);
    for (size_t k = 0; k < f.n; k++) {
        const struct phys_multiplier *m = &f.multiplier[k];
        const double turns = fabs(atan2(m->im, m->re)) / (2 * M_PI);
        assert_close(hypot(m->re, m->im), 1, 0, 4 * m->uncertainty);
        slow += fabs(turns - 0.00842272) < 6e-9;
        fast += fabs(turns - 0.29809253) < 6e-9;
        trivial += hypot(m->re - 1, m->im) < 4 * m->uncertainty;
    }
    assert_int_equal(slow, 2);
    assert_int_equal(fast, 2);
    assert_int_equal(trivial,
                     8); /* energy, centre of mass, angular momentum, and their conjugates */
    assert_int_equal(f.kind, PHYS_PERIODIC_NEUTRAL);
    phys_periodic_free(&f);
    phys_system_close(&system);
}

/* From a curve of Lissajous, on which all three follow each other: too rough for the motion alone
   to close. After a third of the period, by another method, each is where another was. */
static void the_figure_eight_as_a_choreography(void **state)
{
    double x[12], y[12], pythagoras[12];
    size_t slow = 0, fast = 0;
    (void)state;
    for (size_t b = 0; b < 3; b++) {
        const double at = 2 * M_PI * (double)b / 3 + 0.3;
        x[2 * b] = sin(at);
        x[2 * b + 1] = 0.4 * sin(2 * at);
        x[6 + 2 * b] = cos(at);
        x[7 + 2 * b] = 0.8 * cos(2 * at);
    }
    struct phys_system system = system_opened("figure8"), unlike = system_opened("pythagorean"),
                       alone = system_opened("spring");
    struct phys_periodic_settings how = {.x = x, .period = 6.3};
    struct phys_periodic f = found_of(&system, how, AD_E_ACCURACY);
    phys_periodic_free(&f);
    how.choreography = true;
    f = found_of(&system, how, AD_OK);
    assert_true(f.closure < 1e-11 && f.turns == 1);
    for (size_t k = 0; k < f.n; k++) {
        const struct phys_multiplier *m = &f.multiplier[k];
        const double turns = fabs(atan2(m->im, m->re)) / (2 * M_PI);
        slow += fabs(turns - 0.00842272) < 6e-9;
        fast += fabs(turns - 0.29809253) < 6e-9;
    }
    assert_true(slow == 2 && fast == 2);
    struct phys_ode ode;
    struct phys_simulation_info info;
    struct ad_error error = {0};
    const struct phys_simulation third =
        phys_simulation_of(phys_integrator_find("dop853", &error), 1e-13, f.period / 3);
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
    memcpy(y, f.x, sizeof y);
    assert_int_equal(phys_simulate(&third, &ode, y, &info, &error), AD_OK);
    const size_t turn = fabs(y[0] - f.x[2]) < 1e-6 ? 2 : 4;
    for (size_t k = 0; k < 12; k++)
        assert_close(y[k], f.x[k / 6 * 6 + (k % 6 + turn) % 6], 0, 1e-10);
    phys_ode_free(&ode);
    phys_periodic_free(&f);

    system_start(&unlike, 0, pythagoras, pythagoras + 6);
    how.x = pythagoras;
    how.period = 0.5;
    f = found_of(&unlike, how, AD_E_ARGUMENT);
    phys_periodic_free(&f);
    how.x = (const double[]){1, 0};
    f = found_of(&alone, how, AD_E_ARGUMENT);
    phys_periodic_free(&f);
    phys_system_close(&system);
    phys_system_close(&unlike);
    phys_system_close(&alone);
}

/* T = 2 pi / agm(1, cos(theta / 2)) sqrt(l/g); with the energy held the amplitude stays. */
static void the_pendulum_has_its_elliptic_period(void **state)
{
    const double x[] = {1, 0};
    double a = 1, b = cos(0.5);
    (void)state;
    for (int k = 0; k < 6; k++) {
        const double mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
    }
    struct phys_system system = system_opened("pendulum");
    system_set(&system, "l", 1);
    struct phys_periodic f = found_of(
        &system, (struct phys_periodic_settings){.x = x, .period = 6.5, .hold_energy = true},
        AD_OK);
    assert_close(f.period, 2 * M_PI / a, 1e-12, 0);
    assert_true(fabs(f.period - 2 * M_PI / a) <= 4 * f.uncertainty);
    assert_close(0.5 * f.x[1] * f.x[1] - cos(f.x[0]), -cos(1), 1e-13, 0);
    phys_periodic_free(&f);
    f = found_of(&system,
                 (struct phys_periodic_settings){.x = x, .period = 13.3, .hold_energy = true},
                 AD_OK);
    assert_int_equal(f.turns, 2);
    phys_periodic_free(&f);
    phys_system_close(&system);
}

/* Broucke's orbit: one multiplier far outside. */
static void the_orbit_of_arenstorf_is_unstable(void **state)
{
    double x[4];
    (void)state;
    struct phys_system system = system_opened("arenstorf");
    system_start(&system, 0, x, x + 2);
    struct phys_periodic f = found_of(
        &system, (struct phys_periodic_settings){.x = x, .period = 17.0652, .hold_energy = true},
        AD_OK);
    assert_close(f.period, 17.0652165601579625588917206249, 0, 1e-9);
    assert_int_equal(f.kind, PHYS_PERIODIC_UNSTABLE);
    assert_close(f.multiplier[0].re * f.multiplier[3].re, 1, 0,
                 8 * f.multiplier[0].re * f.multiplier[3].uncertainty);
    phys_periodic_free(&f);
    phys_system_close(&system);
}

/* ---- forces ---- */

static ad_var spring(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_square(v), ad_square(q)));
}

static ad_var van_der_pol(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(ad_sub(1.0, ad_square(q)), v);
}

static ad_var friction(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(0.15, ad_square(v));
}

static ad_var drive(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)v, (void)params;
    return ad_mul(0.5, ad_cos(ad_mul(1.5, t)));
}

static enum ad_status at_two(const void *params, uint64_t seed, double *q, double *v,
                             struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 2;
    v[0] = 0.1;
    return AD_OK;
}

static void a_limit_cycle_attracts(void **state)
{
    const double x[] = {2, 0.1};
    (void)state;
    struct phys_scene scene = scene_of("cycle", 1, spring, 100, 0.1, at_two);
    struct phys_system system;
    struct ad_error error = {0};
    scene.forces = van_der_pol;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    struct phys_periodic f =
        found_of(&system, (struct phys_periodic_settings){.x = x, .period = 6.5}, AD_OK);
    assert_close(f.period, 6.66328685932313, 1e-12, 0);
    assert_int_equal(f.kind, PHYS_PERIODIC_ATTRACTING);
    assert_close(f.multiplier[0].re, 1, 1e-10, 0);
    phys_periodic_free(&f);
    phys_system_close(&system);
}

static ad_var dry(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(-0.3, ad_sign(v));
}

/* No other method has variations: none is to be tried. */
static void kinks_are_refused_without_another_method(void **state)
{
    const double x[] = {2, 0.1};
    (void)state;
    struct phys_scene scene = scene_of("dry", 1, spring, 100, 0.1, at_two);
    struct phys_system system;
    struct phys_periodic f;
    struct ad_error error = {0};
    scene.forces = dry;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    const struct phys_periodic_settings how = {.size = sizeof how, .x = x, .period = 6.5};
    assert_int_equal(phys_periodic_find(&system, &how, &f, &error), AD_E_ARGUMENT);
    assert_non_null(strstr(error.message, "kinks"));
    assert_null(strstr(error.message, "dop853"));
    phys_periodic_free(&f);
    phys_system_close(&system);
}

/* x'' + .3 x' + x = .5 cos 1.5 t. */
static void a_driven_motion_has_the_period_of_its_drive(void **state)
{
    const double x[] = {2, 0.1}, T = 2 * M_PI / 1.5, d = 1.25 * 1.25 + 0.45 * 0.45;
    (void)state;
    struct phys_scene scene = scene_of("driven", 1, spring, 100, 0.1, at_two);
    struct phys_system system;
    struct ad_error error = {0};
    scene.forces = drive;
    scene.dissipation = friction;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    struct phys_periodic_settings how = {.x = x, .period = T, .hold_period = true};
    struct phys_periodic f = found_of(&system, how, AD_OK);
    assert_close(f.x[0], -0.5 * 1.25 / d, 1e-12, 0);
    assert_close(f.x[1], 0.5 * 0.45 * 1.5 / d, 1e-12, 0);
    for (size_t k = 0; k < 2; k++)
        assert_close(hypot(f.multiplier[k].re, f.multiplier[k].im), exp(-0.15 * T), 1e-12, 0);
    assert_int_equal(f.kind, PHYS_PERIODIC_ATTRACTING);
    phys_periodic_free(&f);
    how.period = 4.1; /* closes once, and never again */
    f = found_of(&system, how, AD_E_ACCURACY);
    phys_periodic_free(&f);
    how.hold_period = false;
    f = found_of(&system, how, AD_E_ARGUMENT);
    phys_periodic_free(&f);
    phys_system_close(&system);
}

/* ---- refused ---- */

static void what_does_not_close_is_said(void **state)
{
    const double x[] = {1, 0}, rest[] = {0, 0};
    (void)state;
    struct phys_system system = system_opened("spring");
    system_set(&system, "k", 1);
    system_set(&system, "m", 1);
    /* the spring knows one period, and its rest any */
    struct phys_periodic f =
        found_of(&system, (struct phys_periodic_settings){.x = x, .period = 5, .hold_period = true},
                 AD_E_ACCURACY);
    phys_periodic_free(&f);
    f = found_of(&system, (struct phys_periodic_settings){.x = rest, .period = 5}, AD_E_ACCURACY);
    phys_periodic_free(&f);
    f = found_of(&system, (struct phys_periodic_settings){.x = x, .period = -1}, AD_E_ARGUMENT);
    phys_periodic_free(&f);
    f = found_of(&system, (struct phys_periodic_settings){.period = 1}, AD_E_ARGUMENT);
    phys_periodic_free(&f);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_figure_eight_from_two_digits),
        cmocka_unit_test(the_figure_eight_as_a_choreography),
        cmocka_unit_test(the_pendulum_has_its_elliptic_period),
        cmocka_unit_test(the_orbit_of_arenstorf_is_unstable),
        cmocka_unit_test(a_limit_cycle_attracts),
        cmocka_unit_test(kinks_are_refused_without_another_method),
        cmocka_unit_test(a_driven_motion_has_the_period_of_its_drive),
        cmocka_unit_test(what_does_not_close_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
