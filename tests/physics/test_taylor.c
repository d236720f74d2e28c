/* Taylor series of motions: against closed forms, another method, and themselves backwards. */
#include "motion.h"
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "physics/lagrangian/internal.h"
#include "physics/physics.h"

#include <float.h>
#include <limits.h>
#include <string.h>

static const char *const taylor = "taylor";

static void test_kepler_returns(void **state)
{
    (void)state;
    const double eccentricities[] = {0, 0.6, 0.9, 0.99, 0.9999};
    for (size_t k = 0; k < LENGTH(eccentricities); k++) {
        const struct phys_setting set[] = {{"e", eccentricities[k]}, {NULL, 0}};
        struct motion m;
        double start[4];
        motion_open(&m, "kepler", false, set);
        memcpy(start, m.y, sizeof start);
        m.settings.watch_energy = true;
        motion_run(&m, taylor, 1e-15, 2 * M_PI, AD_OK);
        /* a relative change of the speed at the start moves the period by 6 pi / (1 - e) times as
           much, and the velocity there by that times 1 / (1 - e)^2 */
        double growth = 6 * M_PI / pow(1 - eccentricities[k], 3);
        for (size_t i = 0; i < 4; i++)
            assert_close(m.y[i], start[i], 0, 4 * DBL_EPSILON * growth);
        /* T and V cancel near the centre */
        assert_true(m.info.energy_drift < 16 * DBL_EPSILON / (1 - eccentricities[k]));
        motion_close(&m);
    }
}

static long double energy_of(const double *y)
{
    long double r = sqrtl((long double)y[0] * y[0] + (long double)y[1] * y[1]);
    return ((long double)y[2] * y[2] + (long double)y[3] * y[3]) / 2 - 1 / r;
}

/* What rounding does to the energy is a random walk with compensated sums, and 5 to 30 times as
   much without. */
static void test_energy_wanders_like_rounding(void **state)
{
    (void)state;
    const double eccentricities[] = {0.55, 0.58, 0.6, 0.63};
    const struct {
        const char *name;
        double setting, orbits, most;
    } runs[] = {
        {taylor, 1e-16, 10, 3e-15}, {taylor, 1e-16, 300, 1.5e-14}, {"yoshida6", 0.01, 20, 4e-15}};
    for (size_t i = 0; i < LENGTH(runs); i++) {
        double sum = 0;
        for (size_t k = 0; k < LENGTH(eccentricities); k++) {
            const struct phys_setting set[] = {{"e", eccentricities[k]}, {NULL, 0}};
            struct motion m;
            motion_open(&m, "kepler", false, set);
            long double before = energy_of(m.y);
            motion_run(&m, runs[i].name, runs[i].setting, 2 * M_PI * runs[i].orbits, AD_OK);
            sum += pow((double)(energy_of(m.y) / before - 1), 2);
            motion_close(&m);
        }
        double rms = sqrt(sum / LENGTH(eccentricities));
        print_message("%s, %g orbits: %.1e\n", runs[i].name, runs[i].orbits, rms);
        assert_true(rms < runs[i].most);
    }
}

/* Each tolerance is kept within what a step's error grows to, and asks fewer steps the larger it
   is, or a higher order. */
static void test_tolerances(void **state)
{
    (void)state;
    double exact[4], before = INFINITY;
    struct motion m;
    motion_open(&m, "dblpend", false, NULL);
    motion_run(&m, "dop853", 1e-15, 3, AD_OK);
    memcpy(exact, m.y, sizeof exact);
    motion_close(&m);
    for (double tol = 1e-3; tol > 1e-15; tol *= 1e-3) {
        motion_open(&m, "dblpend", false, NULL);
        motion_run(&m, taylor, tol, 3, AD_OK);
        double error = 0;
        for (size_t i = 0; i < 4; i++)
            error = fmax(error, fabs(m.y[i] - exact[i]));
        print_message("%.0e: error %.1e in %zu steps\n", tol, error, m.info.steps);
        assert_true(error < fmax(10 * tol, 2e-12));
        assert_true(error < before || error < 2e-12);
        before = error;
        motion_close(&m);
    }
}

struct samples {
    size_t n;
    double y[64][4];
};

static bool keep(void *context, double t, const double *y)
{
    struct samples *s = context;
    (void)t;
    memcpy(s->y[s->n++], y, sizeof *s->y);
    return true;
}

/* Between the steps the series itself is the motion: samples against steps that end there. */
static void test_between_steps(void **state)
{
    (void)state;
    struct samples landed = {0}, between = {0};
    for (int pass = 0; pass < 2; pass++) {
        struct motion m;
        motion_open(&m, "kepler", false, NULL);
        m.settings.n_samples = 50;
        m.settings.land = pass == 0;
        m.settings.sample = keep;
        m.settings.context = pass == 0 ? &landed : &between;
        motion_run(&m, taylor, 1e-13, 7, AD_OK);
        motion_close(&m);
    }
    assert_int_equal(landed.n, 51);
    assert_int_equal(between.n, 51);
    for (size_t i = 0; i < 51; i++)
        for (size_t k = 0; k < 4; k++)
            assert_close(between.y[i][k], landed.y[i][k], 0, 1e-11);
}

