/* Motions driven by forces of time: pulses thinner than any step and switches, each against its
   closed form. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/physics.h"

#include <math.h>

struct forced {
    struct phys_system system;
    struct phys_motion_solution motion;
    struct ad_error error;
};

/* A pulse exp(-((t - t0)/w)^2 / 2) / w in a force, or a rectangle of width w, beside a drive. */
static double width, centre;
static bool rectangle;

static ad_var pulsed(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var d = ad_mul(1 / width, ad_sub(t, centre));
    ad_var pulse = rectangle ? ad_sub(ad_step(d), ad_step(ad_sub(d, 1.0)))
                             : ad_exp(ad_mul(-0.5, ad_square(d)));
    ad_var force = ad_add(ad_mul(0.3, ad_cos(ad_mul(1.7, t))), ad_mul(1 / width, pulse));
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(q, force));
}

/* Much thinner than the time between two looks of the reference, and wherever they lie: the error
   is measured, or the run is refused. */
static void pulses_are_never_missed(void **state)
{
    (void)state;
    static const double widths[] = {0.05, 2e-3, 1e-3, 3e-4, 1e-4};
    for (size_t k = 0; k < 2 * LENGTH(widths); k++) {
        struct forced s = {0};
        const double q = 0, v = 0;
        const struct phys_motion_settings settings = {
            .size = sizeof settings, .time = 100, .q = &q, .v = &v, .error = 1e-6, .n_samples = 10};
        width = widths[k / 2];
        rectangle = k % 2 == 1;
        centre = 10 + 7.3856 * (double)k;
        if (rectangle && width < 1e-3)
            continue; /* without tails, it is thinner than the scan */
        phys_system_open("spring", &s.system, &s.error);
        struct phys_scene scene = *s.system.scene;
        scene.lagrangian = pulsed;
        scene.kinetic = scene.potential = NULL;
        s.system.scene = &scene;
        phys_motion_solve(&s.system, &settings, &s.motion, &s.error);
        if (s.error.status == AD_OK) {
            const double *end_of = s.motion.x + 2 * (s.motion.n - 1),
                         kick = rectangle ? 1 : sqrt(2 * M_PI);
            double middle = rectangle ? centre + width / 2 : centre;
            double x = 0.3 / 1.7 / 1.7 * (1 - cos(170)) + kick * (100 - middle);
            assert_true(s.motion.time_resolution > 0 && s.motion.time_resolution < 1e-3);
            /* the measured error is the true one, also where the pulse was stepped over */
            assert_close(s.motion.error_end, fabs(end_of[0] - x), 1e-6, 1e-9);
            phys_motion_met(&settings, &s.motion, &s.error);
            assert_int_equal(s.error.status == AD_OK, fabs(end_of[0] - x) < 1e-6);
        } else {
            assert_true(rectangle && s.error.status == AD_E_ACCURACY);
        }
        phys_motion_solution_free(&s.motion);
        phys_system_close(&s.system);
    }
}

/* A front that passes x with the speed 1000: the tails of its force, 1 - tanh^2, are rounding. */
static ad_var front(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var at = ad_sub(q, ad_mul(1000.0, ad_sub(t, 33.3)));
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(1000.0, ad_tanh(at)));
}

static void fronts_that_pass_are_followed(void **state)
{
    (void)state;
    struct forced s = {0};
    struct phys_reference r;
    const double q = 1, v = 0, times[] = {0, 100};
    phys_system_open("spring", &s.system, &s.error);
    struct phys_scene scene = *s.system.scene;
    scene.lagrangian = front;
    scene.kinetic = scene.potential = NULL;
    s.system.scene = &scene;
    assert_int_equal(phys_reference(&s.system, &q, &v, 2, times, 0.1, NULL, NULL, &r, &s.error),
                     AD_OK);
    assert_true(isinf(r.time_unresolved) && isinf(r.horizon));
    /* with w = v - 1000, w^2 / 2 - 1000 tanh is conserved, and tanh falls by 2 */
    assert_close(r.x[3] - 1000, -sqrt(1e6 - 4000), 1e-12, 0);
    phys_reference_free(&r);
    phys_system_close(&s.system);
}

static double steep;

/* Two fronts of width 1 / steep that travel with speed 1 from -5 and -7, and a slow body from 0. */
static ad_var two_fronts(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var at = ad_sub(q, t);
    ad_var fronts =
        ad_add(ad_tanh(ad_mul(steep, ad_add(at, 5.0))), ad_tanh(ad_mul(steep, ad_add(at, 7.0))));
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(0.1, fronts));
}

