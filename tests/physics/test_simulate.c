/* The driver: samples, dense output, events, tolerances, smallest steps, and ends. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "motion.h"
#include "physics/integrators/stepper.h"

#include <string.h>

enum { ROOM = 4096 };

struct record {
    size_t n, stop_after; /* 0: never */
    double t[ROOM], y[ROOM][4];
};

static bool keep(void *context, double t, const double *y)
{
    struct record *r = context;
    assert_true(r->n < ROOM);
    r->t[r->n] = t;
    memcpy(r->y[r->n++], y, 2 * sizeof *y);
    return r->n != r->stop_after;
}

static struct record record;

/* The oscillator, from q = 1 at rest: q = cos t, v = -sin t. */
static void open_spring(struct motion *m)
{
    motion_open(m, "spring", false, NULL);
    record.n = record.stop_after = 0;
    m->settings.sample = keep;
    m->settings.context = &record;
}

static void test_samples_of_fixed_steps(void **state)
{
    (void)state;
    struct motion m;
    open_spring(&m);
    m.settings.every = 3;
    motion_run(&m, "verlet", 0.1, 1, AD_OK);
    assert_int_equal(record.n, 4); /* start, steps 3, 6, 9 */
    assert_close(record.t[2], 0.6, 1e-15, 0);
    motion_close(&m);

    open_spring(&m); /* more samples than steps: every step once */
    m.settings.n_samples = 37;
    motion_run(&m, "verlet", 0.1, 1, AD_OK);
    assert_int_equal(record.n, 11);
    assert_true(record.t[10] == 1);
    motion_close(&m);

    open_spring(&m);
    m.settings.n_samples = 5;
    motion_run(&m, "verlet", 0.1, 1, AD_OK);
    assert_int_equal(record.n, 6);
    assert_close(record.t[1], 0.2, 1e-15, 0);
    assert_true(record.t[5] == 1);
    motion_close(&m);

    open_spring(&m); /* a step that does not divide the time is shortened */
    motion_run(&m, "verlet", 0.3, 1, AD_OK);
    assert_int_equal(m.info.steps, 4);
    assert_close(m.info.max_step, 0.25, 1e-15, 0);
    motion_close(&m);
}

/* Dense output is as good as the steps, at any density, and does not change them. */
static void test_dense_output(void **state)
{
    (void)state;
    static const char *const methods[] = {"dopri5", "dop853"};
    for (size_t k = 0; k < 2; k++) {
        struct motion m;
        open_spring(&m);
        motion_run(&m, methods[k], 1e-10, 20, AD_OK);
        struct phys_simulation_info plain = m.info;
        double end = m.y[0], worst = 0;
        motion_close(&m);
        open_spring(&m);
        m.settings.n_samples = 1000;
        motion_run(&m, methods[k], 1e-10, 20, AD_OK);
        assert_int_equal(m.info.steps, plain.steps);
        assert_in_range(m.info.evaluations - plain.evaluations, 0, 1); /* the rate at the end */
        assert_true(m.y[0] == end);
        assert_int_equal(record.n, 1001);
        for (size_t i = 0; i < record.n; i++) {
            assert_close(record.t[i], 0.02 * (double)i, 1e-15, 0);
            worst = fmax(worst, fabs(record.y[i][0] - cos(record.t[i])));
            worst = fmax(worst, fabs(record.y[i][1] + sin(record.t[i])));
        }
        print_message("%s: end %.1e, anywhere %.1e\n", methods[k], fabs(end - cos(20)), worst);
        assert_true(worst < 20 * 1e-10);
        motion_close(&m);
    }
}

