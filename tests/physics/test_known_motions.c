/* Motions with solutions known to many digits. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "motion.h"

#include <string.h>

static const double tight = 2.3e-14;
/* errors of steps in units of 1, as the published figures have them */
static const double ones[2 * MOTION_DOF] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};

/* ---- pendulum ---- */

static void pendulum_rate(void *context, double t, const double *y, double *g)
{
    (void)context, (void)t;
    *g = y[1];
}

static bool note_time(void *context, size_t k, double t, const double *y)
{
    (void)k, (void)y;
    *(double *)context = t;
    return false;
}

/* From rest at the amplitude, the velocity falls through zero after a period. */
static void test_pendulum_periods(void **state)
{
    (void)state;
    static const struct {
        double l, amplitude, period;
    } rows[] = {{1, 0.1, 6.28711454931},
                {1, 1, 6.69997566437},
                {1, M_PI / 2, 7.41629870921},
                {1, 3, 16.1555393724},
                {180, M_PI / 2, 99.5000883}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        const struct phys_setting set[] = {{"l", rows[k].l}, {"theta0", rows[k].amplitude}, {0}};
        double period = 0;
        const struct phys_events events = {.n = 1,
                                           .values = pendulum_rate,
                                           .direction = -1,
                                           .found = note_time,
                                           .context = &period};
        struct motion m;
        motion_open(&m, "pendulum", false, set);
        m.settings.events = &events;
        m.settings.n_events = 1;
        motion_run(&m, "dop853", tight, 1000, AD_OK);
        assert_int_equal(m.info.stop, PHYS_SIMULATION_EVENT);
        assert_close(period, rows[k].period, rows[k].l > 1 ? 5e-10 : 1e-12, 0);
        assert_true(m.info.t == period);
        assert_close(m.y[0], rows[k].amplitude, 1e-10, 0);
        motion_close(&m);
    }
}

/* sn(t, k) by the arithmetic-geometric mean (Abramowitz, Stegun, Handbook of Mathematical
   Functions, 16.4). */
static double sn(double t, double k)
{
    enum { LEVELS = 8 };
    double a[LEVELS] = {1}, c[LEVELS] = {k}, b = sqrt(1 - k * k);
    for (size_t i = 1; i < LEVELS; i++) {
        a[i] = 0.5 * (a[i - 1] + b);
        c[i] = 0.5 * (a[i - 1] - b);
        b = sqrt(a[i - 1] * b);
    }
    double phi = ldexp(a[LEVELS - 1] * t, LEVELS - 1);
    for (size_t i = LEVELS - 1; i > 0; i--)
        phi = 0.5 * (phi + asin(c[i] / a[i] * sin(phi)));
    return sin(phi);
}

/* q = 2 asin(k sn(t, k)) with k = 0.9. */
static void test_pendulum_by_elliptic_functions(void **state)
{
    (void)state;
    const struct phys_setting set[] = {{"l", 1}, {"theta0", 0}, {"rate0", 1.8}, {0}};
    struct motion m;
    double exact = 2 * asin(0.9 * sn(100, 0.9));
    assert_close(exact, -0.60755999, 0, 1e-8); /* its last digit is cut off */
    motion_open(&m, "pendulum", false, set);
    motion_run(&m, "dop853", tight, 100, AD_OK);
    assert_close(m.y[0], exact, 0, 3e-11);
    motion_close(&m);
    motion_open(&m, "pendulum", true, set);
    motion_run(&m, "gauss5", 0.1, 100, AD_OK);
    assert_close(m.y[0], exact, 0, 3e-11);
    motion_close(&m);
}

/* ---- Kepler ---- */

static void test_kepler(void **state)
{
    (void)state;
    struct motion m;
    struct phys_totals totals;
    phys_legendre *legendre;
    motion_open(&m, "kepler", false, NULL);
    motion_run(&m, "dop853", tight, 1, AD_OK);
    assert_close(m.y[0], -0.628948176826624, 1e-13, 0);
    assert_close(m.y[1], 0.799664730970039, 1e-13, 0);
    assert_int_equal(phys_legendre_new(&m.system, &legendre, &m.error), AD_OK);
    phys_totals(legendre, m.y, m.y + 2, 1, &totals);
    assert_close(totals.energy, -0.5, 2e-13, 0);
    assert_close(totals.angular[2], 0.8, 2e-13, 0);
    assert_true(totals.angular[0] == 0 && totals.mass == 1);
    phys_legendre_free(legendre);
    motion_close(&m);
}