/* A14: forces that travel and meet the body in 1e-5 of the time, the second only after the first
   has turned it: w = v - 1 has w^2 / 2 + V conserved, and V falls by 0.2 in each. In 1e-7 of it no
   sample meets them, but L is another behind them. */
static void fronts_that_meet_the_body_are_seen(void **state)
{
    (void)state;
    const double q = 0, speed = 0.1, w1 = -sqrt(0.81 + 0.4), w2 = -sqrt(w1 * w1 + 0.4);
    const double t1 = 5 / 0.9, t2 = (7 + speed * t1 - (1 + w1) * t1) / -w1;
    const double end = speed * t1 + (1 + w1) * (t2 - t1) + (1 + w2) * (10 - t2);
    for (steep = 1e4; steep < 1e7; steep *= 100) {
        struct forced s = {0};
        struct phys_reference r;
        phys_system_open("spring", &s.system, &s.error);
        struct phys_scene scene = *s.system.scene;
        scene.lagrangian = two_fronts;
        scene.kinetic = scene.potential = NULL;
        s.system.scene = &scene;
        assert_int_equal(phys_reference(&s.system, &q, &speed, 2, (double[]){0, 10}, 0.1, NULL,
                                        NULL, &r, &s.error),
                         AD_OK);
        assert_close(r.x[2], end, 2e-4, 0);
        assert_close(r.x[3], 1 + w2, 1e-9, 0);
        phys_reference_free(&r);
        phys_system_close(&s.system);
    }
}

/* A force that changes its sign with sin t: L_t is 0 wherever it is defined, but the energy jumps.
   x'' = 1 up to pi, then -1. */
static ad_var switched(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var force = ad_sub(ad_mul(2.0, ad_step(ad_sin(t))), 1.0);
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(q, force));
}

static void switches_of_time_keep_no_energy(void **state)
{
    (void)state;
    struct forced s = {0};
    const double q = 0, v = 0;
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 6, .q = &q, .v = &v, .error = 1e-9};
    phys_system_open("spring", &s.system, &s.error);
    struct phys_scene scene = *s.system.scene;
    scene.lagrangian = switched;
    scene.kinetic = scene.potential = NULL;
    s.system.scene = &scene;
    phys_motion_solve(&s.system, &settings, &s.motion, &s.error);
    assert_int_equal(s.error.status, AD_OK);
    assert_false(phys_keeps_energy(&s.system, &s.error)); /* paths say the same */
    assert_true(!s.motion.keeps_energy && s.motion.error <= 1e-9);
    double T = 6 - M_PI, x = M_PI * M_PI / 2 + M_PI * T - T * T / 2;
    assert_close(s.motion.x[2 * (s.motion.n - 1)], x, 0, 1e-9);
    phys_motion_solution_free(&s.motion);
    phys_system_close(&s.system);
}

/* ---- flows that contract: their way back measures nothing ---- */

static ad_var unit_spring(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_square(v), ad_square(q)));
}

static double strength;

static ad_var friction(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(-2 * strength, v);
}

static ad_var van_der_pol(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(strength, ad_mul(ad_sub(1.0, ad_square(q)), v));
}

static void contract(struct forced *s, phys_lagrangian *forces, double time)
{
    const double q = 2, v = 0;
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = time, .q = &q, .v = &v, .error = 1e-9, .n_samples = 100};
    phys_system_open("spring", &s->system, &s->error);
    struct phys_scene scene = *s->system.scene;
    scene.lagrangian = unit_spring;
    scene.kinetic = scene.potential = NULL;
    scene.forces = forces;
    s->system.scene = &scene;
    phys_motion_solve(&s->system, &settings, &s->motion, &s->error);
    phys_motion_met(&settings, &s->motion, &s->error);
    assert_int_equal(s->error.status, AD_OK);
    assert_true(s->motion.reference_forward < 1e-11 && s->motion.reference_uncertainty < 1e-11);
    assert_true(s->motion.reference_uncertainty >= s->motion.reference_forward);
}

/* x'' = -2 c x' - x with c = 5: exact. */
static void strong_damping_is_measured(void **state)
{
    (void)state;
    struct forced s = {0};
    strength = 5;
    contract(&s, friction, 20);
    const double w = sqrt(strength * strength - 1);
    for (size_t i = 0; i < s.motion.n; i++) {
        double t = s.motion.t[i], slow = 1 / (strength + w), fast = strength + w;
        double x = (fast * exp(-slow * t) - slow * exp(-fast * t)) / w;
        assert_true(fabs(s.motion.x[2 * i] - x) <= s.motion.error + 1e-15);
    }
    phys_motion_solution_free(&s.motion);
    phys_system_close(&s.system);
}

