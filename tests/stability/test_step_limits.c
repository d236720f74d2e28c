/* Steps too long for an oscillation: it grows beyond the stability limit of each method. */
#include "follow.h"
#include "tests/close.h"
#include "tests/mentions.h"

static const double none = INFINITY;

/* Limits of w dt, of stability and of the third-order resonance. Those of verlet, rk4 and the
   implicit midpoint rule follow from their matrices: traces 2 - x^2, |R(ix)|^2 = 1 - x^6/72 +
   x^8/576, and tan(angle/2) = x/2. Those of yoshida4 are where the trace of the product of three
   matrices of verlet first passes 2; it never reaches -1 before. */
static void the_limits_of_methods_are_found(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        double stability, resonance;
    } expected[] = {
        {"euler", 0, none},
        {"semi-implicit", 2, 1.7320508075688772},
        {"verlet", 2, 1.7320508075688772},
        {"rk4", 2.8284271247461903, none},
        {"yoshida4", 1.573401947, none},
        {"implicit-midpoint", none, 3.4641016151377544},
    };
    for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
        struct ad_error error = {0};
        struct phys_step_limits limits;
        phys_step_limits(phys_integrator_find(expected[k].integrator, &error), &limits, &error);
        assert_int_equal(error.status, AD_OK);
        assert_close(limits.stability, expected[k].stability, 1e-9, 0);
        assert_close(limits.resonance, expected[k].resonance, 1e-9, 0);
    }
}

static void methods_that_choose_their_steps_have_none(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_step_limits limits;
    phys_step_limits(phys_integrator_find("dop853", &error), &limits, &error);
    assert_told(&error, AD_E_ARGUMENT, "dop853");
}

/* Every method of the table with fixed steps: a unit oscillator is held just under its limit and
   lost just beyond. (Far beyond, yoshida6 holds it again for a while.) */
static void limits_hold_for_every_method(void **state)
{
    (void)state;
    for (const struct phys_integrator *const *i = phys_integrators; *i; i++) {
        struct ad_error error = {0};
        struct phys_step_limits limits;
        if ((*i)->adaptive || (*i)->lagrangian || (*i)->dominated)
            continue;
        phys_step_limits(*i, &limits, &error);
        assert_int_equal(error.status, AD_OK);
        struct motion m;
        follow_open(&m, "spring", NULL, 0);
        if (limits.stability > 0) {
            assert_true(follow_steps(&m, (*i)->name, 0.999 * fmin(limits.stability, 20), 10000));
            assert_true(hypot(m.y[0], m.y[1]) < 100);
        }
        m.y[0] = 1;
        m.y[1] = 0;
        if (isfinite(limits.stability)) {
            follow_steps(&m, (*i)->name, 1.001 * fmax(limits.stability, 1), 10000);
            assert_true(!(fabs(m.y[0]) < 1e6));
        }
        motion_close(&m);
    }
}

/* The largest energy in 10000 steps, in units of the start's. */
static double largest_energy(const char *integrator, double dt)
{
    struct motion m;
    follow_open(&m, "spring", NULL, 0);
    assert_true(follow_steps(&m, integrator, dt, 10000));
    motion_close(&m);
    return 1 + m.info.energy_drift;
}

/* What drift, kick, drift preserves is q^2 + p^2 (1 - (w dt / 2)^2): just under the limit a flat
   ellipse. */
static void an_oscillator_is_lost_where_predicted(void **state)
{
    (void)state;
    assert_close(largest_energy("verlet", 1.999), 1 / (1 - 0.25 * 1.999 * 1.999), 1e-3, 0);
    assert_true(!(largest_energy("verlet", 2.001) < 1e200));
    assert_true(largest_energy("rk4", 2.828) <= 2); /* loses all it has: a change of 1 */
    assert_true(largest_energy("rk4", 2.829) > 1e10);
}