static void test_there_and_back(void **state)
{
    (void)state;
    const char *const scenes[] = {"dblpend", "figure8", "arenstorf", "dimer"};
    for (size_t k = 0; k < LENGTH(scenes); k++) {
        struct motion m;
        double start[2 * MOTION_DOF];
        motion_open(&m, scenes[k], false, NULL);
        memcpy(start, m.y, sizeof start);
        motion_run(&m, taylor, 1e-14, 1, AD_OK);
        m.settings.t0 = 1;
        motion_run(&m, taylor, 1e-14, 0, AD_OK);
        for (size_t i = 0; i < m.ode.n; i++)
            assert_close(m.y[i], start[i], 1e-11, 1e-11);
        motion_close(&m);
    }
}

/* ---- Lagrangians of its own ---- */

static ad_var driven(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    return ad_add(ad_mul(0.5, ad_square(v)),
                  ad_sub(ad_mul(q, ad_cos(ad_mul(2.0, t))), ad_mul(0.5, ad_square(q))));
}
static ad_var bounce(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_abs(q));
}
/* a bead whose mass depends on where it is and when: L = (1 + q^2 + t) v^2 / 2 */
static ad_var heavy(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    return ad_mul(ad_mul(0.5, ad_square(v)), ad_add(t, ad_add(1.0, ad_square(q))));
}
static enum ad_status begin(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.5;
    v[0] = 0.25;
    return AD_OK;
}

static enum ad_status follow(const struct phys_scene *scene, const char *method, double t,
                             double y[2])
{
    struct phys_system system;
    struct phys_ode ode;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    struct phys_simulation how = {
        .integrator = phys_integrator_find(method, &error), .t1 = t, .rtol = 1e-14, .atol = 1e-14};
    assert_int_equal(phys_system_make(scene, &system, &error), AD_OK);
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
    y[0] = 0.5;
    y[1] = 0.25;
    phys_simulate(&how, &ode, y, &info, &error);
    phys_ode_free(&ode);
    phys_system_close(&system);
    return error.status;
}

/* q'' + q = cos 2t: q = (q0 + 1/3) cos t + v0 sin t - cos(2t) / 3. */
static void test_time_in_the_lagrangian(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, driven, 11, 0.1, begin);
    double y[2], t = 20;
    assert_int_equal(follow(&scene, taylor, t, y), AD_OK);
    assert_close(y[0], (0.5 + 1.0 / 3) * cos(t) + 0.25 * sin(t) - cos(2 * t) / 3, 0, 1e-13);
}

static void test_masses_that_vary(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, heavy, 11, 0.1, begin);
    double y[2], other[2];
    assert_int_equal(follow(&scene, taylor, 5, y), AD_OK);
    assert_int_equal(follow(&scene, "dop853", 5, other), AD_OK);
    assert_close(y[0], other[0], 1e-13, 0);
    assert_close(y[1], other[1], 1e-13, 0);
}

static ad_var falling(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(9.81, q));
}
static ad_var stretching(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_mul(0.5, ad_mul(ad_square(v), ad_exp(ad_mul(-2.0, q))));
}
/* 1e15 metres away, GM = 1e30: what happens to numbers of order 1 in units of AU */
static ad_var far_away(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_add(ad_mul(0.5, ad_square(v)), ad_div(1e30, ad_add(q, 1e15)));
}

/* Coefficients that vanish beyond some order, a mass that varies by itself alone, and magnitudes
   that differ by 30 orders. */
static void test_coefficients_that_vanish_or_differ(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, falling, 11, 0.1, begin);
    double y[2], other[2];
    assert_int_equal(follow(&scene, taylor, 50, y), AD_OK);
    assert_close(y[0], 0.5 + 0.25 * 50 - 0.5 * 9.81 * 2500, 1e-15, 0);
    assert_close(y[1], 0.25 - 9.81 * 50, 1e-15, 0);
    scene = scene_of("own", 1, stretching, 11, 0.1,
                     begin); /* q'' = q'^2: q = q0 - log(1 - v0 t), singular at t = 4 */
    assert_int_equal(follow(&scene, taylor, 3.9, y), AD_OK);
    assert_close(y[0], 0.5 - log(1 - 0.25 * 3.9), 1e-12, 0);
    assert_int_not_equal(follow(&scene, taylor, 5, y), AD_OK);
    scene = scene_of("own", 1, far_away, 11, 0.1, begin);
    assert_int_equal(follow(&scene, taylor, 1e5, y), AD_OK);
    assert_int_equal(follow(&scene, "dop853", 1e5, other), AD_OK);
    assert_close(y[0], other[0], 1e-12, 0);
    assert_close(y[1], other[1], 1e-12, 0);
}