/* Ten orbits of eccentricity 0.6: errors of position at a number of force calls. */
static void test_work_and_precision(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        size_t calls, calls_a_step;
        double error;
    } rows[] = {{"verlet", 10000, 1, 1e-2},   {"verlet", 100000, 1, 1e-4},
                {"rk4", 10000, 4, 2.5e-3},    {"rk4", 100000, 4, 7e-8},
                {"yoshida4", 9999, 3, 1e-3},  {"yoshida4", 99999, 3, 1e-7},
                {"yoshida6", 10003, 7, 5e-5}, {"yoshida6", 100002, 7, 5e-11}};
    double span = 20 * M_PI;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct motion m;
        motion_open(&m, "kepler", false, NULL);
        motion_run(&m, rows[k].integrator, span / (double)(rows[k].calls / rows[k].calls_a_step),
                   span, AD_OK);
        double error = hypot(m.y[0] - 0.4, m.y[1]);
        assert_close((double)m.info.evaluations, (double)rows[k].calls, 1e-3, 0);
        assert_close(log10(error), log10(rows[k].error), 0, 0.15);
        motion_close(&m);
    }
    static const struct {
        double tolerance, error;
        size_t calls;
    } adaptive[] = {{1.3e-12, 7e-9, 9194}, {1e-14, 2e-11, 14100}};
    for (size_t k = 0; k < sizeof adaptive / sizeof *adaptive; k++) {
        struct motion m;
        motion_open(&m, "kepler", false, NULL);
        m.settings.scale = ones;
        motion_run(&m, "dop853", adaptive[k].tolerance, span, AD_OK);
        print_message("dop853: error %.1e in %zu calls\n", hypot(m.y[0] - 0.4, m.y[1]),
                      m.info.evaluations);
        assert_true(hypot(m.y[0] - 0.4, m.y[1]) < adaptive[k].error);
        assert_true(m.info.evaluations < adaptive[k].calls);
        motion_close(&m);
    }
}

/* ---- several bodies ---- */

static struct phys_closest_approach run_watched(struct motion *m, double tolerance, double t)
{
    struct phys_closest_approach closest;
    assert_int_equal(phys_closest_approach_begin(&m->ode, 0, m->y, &closest, &m->error), AD_OK);
    m->settings.events = &closest.events;
    m->settings.n_events = 1;
    m->settings.watch_energy = true;
    motion_run(m, "dop853", tolerance, t, AD_OK);
    phys_closest_approach_end(&closest);
    return closest;
}

static void test_figure_eight(void **state)
{
    (void)state;
    for (int canonical = 0; canonical < 2; canonical++) {
        struct motion m;
        double start[12];
        motion_open(&m, "figure8", canonical, NULL);
        memcpy(start, m.y, sizeof start);
        struct phys_closest_approach closest = run_watched(&m, 1e-13, 6.3259138908);
        for (size_t k = 0; k < 12; k++)
            assert_close(m.y[k], start[k], 0, 1e-9);
        assert_close(m.info.energy_start, -1.287142008, 5e-10, 0);
        assert_close(closest.distance, 0.6905266, 1e-7, 0);
        motion_close(&m);
    }
}

/* The motion in (q, v), and behind it the action: S' = L = p v - E. */
struct with_action {
    const struct phys_ode *ode;
    phys_legendre *legendre;
};

static enum ad_status with_action_field(void *context, double t, const double *y, double *rate,
                                        struct ad_error *error)
{
    const struct with_action *c = context;
    size_t dof = c->ode->n / 2;
    double p[MOTION_DOF], L = -phys_legendre_energy(c->legendre, y, y + dof, t);
    phys_legendre_momentum(c->legendre, y, y + dof, t, p, NULL);
    for (size_t k = 0; k < dof; k++)
        L += p[k] * y[dof + k];
    rate[2 * dof] = L;
    return c->ode->field(c->ode->context, t, y, rate, error);
}