static void explicit_euler_gains_energy_exactly_so(void **state)
{
    (void)state;
    struct motion m;
    follow_open(&m, "spring", NULL, 0);
    assert_true(follow_steps(&m, "euler", 0.01, 1000));
    assert_close(1 + follow_energy_error(&m), pow(1 + 1e-4, 1000), 1e-12, 0);
    assert_close(1 + follow_energy_error(&m), 1.10516539, 0, 5e-9);
    motion_close(&m);
}

static void runge_kutta_loses_energy(void **state)
{
    (void)state;
    struct motion m;
    follow_open(&m, "spring", NULL, 0);
    assert_true(follow_steps(&m, "rk4", 0.1, 1000));
    assert_close(follow_energy_error(&m), -1.387e-5, 0, 5e-9);
    motion_close(&m);
}

/* ---- what is said of steps before they are taken ---- */

static void warnings_say_limit_and_remedy(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        double dt;
        enum phys_step_verdict verdict;
        const char *says;
    } cases[] = {
        {"verlet", 0.1, PHYS_STEP_GOOD, ""},
        {"verlet", 0.9, PHYS_STEP_RESONANT, "0.9 resonance 0.866025 0.15*"},
        {"verlet", 1.1, PHYS_STEP_UNSTABLE, "1.1 1 verlet q"},
        {"rk4", 1.5, PHYS_STEP_UNSTABLE, "1.41421 rk4 implicit-midpoint dop853"},
        {"euler", 0.01, PHYS_STEP_UNSTABLE, "euler 1.06 verlet"},
        {"implicit-midpoint", 1.5, PHYS_STEP_GOOD, ""},
    };
    struct motion m;
    follow_open(&m, "spring", "k", 4); /* w = 2, period 3.142 */
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct phys_step_advice advice;
        follow_advice(&m, cases[k].integrator, cases[k].dt, &advice);
        assert_close(advice.motion.frequency, 2, 1e-14, 0);
        assert_int_equal(advice.verdict, cases[k].verdict);
        assert_true((advice.verdict == PHYS_STEP_GOOD) == (advice.text[0] == '\0'));
        assert_mentions(advice.text, cases[k].says);
    }
    motion_close(&m);
}

/* A saddle of the potential has a hillside, too; masses are weighed. L = (m x'^2 + M y'^2)/2 -
   (a x^2 - b y^2)/2: frequency sqrt(a/m), growth sqrt(b/M). */
static ad_var saddle(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var T = ad_add(ad_mul(1.5, ad_square(ad_row(v, 0))), ad_mul(2.5, ad_square(ad_row(v, 1))));
    ad_var V = ad_sub(ad_mul(6.0, ad_square(ad_row(q, 0))), ad_mul(0.9, ad_square(ad_row(q, 1))));
    return ad_sub(T, V);
}

static void small_motions_of_a_saddle(void **state)
{
    (void)state;
    const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                     .size = sizeof scene,
                                     .name = "saddle",
                                     .dof = 2,
                                     .dims = 1,
                                     .lagrangian = saddle};
    const struct phys_system system = {.scene = &scene, .dof = 2, .bodies = 2, .dims = 1};
    const double x[4] = {0.3, -0.2, 0.7, 0.1}, t = 1.5;
    struct phys_normal_modes motion;
    struct ad_error error = {0};
    phys_normal_modes(&system, 1, x, &t, &motion, &error);
    assert_int_equal(error.status, AD_OK);
    assert_close(motion.frequency, 2, 1e-14, 0);
    assert_close(motion.growth, 0.6, 1e-14, 0);
    assert_int_equal(motion.coordinate, 0);
    assert_close(motion.t, t, 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_limits_of_methods_are_found),
        cmocka_unit_test(methods_that_choose_their_steps_have_none),
        cmocka_unit_test(limits_hold_for_every_method),
        cmocka_unit_test(an_oscillator_is_lost_where_predicted),
        cmocka_unit_test(explicit_euler_gains_energy_exactly_so),
        cmocka_unit_test(runge_kutta_loses_energy),
        cmocka_unit_test(warnings_say_limit_and_remedy),
        cmocka_unit_test(small_motions_of_a_saddle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