enum { LATE_SAMPLES = 20, LATE_STEPS = 100 };

static bool keep_state(void *context, double t, const double *y)
{
    double(*to)[4] = context;
    (void)t;
    memcpy(to[1 + (size_t)to[0][0]], y, sizeof *to);
    to[0][0]++;
    return to[0][0] <= LATE_SAMPLES;
}

/* The lengths of steps are not rounded to what the clock resolves: late steps are those of early
   ones to the last bit. Rounded lengths gave a drift of the energy, 1e-12 after 1e5 orbits. */
static void test_steps_do_not_see_the_clock(void **state)
{
    (void)state;
    double states[2][LATE_SAMPLES + 2][4] = {{{0}}};
    for (size_t k = 0; k < 2; k++) {
        const double t0 = k ? 6e5 : 0;
        struct motion m;
        motion_open(&m, "kepler", false, NULL);
        m.settings.t0 = t0;
        m.settings.every = LATE_STEPS;
        m.settings.sample = keep_state;
        m.settings.context = states[k];
        motion_run(&m, taylor, 1e-15, t0 + 100 * 2 * M_PI, AD_OK);
        assert_int_equal(m.info.stop, PHYS_SIMULATION_INTERRUPTED);
        motion_close(&m);
    }
    assert_memory_equal(states[0], states[1], sizeof states[0]);
}

/* A series knows one side of a kink alone. */
static void test_kinks_are_refused(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, bounce, 11, 0.1, begin);
    double y[2];
    assert_int_equal(follow(&scene, taylor, 5, y), AD_E_ARGUMENT);
    assert_int_equal(follow(&scene, "dop853", 0.1, y), AD_OK);
}

/* |q| by other names, and what only looks like it. */
static ad_var q_squared(ad_var q) { return ad_mul(2.0, ad_square(q)); }
#define KINK(name, V)                                                                              \
    static ad_var name(ad_var q, ad_var v, ad_var t, const void *params)                           \
    {                                                                                              \
        (void)params, (void)t;                                                                     \
        return ad_sub(ad_mul(0.5, ad_square(v)), V);                                               \
    }
KINK(root, ad_sqrt(q_squared(q)))
KINK(product, ad_sqrt(ad_mul(q, q)))
KINK(factor, ad_sqrt(ad_mul(ad_square(q), ad_add(1.0, ad_square(q)))))
KINK(sum, ad_sqrt(ad_add(ad_square(q), ad_mul(3.0, ad_square(q)))))
KINK(power, ad_pow(q_squared(q), 0.5))
KINK(three_halves, ad_pow(q_squared(q), 1.5))
KINK(hypotenuse, ad_hypot(q, ad_mul(2.0, q)))
KINK(triangle, ad_asin(ad_sin(q)))
KINK(softened, ad_sqrt(ad_add(1.0, ad_square(q))))
KINK(powers, ad_pow(ad_add(1.0, q_squared(q)), 1.5))
KINK(of_two, ad_hypot(q, ad_add(1.0, q)))

static void test_kinks_by_other_names(void **state)
{
    (void)state;
    phys_lagrangian *const sharp[] = {root,  product,      factor,     sum,
                                      power, three_halves, hypotenuse, triangle};
    phys_lagrangian *const smooth[] = {softened, powers, of_two};
    double y[2];
    for (size_t k = 0; k < LENGTH(sharp); k++) {
        struct phys_scene scene = scene_of("own", 1, sharp[k], 11, 0.1, begin);
        enum ad_status status = follow(&scene, taylor, 1, y);
        if (status != AD_E_ARGUMENT)
            print_error("kink %zu is not seen\n", k);
        assert_int_equal(status, AD_E_ARGUMENT);
    }
    for (size_t k = 0; k < LENGTH(smooth); k++) {
        struct phys_scene scene = scene_of("own", 1, smooth[k], 11, 0.1, begin);
        assert_int_equal(follow(&scene, taylor, 1, y), AD_OK);
    }
}

static enum ad_status decay(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    (void)context, (void)t, (void)error;
    rate[0] = -y[0];
    return AD_OK;
}

static void test_fields_without_a_series_are_refused(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    struct phys_ode ode = {.n = 1, .field = decay};
    struct phys_simulation how = {
        .integrator = phys_integrator_find(taylor, &error), .t1 = 1, .rtol = 1e-9};
    double y = 1;
    assert_int_equal(phys_simulate(&how, &ode, &y, &info, &error), AD_E_ARGUMENT);
}