/* dt of adaptive methods is the first step, unless that is too long. */
static void test_first_step(void **state)
{
    (void)state;
    static const char *const methods[] = {"dopri5", "dop853", "taylor"};
    for (size_t k = 0; k < LENGTH(methods); k++)
        for (int backwards = 0; backwards < 2; backwards++) {
            struct motion m;
            double end = backwards ? -5 : 5;
            open_spring(&m);
            m.settings.dt = 0x1p-7;
            m.settings.every = 1;
            motion_run(&m, methods[k], 1e-6, end, AD_OK);
            assert_true(record.t[1] == (backwards ? -0x1p-7 : 0x1p-7));
            motion_close(&m);
            open_spring(&m);
            m.settings.dt = 1e3;
            motion_run(&m, methods[k], 1e-10, end, AD_OK);
            assert_true(m.info.rejected > 0);
            assert_close(m.y[0], cos(5), 0, 1e-8);
            motion_close(&m);
            open_spring(&m); /* without one: some time of the motion, no share of the whole */
            m.settings.every = 1;
            motion_run(&m, methods[k], 1e-6, end, AD_OK);
            assert_true(fabs(record.t[1]) > 0.02 && fabs(record.t[1]) < 5);
            motion_close(&m);
        }
}

static enum ad_status oscillates(void *context, double t, const double *y, double *rate,
                                 struct ad_error *error)
{
    const double *w = context;
    (void)t, (void)error;
    rate[0] = y[1];
    rate[1] = -*w * *w * y[0];
    return AD_OK;
}

/* As Hairer, Norsett and Wanner choose it (section II.4), by the size of y' or of y''. */
static void test_first_step_by_its_rates(void **state)
{
    static const double w[] = {1, 5}, tolerance = 1e-6;
    (void)state;
    for (size_t i = 0; i < LENGTH(w); i++) {
        double frequency = w[i], y[] = {1, 2}, unit[] = {2 * tolerance, 3 * tolerance};
        double rates[] = {y[1], -w[i] * w[i] * y[0]}, d[3], one[] = {1, 1};
        for (size_t k = 0; k < 3; k++) /* y'' = -w^2 y */
            d[k] = hypot((k == 1 ? rates : y)[0] / unit[0], (k == 1 ? rates : y)[1] / unit[1]) *
                   sqrt(0.5) * (k == 2 ? w[i] * w[i] : 1);
        struct motion m = {.ode = {.n = 2, .field = oscillates, .context = &frequency},
                           .y = {y[0], y[1]}};
        record.n = record.stop_after = 0;
        m.settings =
            (struct phys_simulation){.sample = keep, .context = &record, .every = 1, .scale = one};
        motion_run(&m, "dop853", tolerance, 1, AD_OK);
        assert_close(record.t[1], fmin(d[0] / d[1], pow(0.01 / fmax(d[1], d[2]), 1. / 8)), 1e-9, 0);
    }
}

/* One force a step, of a method that ends a step with the force that the next begins with. */
static void test_forces_of_a_step(void **state)
{
    (void)state;
    const struct {
        const char *method;
        size_t evaluations;
    } runs[] = {{"velocity-verlet", 101}, {"verlet", 100}, {"semi-implicit", 100}, {"rk4", 400}};
    for (size_t k = 0; k < LENGTH(runs); k++) {
        struct motion m;
        motion_open(&m, "kepler", false, NULL);
        motion_run(&m, runs[k].method, 0.01, 1, AD_OK);
        assert_int_equal(m.info.evaluations, runs[k].evaluations);
        motion_close(&m);
    }
}

