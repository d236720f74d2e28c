/* Taylor series of motions of scenes: against closed forms, another method, and themselves
   backwards. */
#include "tests/physics/motion.h"
#include "tests/close.h"
#include "physics/physics.h"

#include <float.h>
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
        {taylor, 1e-16, 10, 3e-15}, {taylor, 1e-16, 300, 3e-15}, {"yoshida6", 0.01, 20, 4e-15}};
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
    struct phys_simulation how = {.size = sizeof how,
                                  .integrator = phys_integrator_find(taylor, &error),
                                  .t1 = 1,
                                  .rtol = 1e-9};
    double y = 1;
    assert_int_equal(phys_simulate(&how, &ode, &y, &info, &error), AD_E_ARGUMENT);
}

/* Coefficients themselves: of q = cos t, v = -sin t. */
static void test_coefficients(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "spring", false, NULL);
    double c[9][2] = {{1, 0}}, factorial = 1;
    assert_int_equal(m.ode.series(m.ode.context, 8, 0, c[0], NULL, &m.error), AD_OK);
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
        cmocka_unit_test(test_steps_do_not_see_the_clock),
        cmocka_unit_test(test_fields_without_a_series_are_refused),
        cmocka_unit_test(test_coefficients),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