static void test_action_of_the_figure_eight(void **state)
{
    (void)state;
    struct motion m, both = {0};
    struct with_action c = {.ode = &m.ode};
    motion_open(&m, "figure8", false, NULL);
    assert_int_equal(phys_legendre_new(&m.system, &c.legendre, &m.error), AD_OK);
    both.ode = (struct phys_ode){.n = m.ode.n + 1, .field = with_action_field, .context = &c};
    memcpy(both.y, m.y, m.ode.n * sizeof *m.y);
    motion_run(&both, "dop853", 1e-13, 6.3259138908, AD_OK);
    assert_close(both.y[m.ode.n], 24.42704853, 0, 6e-9);
    phys_legendre_free(c.legendre);
    motion_close(&m);
}

/* Velocities enter the forces: by (q, v), and by (q, p) with p = v + (-y, x). */
static void test_arenstorf(void **state)
{
    (void)state;
    for (int canonical = 0; canonical < 2; canonical++) {
        struct motion m;
        motion_open(&m, "arenstorf", canonical, NULL);
        assert_null(m.ode.kick);
        assert_close(m.y[3], -2.00158510637908252240537862224 + (canonical ? 0.994 : 0), 1e-15, 0);
        m.settings.watch_energy = true;
        motion_run(&m, "dop853", 1e-14, 17.06521656015796, AD_OK);
        double distance = hypot(m.y[0] - 0.994, m.y[1]);
        print_message("Arenstorf's orbit closes to %.1e in %zu calls\n", distance,
                      m.info.evaluations);
        assert_true(distance < 3.5e-10);
        assert_true(m.info.energy_drift < 1e-12); /* Jacobi's constant */
        motion_close(&m);
    }
}

/* What is conserved, over the time that each answer is for: energies, and Jacobi's constant. At the
   Pythagorean encounter V is 4000 times E, of bodies 4e-4 apart whose places are of order 1, so
   that rounding of the places alone is 1e-9 of the energy. */
static void test_energy_drift(void **state)
{
    (void)state;
    static const struct {
        const char *scene;
        double e, time, drift; /* e: eccentricity, or 0 */
    } rows[] = {{"kepler", 0.6, 20 * M_PI, 3e-13},
                {"kepler", 0.99, 2 * M_PI, 2e-12},
                {"figure8", 0, 6.3259138908, 1e-13},
                {"pythagorean", 0, 16, 1e-8},
                {"arenstorf", 0, 17.06521656, 1e-12}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        const struct phys_setting set[] = {{rows[k].e > 0 ? "e" : NULL, rows[k].e}, {0}};
        struct motion m;
        motion_open(&m, rows[k].scene, false, set);
        m.settings.watch_energy = true;
        m.settings.scale = ones;
        motion_run(&m, "dop853", 1e-14, rows[k].time, AD_OK);
        print_message("%-12s energy drift %.1e in %zu calls\n", rows[k].scene, m.info.energy_drift,
                      m.info.evaluations);
        assert_true(m.info.energy_drift > 0 && m.info.energy_drift < rows[k].drift);
        motion_close(&m);
    }
}

static void test_pythagorean(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "pythagorean", false, NULL);
    struct phys_closest_approach closest = run_watched(&m, 1e-13, 16);
    assert_close(closest.distance, 4.138e-4, 1e-4, 0);
    assert_close(closest.t, 15.829920, 0, 1e-6);
    assert_int_equal(closest.first, 1);
    assert_int_equal(closest.second, 2);
    motion_close(&m);
}

/* A collision: the step underflows there, and says so. */
static void test_head_on_fall(void **state)
{
    (void)state;
    static const char *const methods[] = {"dopri5", "dop853", "taylor"};
    for (size_t k = 0; k < LENGTH(methods); k++) {
        struct motion m;
        motion_open(&m, "fall", false, NULL);
        motion_run(&m, methods[k], 1e-12, 2, AD_E_ACCURACY);
        assert_close(m.info.t, 1.1107207345, 0, 6e-11);
        assert_mentions(m.error.message, "1.11072073*");
        assert_mentions(m.error.message, "collision x");
        motion_close(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pendulum_periods),
        cmocka_unit_test(test_pendulum_by_elliptic_functions),
        cmocka_unit_test(test_kepler),
        cmocka_unit_test(test_work_and_precision),
        cmocka_unit_test(test_figure_eight),
        cmocka_unit_test(test_action_of_the_figure_eight),
        cmocka_unit_test(test_arenstorf),
        cmocka_unit_test(test_energy_drift),
        cmocka_unit_test(test_pythagorean),
        cmocka_unit_test(test_head_on_fall),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
