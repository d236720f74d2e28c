/* Adaptive methods in units of any size: the same relative error, but for the first steps. */
#include "motion.h"
#include "systems.h"
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

/* Two coupled pendulums, one of them in a unit of its own. */
static double unit;
static size_t other;

static ad_var two_units(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    (void)params;
    ad_var x = ad_row(q, 1 - other), y = ad_mul(1 / unit, ad_row(q, other));
    ad_var squares =
        ad_add(ad_square(ad_row(v, 1 - other)), ad_square(ad_mul(1 / unit, ad_row(v, other))));
    ad_var potential =
        ad_sub(ad_mul(0.1, ad_mul(x, y)), ad_add(ad_cos(x), ad_mul(2, ad_cos(ad_mul(3, y)))));
    return ad_sub(ad_mul(0.5, squares), potential);
}

static enum ad_status two_starts(const void *params, uint64_t seed, double *q, double *v,
                                 struct ad_error *error)
{
    (void)params;
    (void)seed;
    (void)error;
    q[1 - other] = 1;
    q[other] = 0.9 * unit;
    v[0] = v[1] = 0;
    return AD_OK;
}

/* A coordinate of 1e-9 beside one of 1 had all of its digits wrong, and no error was seen. */
static void test_coordinates_of_different_units(void **state)
{
    (void)state;
    static const double units[] = {1, 1e-6, 1e-12};
    const struct phys_scene scene = scene_of("two", 2, two_units, 41, 0.5, two_starts);
    for (other = 0; other < 2; other++) {
        double end[LENGTH(units)];
        for (size_t k = 0; k < LENGTH(units); k++) {
            struct phys_system system;
            struct phys_motion_solution m;
            struct ad_error error = {0};
            unit = units[k];
            assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
            const struct phys_motion_settings how = {.size = sizeof how, .time = 20, .error = 1e-8};
            if (phys_motion_solve(&system, &how, &m, &error) != AD_OK)
                fail_msg("unit %g: %s", unit, error.message);
            assert_true(m.error <= 1e-8);
            end[k] = m.x[4 * (m.n - 1) + other] / unit;
            assert_close(end[k], end[0], 3e-8, 0);
            phys_motion_solution_free(&m);
            /* where no digit of it is right that is seen */
            const struct phys_motion_settings fixed = {.size = sizeof fixed,
                                                       .time = 20,
                                                       .integrator =
                                                           phys_integrator_find("verlet", &error),
                                                       .dt = 0.2};
            assert_int_equal(phys_motion_solve(&system, &fixed, &m, &error), AD_OK);
            assert_true(!(m.error < 0.1));
            phys_motion_solution_free(&m);
            phys_system_close(&system);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_units_of_an_ode),
        cmocka_unit_test(test_from_zero),
        cmocka_unit_test(test_own_scale),
        cmocka_unit_test(test_units_of_a_scene),
        cmocka_unit_test(test_coordinates_of_different_units),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