/* The rates by a system's series, which phys_ode_for takes, against those by its tape. */
static void test_thin_rates(void **state)
{
    (void)state;
    static const char *const scenes[] = {"kepler", "figure8", "dblpend", "pendulum", "arenstorf"};
    for (size_t k = 0; k < LENGTH(scenes); k++) {
        struct motion m;
        struct phys_ode thin;
        double rate[2][2 * MOTION_DOF], *y = m.y;
        motion_open(&m, scenes[k], false, NULL);
        assert_int_equal(
            phys_ode_for(&m.system, phys_integrator_find("rk4", &m.error), &thin, &m.error), AD_OK);
        for (size_t i = 0; i < m.ode.n; i++)
            y[i] += 0.1 * sin(1.0 + (double)i);
        for (int i = 0; i < 2; i++)
            assert_int_equal((i ? &thin : &m.ode)
                                 ->field((i ? &thin : &m.ode)->context, 0.3, y, rate[i], &m.error),
                             AD_OK);
        for (size_t i = 0; i < m.ode.n; i++)
            assert_close(rate[1][i], rate[0][i], 1e-14, 1e-14);
        if (thin.kick && m.ode.kick) {
            thin.kick(thin.context, 0.3, y, rate[1], &m.error);
            for (size_t i = 0; i < m.ode.n / 2; i++)
                assert_close(rate[1][i], rate[0][m.ode.n / 2 + i], 1e-14, 1e-14);
        }
        phys_ode_free(&thin);
        motion_close(&m);
    }
}

static void test_given_times(void **state)
{
    (void)state;
    static const double times[] = {0.1, 0.1001, 3.7, 5};
    struct motion m;
    open_spring(&m);
    m.settings.times = times;
    m.settings.n_samples = 4;
    motion_run(&m, "dop853", 1e-11, 5, AD_OK);
    assert_int_equal(record.n, 5);
    for (size_t i = 0; i < 4; i++) {
        assert_true(record.t[i + 1] == times[i]);
        assert_close(record.y[i + 1][0], cos(times[i]), 0, 1e-10);
    }
    motion_close(&m);
}

static void test_interruption(void **state)
{
    (void)state;
    struct motion m;
    open_spring(&m);
    record.stop_after = 3;
    m.settings.every = 1;
    motion_run(&m, "rk4", 0.1, 1, AD_OK);
    assert_int_equal(m.info.stop, PHYS_SIMULATION_INTERRUPTED);
    assert_int_equal(m.info.steps, 2);
    assert_close(m.info.t, 0.2, 1e-14, 0);
    assert_close(m.y[0], cos(0.2), 0, 1e-6);
    motion_close(&m);
}

/* Backwards, and there and back. */
static void test_backwards(void **state)
{
    (void)state;
    struct motion m;
    open_spring(&m);
    m.settings.n_samples = 10;
    motion_run(&m, "dop853", 1e-12, -3, AD_OK);
    assert_true(m.info.t == -3);
    for (size_t i = 0; i < record.n; i++)
        assert_close(record.y[i][0], cos(record.t[i]), 0, 1e-10);
    motion_close(&m);
    open_spring(&m);
    m.settings.t0 = m.settings.t1 = 2;
    motion_run(&m, "dop853", 1e-12, 2, AD_OK);
    assert_int_equal(m.info.steps, 0);
    motion_close(&m);
}

/* The error follows the tolerance over ten powers of ten. */
static void test_tolerance(void **state)
{
    (void)state;
    static const char *const methods[] = {"dopri5", "dop853"};
    for (size_t k = 0; k < 2; k++)
        for (double tolerance = 1e-3; tolerance > 1e-12; tolerance *= 0.1) {
            struct motion m;
            open_spring(&m);
            motion_run(&m, methods[k], tolerance, 10, AD_OK);
            assert_true(hypot(m.y[0] - cos(10), m.y[1] + sin(10)) < 30 * tolerance);
            motion_close(&m);
        }
}

/* ---- what cannot be followed ---- */

static enum ad_status explode(void *context, double t, const double *y, double *rate,
                              struct ad_error *error)
{
    (void)context, (void)t, (void)error;
    rate[0] = y[0] * y[0]; /* y = 1 / (1 - t) */
    return AD_OK;
}

static enum ad_status edge(void *context, double t, const double *y, double *rate,
                           struct ad_error *error)
{
    (void)context;
    rate[0] = y[0];
    return t > 1 ? ad_fail(error, AD_E_NONFINITE, "no field beyond t = 1") : AD_OK;
}