/* Ends by Taylor series with 45 digits. */
static void limit_cycles_are_measured(void **state)
{
    (void)state;
    static const double mu[] = {3, 5, 10},
                        x20[] = {1.3727924154245721, -1.6012968795428539, 1.9393585327826517};
    for (size_t k = 0; k < LENGTH(mu); k++) {
        struct forced s = {0};
        strength = mu[k];
        contract(&s, van_der_pol, 20);
        const size_t end = s.motion.n - 1;
        assert_true(fabs(s.motion.x[2 * end] - x20[k]) <= s.motion.distance[end]);
        phys_motion_solution_free(&s.motion);
        phys_system_close(&s.system);
    }
}

/* Dry friction stops the motion at t = 3 pi: no adaptive step gets on from there. */
static ad_var dry(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(-0.3, ad_sign(v));
}

static void a_body_that_sticks_ends_the_run(void **state)
{
    (void)state;
    struct forced s = {0};
    const double q = 2, v = 0;
    struct phys_motion_settings settings = {.size = sizeof settings, .time = 1e3, .q = &q, .v = &v};
    phys_system_open("spring", &s.system, &s.error);
    struct phys_scene scene = *s.system.scene;
    scene.lagrangian = unit_spring;
    scene.kinetic = scene.potential = NULL;
    scene.forces = dry;
    s.system.scene = &scene;
    assert_int_equal(phys_motion_solve(&s.system, &settings, &s.motion, &s.error), AD_E_ACCURACY);
    assert_true(s.motion.info.steps < 100000);
    assert_close(s.motion.info.t, 3 * M_PI, 0, 0.1);
    assert_mentions(s.error.message, "jumps");
    phys_motion_solution_free(&s.motion);
    phys_system_close(&s.system);
}

/* x'' = -x - x' has another force on the first two ways forwards, and no way back. */
enum { LAST = 2 };
static const double errs = 1e-6;
static size_t arrivals;
static bool arrived;

static enum ad_status erring_field(void *context, double t, const double *y, double *rate,
                                   struct ad_error *error)
{
    (void)context;
    arrivals += t >= LAST && !arrived;
    arrived = t >= LAST || (arrived && t > 0.5 * LAST);
    rate[0] = y[1];
    rate[1] = -y[0] - y[1] + (arrivals < 2 ? errs : 0);
    if (arrivals == 2 && arrived && t < 0.9 * LAST)
        return ad_fail(error, AD_E_NONFINITE, "no way back");
    return AD_OK;
}

static enum ad_status erring_ode(const struct phys_system *system, struct phys_ode *ode,
                                 struct ad_error *error)
{
    (void)error;
    *ode = (struct phys_ode){.n = 2, .field = erring_field, .system = system, .friction = 1};
    return AD_OK;
}

static void an_error_that_both_runs_share_is_seen_by_another_method(void **state)
{
    (void)state;
    struct forced s = {0};
    struct phys_reference reference;
    const double q = 1, v = 0, times[] = {0, 0.5, 1, 1.5, LAST};
    phys_system_open("spring", &s.system, &s.error);
    struct phys_scene scene = *s.system.scene;
    scene.ode = erring_ode;
    s.system.scene = &scene;
    assert_int_equal(phys_reference(&s.system, &q, &v, LENGTH(times), times, 0.1, NULL, NULL,
                                    &reference, &s.error),
                     AD_OK);
    assert_true(isnan(reference.reversal) && isinf(reference.horizon));
    assert_true(reference.forward > 0.5 * errs && reference.forward < 2 * errs);
    assert_true(reference.uncertainty[4] > 0.5 * errs);
    phys_reference_free(&reference);
    phys_system_close(&s.system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(switches_of_time_keep_no_energy),
        cmocka_unit_test(pulses_are_never_missed),
        cmocka_unit_test(fronts_that_pass_are_followed),
        cmocka_unit_test(fronts_that_meet_the_body_are_seen),
        cmocka_unit_test(strong_damping_is_measured),
        cmocka_unit_test(limit_cycles_are_measured),
        cmocka_unit_test(a_body_that_sticks_ends_the_run),
        cmocka_unit_test(an_error_that_both_runs_share_is_seen_by_another_method),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
