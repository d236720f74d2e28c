/* Adaptive methods in units of any size: the same relative error, but for the first steps. */
#include "motion.h"
#include "tests/close.h"

#include <math.h>

/* An orbit of eccentricity 0.6 from its pericentre, and an amount that decays and one that it
   feeds, in units of length, of time and of amounts. */
struct units {
    double length, time, amount;
};

enum { N = 6 };

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const struct units *u = context;
    (void)t;
    (void)error;
    double x[] = {y[0] / u->length, y[1] / u->length}, r = hypot(x[0], x[1]);
    for (int k = 0; k < 2; k++) {
        rate[k] = y[2 + k];
        rate[2 + k] = -x[k] / (r * r * r) * u->length / u->time / u->time;
    }
    rate[4] = -y[4] / u->time;
    rate[5] = y[4] / u->time;
    return AD_OK;
}

/* After a half turn at the apocentre; largest relative error. */
static double miss(const struct units *u, const char *method, double rtol, double atol,
                   size_t *steps)
{
    struct ad_error error = {0};
    const struct phys_ode ode = {.name = "orbit", .n = N, .field = field, .context = (void *)u};
    struct phys_simulation s = {.size = sizeof s,
                                .integrator = phys_integrator_find(method, &error),
                                .t1 = acos(-1) * u->time,
                                .rtol = rtol,
                                .atol = atol,
                                .max_steps = 100000};
    struct phys_simulation_info info;
    const double speed = u->length / u->time, left = exp(-acos(-1));
    double y[N] = {0.4 * u->length, 0, 0, 2 * speed, u->amount, 0};
    if (phys_simulate(&s, &ode, y, &info, &error) != AD_OK)
        fail_msg("%s, units of %g, %g, %g: %s", method, u->length, u->time, u->amount,
                 error.message);
    *steps = info.steps;
    const double e[] = {(y[0] / u->length + 1.6) / 1.6,
                        y[1] / u->length / 1.6,
                        y[2] / speed / 0.5,
                        (y[3] / speed + 0.5) / 0.5,
                        y[4] / u->amount / left - 1,
                        y[5] / u->amount / (1 - left) - 1};
    double most = 0;
    for (int k = 0; k < N; k++)
        most = fmax(most, fabs(e[k]));
    return most;
}

static void test_units_of_an_ode(void **state)
{
    (void)state;
    static const struct units units[] = {{0x1p-30, 1, 1},       {0x1p30, 1, 1},
                                         {1, 0x1p-40, 1},       {1, 0x1p40, 1},
                                         {1, 1, 0x1p-90},       {0x1p30, 0x1p20, 0x1p-30},
                                         {0x1p-200, 1, 0x1p300}};
    static const double tolerances[][2] = {{1e-9, 1e-9}, {1e-9, 0}, {0, 1e-9}};
    const char *const methods[] = {"dop853", "dopri5"};
    for (size_t m = 0; m < LENGTH(methods); m++)
        for (size_t t = 0; t < LENGTH(tolerances); t++) {
            size_t steps, as_many;
            double rtol = tolerances[t][0], atol = tolerances[t][1],
                   one = miss(&(struct units){1, 1, 1}, methods[m], rtol, atol, &steps);
            assert_true(one > 0 && one < 1e-6);
            for (size_t k = 0; k < LENGTH(units); k++) {
                double e = miss(&units[k], methods[m], rtol, atol, &as_many);
                if (!is_close(log(e), log(one), 0, log(3)) || as_many > steps + 20)
                    fail_msg("%s, units %zu: %zu steps, error %g; in units of 1 %zu, %g",
                             methods[m], k, as_many, e, steps, one);
            }
        }
}

/* Nothing but zeros at the start: sizes come from the rates, then from the motion. */
static enum ad_status from_zero(void *context, double t, const double *y, double *rate,
                                struct ad_error *error)
{
    (void)context;
    (void)error;
    rate[0] = 1e-9 * cos(t);
    rate[1] = y[0];
    return AD_OK;
}

static void test_from_zero(void **state)
{
    (void)state;
    struct ad_error error = {0};
    const struct phys_ode ode = {.n = 2, .field = from_zero};
    struct phys_simulation s = {.size = sizeof s,
                                .integrator = phys_integrator_find("dop853", &error),
                                .t1 = 2,
                                .rtol = 1e-10,
                                .atol = 1e-10};
    struct phys_simulation_info info;
    double y[2] = {0};
    assert_int_equal(phys_simulate(&s, &ode, y, &info, &error), AD_OK);
    assert_close(y[0], 1e-9 * sin(2), 1e-9, 0);
    assert_close(y[1], 1e-9 * (1 - cos(2)), 1e-9, 0);
}

/* A scale of one's own stands: errors of 1 allowed are errors of 1. */
static void test_own_scale(void **state)
{
    (void)state;
    struct ad_error error = {0};
    const struct phys_ode ode = {.n = 2, .field = from_zero};
    const double ones[] = {1, 1};
    struct phys_simulation s = {.size = sizeof s,
                                .integrator = phys_integrator_find("dopri5", &error),
                                .t1 = 200,
                                .rtol = 1e-10,
                                .atol = 1,
                                .scale = ones};
    struct phys_simulation_info info;
    double y[2] = {0};
    assert_int_equal(phys_simulate(&s, &ode, y, &info, &error), AD_OK);
    assert_true(info.steps < 20);
}

/* Events inside a step are followed by a run of their own: a spring of tiny amplitude. */
static bool count(void *context, size_t which, double t, const double *y)
{
    size_t *n = context;
    (void)which;
    (void)y;
    assert_close(t, acos(-1) * ((double)*n + 0.5), 1e-5, 0);
    ++*n;
    return true;
}

static void position(void *context, double t, const double *y, double *g)
{
    (void)context;
    (void)t;
    g[0] = y[0];
}

static void test_units_of_a_scene(void **state)
{
    (void)state;
    static const double sizes[] = {1e-30, 1e-9, 1, 1e9, 1e30};
    for (size_t k = 0; k < LENGTH(sizes); k++) {
        struct motion m;
        size_t n = 0;
        const struct phys_events events = {
            .n = 1, .values = position, .found = count, .context = &n};
        motion_open(&m, "spring", false, NULL);
        m.y[0] = sizes[k];
        m.y[1] = 0;
        m.settings.events = &events;
        m.settings.n_events = 1;
        motion_run(&m, "gauss5", 2.5, 20, AD_OK);
        assert_int_equal(n, 6);
        motion_close(&m);
        motion_open(&m, "spring", false, NULL);
        m.y[0] = sizes[k];
        m.y[1] = 0;
        motion_run(&m, "dop853", 1e-10, 20, AD_OK);
        assert_close(m.y[0] / sizes[k], cos(20), 0, 1e-8);
        motion_close(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_units_of_an_ode),
        cmocka_unit_test(test_from_zero),
        cmocka_unit_test(test_own_scale),
        cmocka_unit_test(test_units_of_a_scene),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