static void test_users_field_that_ends(void **state)
{
    (void)state;
    struct motion m = {.ode = {.n = 1, .field = explode}, .y = {1}};
    motion_run(&m, "dop853", 1e-10, 2, AD_E_ACCURACY);
    assert_close(m.info.t, 1, 1e-8, 0);
    assert_mentions(m.error.message, "y1");
    m.y[0] = 1;
    motion_run(&m, "rk4", 0.125, 40, AD_E_NONFINITE);
    assert_mentions(m.error.message, "step ");
    assert_mentions(m.error.message, "y1");
    m.ode.field = edge;
    m.y[0] = 1;
    motion_run(&m, "dopri5", 1e-8, 2, AD_E_NONFINITE);
    assert_mentions(m.error.message, "1");
    assert_close(m.info.t, 1, 0, 1e-10);
    assert_close(m.y[0], exp(1), 1e-7, 0);
}

/* y1 and y3 grow slowly, the component that context points to explodes. */
static enum ad_status one_explodes(void *context, double t, const double *y, double *rate,
                                   struct ad_error *error)
{
    (void)t, (void)error;
    for (size_t k = 0; k < 3; k++)
        rate[k] = k == *(size_t *)context ? y[k] * y[k] : 0.01 * y[k];
    return AD_OK;
}

static void test_the_worst_component_is_named(void **state)
{
    (void)state;
    struct ad_error error = {0};
    const struct phys_integrator *methods[] = {phys_integrator_find("dopri5", &error),
                                               phys_integrator_find("dop853", &error),
                                               &phys_extrapolation};
    for (size_t i = 0; i < LENGTH(methods); i++)
        for (size_t k = 0; k < 3; k++) {
            static const char *const names[] = {"y1", "y2", "y3"};
            struct motion m = {.ode = {.n = 3, .field = one_explodes, .context = &k},
                               .y = {1, 1, 1}};
            motion_run_by(&m, methods[i], 1e-8, 2, AD_E_ACCURACY);
            assert_mentions(m.error.message, names[k]);
            m = (struct motion){.ode = m.ode, .y = {1, 1, 1}, .settings = {.max_steps = 3}};
            motion_run_by(&m, methods[i], 1e-8, 2, AD_E_ACCURACY);
            assert_mentions(m.error.message, names[k]);
        }
}

static void test_floor_and_most_steps(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "fall", false, NULL);
    m.settings.min_step = 1e-6;
    motion_run(&m, "dop853", 1e-10, 2, AD_E_ACCURACY);
    assert_true(m.info.min_step >= 1e-6);
    assert_true(m.info.t < 1.1107207345 && m.info.t > 1.110);
    motion_close(&m);
    motion_open(&m, "kepler", false, NULL);
    m.settings.max_steps = 7;
    motion_run(&m, "dop853", 1e-10, 100, AD_E_ACCURACY);
    assert_int_equal(m.info.steps, 7);
    motion_close(&m);
}

/* Right through the centre: not finite, named with step and coordinate. */
static void test_not_finite(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "fall", false, NULL);
    m.y[0] = 0;
    motion_run(&m, "verlet", 0.01, 1, AD_E_NONFINITE);
    assert_mentions(m.error.message, "step 1");
    assert_mentions(m.error.message, "x");
    assert_true(m.info.t == 0);
    motion_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_samples_of_fixed_steps),
        cmocka_unit_test(test_dense_output),
        cmocka_unit_test(test_first_step),
        cmocka_unit_test(test_first_step_by_its_rates),
        cmocka_unit_test(test_forces_of_a_step),
        cmocka_unit_test(test_thin_rates),
        cmocka_unit_test(test_given_times),
        cmocka_unit_test(test_interruption),
        cmocka_unit_test(test_backwards),
        cmocka_unit_test(test_tolerance),
        cmocka_unit_test(test_users_field_that_ends),
        cmocka_unit_test(test_the_worst_component_is_named),
        cmocka_unit_test(test_floor_and_most_steps),
        cmocka_unit_test(test_not_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