/* A pulse too thin for the series to see from where the step begins: the slope at its end gives it
   away where the step ends inside, and a barrier that does not is left to the reference. */
static ad_var wall(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    ad_var x = ad_mul(ad_sub(q, 1.0), 20.0);
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_exp(ad_neg(ad_square(x))));
}

static void test_a_wall_turns_it_around(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, wall, 11, 0.1, begin);
    double y[2], other[2];
    assert_int_equal(follow(&scene, taylor, 2.1, y), AD_OK); /* met about t = 1.8 */
    assert_int_equal(follow(&scene, "dop853", 2.1, other), AD_OK);
    assert_close(y[0], other[0], 1e-10, 0);
    assert_close(y[1], other[1], 1e-10, 0);
}

/* Where a step goes over the wall, at every tolerance, the measured error shows it, and another
   method is taken. */
static void test_what_the_series_does_not_see(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, wall, 11, 0.1, begin);
    struct phys_system system;
    struct phys_motion_solution motion;
    struct ad_error error = {0};
    const struct phys_motion_settings settings = {.time = 20, .error = 1e-6};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_motion_solve(&system, &settings, &motion, &error), AD_OK);
    assert_string_equal(motion.trial[0].integrator->name, taylor);
    assert_false(motion.trial[0].chosen);
    assert_true(motion.error <= 1e-6);
    assert_close(motion.x[2 * (motion.n - 1) + 1], -0.25, 1e-6, 0);
    phys_motion_solution_free(&motion);
    phys_system_close(&system);
}

static ad_var thin_wall(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    ad_var x = ad_mul(ad_sub(q, 1.0), 200.0);
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_exp(ad_neg(ad_square(x))));
}

static int calls, last_call;

static bool count_calls(void *context)
{
    (void)context;
    return ++calls < last_call;
}

/* A wall thinner than the first steps of dop853, too: its tolerance is tightened, and that of the
   series, which was given up, stays as it was tried. An interruption at any time ends all. */
static void test_what_is_tightened(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, thin_wall, 11, 0.1, begin);
    struct phys_system system;
    struct phys_motion_solution motion;
    struct ad_error error = {0};
    const struct phys_motion_settings settings = {
        .time = 20, .error = 1e-8, .proceed = count_calls};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    calls = 0, last_call = INT_MAX;
    assert_int_equal(phys_motion_solve(&system, &settings, &motion, &error), AD_OK);
    const struct phys_motion_trial *trial = motion.trial;
    assert_true(motion.n_trials == 2 && !trial[0].chosen && trial[1].chosen);
    assert_true(isfinite(trial[0].estimate) && isnan(trial[1].estimate)); /* tightened */
    assert_true(motion.setting == trial[1].setting && trial[1].integrator == motion.integrator);
    assert_true(motion.error <= 1e-8);
    phys_motion_solution_free(&motion);
    for (int all = calls, k = 1; k < all; k += 1 + all / 12) {
        calls = 0, last_call = k;
        error = (struct ad_error){0};
        enum ad_status status = phys_motion_solve(&system, &settings, &motion, &error);
        assert_true(status == AD_E_ACCURACY || (status == AD_OK && motion.info.stop));
        assert_true(calls < k + 3);
        phys_motion_solution_free(&motion);
    }
    phys_system_close(&system);
}

/* Coefficients themselves: of q = cos t, v = -sin t. */
static void test_coefficients(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "spring", false, NULL);
    double c[9][2] = {{1, 0}}, factorial = 1;
    assert_int_equal(m.ode.series(m.ode.context, 8, 0, c[0], &m.error), AD_OK);
    for (size_t k = 0; k <= 8; factorial *= (double)++k) {
        const double cosine[] = {1, 0, -1, 0}, sine[] = {0, -1, 0, 1};
        assert_close(c[k][0], cosine[k % 4] / factorial, 1e-15, 0);
        assert_close(c[k][1], sine[k % 4] / factorial, 1e-15, 0);
    }
    motion_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kepler_returns),
        cmocka_unit_test(test_energy_wanders_like_rounding),
        cmocka_unit_test(test_tolerances),
        cmocka_unit_test(test_between_steps),
        cmocka_unit_test(test_there_and_back),
        cmocka_unit_test(test_time_in_the_lagrangian),
        cmocka_unit_test(test_masses_that_vary),
        cmocka_unit_test(test_coefficients_that_vanish_or_differ),
        cmocka_unit_test(test_steps_do_not_see_the_clock),
        cmocka_unit_test(test_kinks_are_refused),
        cmocka_unit_test(test_kinks_by_other_names),
        cmocka_unit_test(test_fields_without_a_series_are_refused),
        cmocka_unit_test(test_a_wall_turns_it_around),
        cmocka_unit_test(test_what_the_series_does_not_see),
        cmocka_unit_test(test_what_is_tightened),
        cmocka_unit_test(test_coefficients),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
