/* Vector fields of every kind: stiff ones, Hamiltonians, those without halves; what integrators
   accept and refuse. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "motion.h"
#include "systems.h"

#include <string.h>

static void test_refusals(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "dblpend", false, NULL);
    assert_null(m.ode.kick);
    motion_run(&m, "verlet", 0.01, 1, AD_E_ARGUMENT);
    assert_mentions(m.error.message, "dblpend");
    assert_mentions(m.error.message, "implicit-midpoint");
    motion_run(&m, "gauss2", 0, 1, AD_E_ARGUMENT);
    motion_run(&m, "dop853", 0, 1, AD_E_ARGUMENT);
    motion_run(&m, "dop853", (double)NAN, 1, AD_E_ARGUMENT);
    motion_run(&m, "gauss2", 0.01, INFINITY, AD_E_ARGUMENT);
    motion_close(&m);
    motion_open(&m, "arenstorf", false, NULL); /* masses are constant, forces are not of q alone */
    assert_null(m.ode.kick);
    motion_close(&m);
    struct ad_error error = {0};
    assert_null(phys_integrator_find("dop835", &error));
    assert_mentions(error.message, "dop853");
}

/* A long step: iterating the stages does not contract, Newton's method finds them. The oscillator
   answers with the Cayley transform. */
static void test_long_implicit_steps(void **state)
{
    (void)state;
    struct motion m;
    double h = 10, c = (1 - h * h / 4) / (1 + h * h / 4), s = h / (1 + h * h / 4);
    motion_open(&m, "spring", false, NULL);
    motion_run(&m, "implicit-midpoint", h, h, AD_OK);
    assert_int_equal(m.info.steps, 1);
    assert_close(m.y[0], c, 0, 1e-14);
    assert_close(m.y[1], -s, 0, 1e-14);
    motion_run(&m, "gauss5", h, 100 * h, AD_OK);
    assert_close(m.y[0] * m.y[0] + m.y[1] * m.y[1], 1, 1e-12, 0);
    motion_close(&m);
}

static enum ad_status grow(void *context, double t, const double *y, double *rate,
                           struct ad_error *error)
{
    (void)context, (void)t, (void)error;
    rate[0] = y[0] * y[0];
    return AD_OK;
}

/* y' = y^2 from 1: the midpoint Y = 1 + h Y^2/2 is (1 - sqrt(1 - 2 h))/h, up to h = 1/2. */
static void test_implicit_steps_to_their_limit(void **state)
{
    (void)state;
    static const double steps[] = {0.1, 0.4, 0.49, 0.4999, 0.501, 0.6};
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        struct motion m = {.ode = {.n = 1, .field = grow}, .y = {1}};
        double h = steps[k], Y = (1 - sqrt(1 - 2 * h)) / h;
        motion_run(&m, "implicit-midpoint", h, h, h < 0.5 ? AD_OK : AD_E_ACCURACY);
        if (h < 0.5)
            assert_close(m.y[0], 2 * Y - 1, 1e-14 / (1 - 2 * h), 0);
        else
            assert_mentions(m.error.message, "smaller step");
    }
}

/* From q = 0, p = 2k with k = 0.9: q(t) = 2 asin(k sn(t, k)), p = 2 k cn(t, k). */
static void pendulum_at(double t, double *y)
{
    struct motion m;
    motion_open(&m, "pendulum", false, unit_pendulum);
    motion_run(&m, "dop853", 2.3e-14, t, AD_OK);
    memcpy(y, m.y, 2 * sizeof *y);
    motion_close(&m);
}

static ad_var pendulum_hamiltonian(ad_var q, ad_var p, ad_var t, const void *params)
{
    const double *g = params;
    (void)t;
    return ad_add(ad_mul(0.5, ad_square(p)), ad_mul(*g, ad_sub(1.0, ad_cos(q))));
}

/* Does not separate: (q^2 + 1)(p^2 + 1)/2, whose motion is known to conserve itself alone. */
static ad_var product_hamiltonian(ad_var q, ad_var p, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_mul(ad_add(ad_square(q), 1.0), ad_add(ad_square(p), 1.0)));
}

static void test_hamiltonian(void **state)
{
    (void)state;
    struct motion m = {0};
    double exact[2], g = 1, start[] = {0, 1.8};
    pendulum_at(5, exact);
    assert_int_equal(phys_ode_hamiltonian(pendulum_hamiltonian, 1, &g, &m.ode, &m.error), AD_OK);
    assert_true(m.ode.kick && m.ode.drift && m.ode.canonical);
    memcpy(m.y, start, sizeof start);
    m.settings.watch_energy = true;
    motion_run(&m, "yoshida6", 0.005, 5, AD_OK);
    assert_close(m.y[0], exact[0], 0, 1e-11);
    assert_close(m.info.energy_start, 1.62, 1e-15, 0);
    phys_ode_free(&m.ode);

    assert_int_equal(phys_ode_hamiltonian(product_hamiltonian, 1, NULL, &m.ode, &m.error), AD_OK);
    assert_null(m.ode.kick);
    memcpy(m.y, (double[]){0.3, -0.7}, sizeof start);
    motion_run(&m, "gauss4", 0.05, 50, AD_OK);
    assert_true(m.info.energy_drift < 1e-9);
    motion_run(&m, "verlet", 0.05, 50, AD_E_ARGUMENT);
    phys_ode_free(&m.ode);
}

/* With another velocity; with another force. */
static ad_var twice_as_heavy(ad_var q, ad_var p, ad_var t, const void *params)
{
    return product_hamiltonian(q, ad_mul(2.0, p), t, params);
}
static ad_var pushed(ad_var q, ad_var p, ad_var t, const void *params)
{
    return ad_add(product_hamiltonian(q, p, t, params), q);
}

/* Its L, v = (q^2 + 1) p. */
static ad_var product_lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var m = ad_add(ad_square(q), 1.0);
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_div(ad_square(v), m), m));
}

static enum ad_status product_start(const void *params, uint64_t seed, double *q, double *v,
                                    struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.3;
    v[0] = -0.7;
    return AD_OK;
}

/* Of a scene with H motions and references are the same as by L, in (q, v) where they are read; an
   H of something else is refused, whether its velocity or its force differs. */
static void test_scene_with_hamiltonian(void **state)
{
    (void)state;
    enum { N = 4 };
    static const double times[N] = {0, 0.5, 1.2, 2};
    struct phys_scene scene = scene_of("product", 1, product_lagrangian, 11, 0.1, product_start);
    struct phys_system system;
    struct phys_reference by_L, by_H;
    struct ad_error error = {0};
    double q = 0.3, v = -0.7, y[2];
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_reference(&system, &q, &v, N, times, 0.1, NULL, NULL, &by_L, &error),
                     AD_OK);
    scene.hamiltonian = product_hamiltonian;
    assert_int_equal(phys_reference(&system, &q, &v, N, times, 0.1, NULL, NULL, &by_H, &error),
                     AD_OK);
    const char *const methods[] = {"dop853", "gauss4", "taylor"};
    for (size_t k = 0; k < LENGTH(methods); k++) {
        const struct phys_integrator *method = phys_integrator_find(methods[k], &error);
        struct motion m = {0};
        assert_int_equal(phys_ode_for(&system, method, &m.ode, &error), AD_OK);
        assert_int_equal(m.ode.canonical, k < 2);
        assert_int_equal(phys_ode_enter(&m.ode, 0, &q, &v, m.y, &error), AD_OK);
        motion_run(&m, methods[k], k == 1 ? 0.01 : 1e-14, times[N - 1], AD_OK);
        assert_int_equal(phys_ode_leave(&m.ode, times[N - 1], m.y, y, y + 1, &error), AD_OK);
        for (size_t i = 0; i < 2; i++)
            assert_close(y[i], by_L.x[2 * (N - 1) + i], 1e-11, 1e-11);
        phys_ode_free(&m.ode);
    }
    for (size_t i = 0; i < 2 * N; i++)
        assert_close(by_H.x[i], by_L.x[i], 1e-13, 1e-13);
    for (size_t k = 0; k < 2; k++) {
        struct phys_ode ode;
        error = (struct ad_error){0};
        scene.hamiltonian = k ? pushed : twice_as_heavy;
        assert_int_equal(phys_ode_canonical(&system, &ode, &error), AD_OK);
        assert_int_equal(phys_ode_enter(&ode, 0, &q, &v, y, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, k ? "force" : "velocity");
        phys_ode_free(&ode);
    }
    phys_reference_free(&by_L);
    phys_reference_free(&by_H);
    phys_system_close(&system);
}

/* Every method on a Hamiltonian that does not separate, and on a field without halves: those that
   take it come near to the motion, the others refuse it and say what does. At y = 2 Euler's method
   errs by 4 log(2) h on y' = y^2 and the midpoint rule by h^2, to leading order. */
static void test_what_methods_take(void **state)
{
    (void)state;
    struct motion exact = {0};
    phys_ode_hamiltonian(product_hamiltonian, 1, NULL, &exact.ode, &exact.error);
    memcpy(exact.y, (double[]){0.3, -0.7}, 2 * sizeof(double));
    motion_run(&exact, "dop853", 1e-14, 1, AD_OK);
    phys_ode_free(&exact.ode);
    for (size_t k = 0; phys_integrators[k]; k++) {
        const struct phys_integrator *method = phys_integrators[k];
        bool refused =
            method->separable || method->lagrangian || strcmp(method->name, "taylor") == 0;
        double h = method->adaptive ? 1e-10 : 0.002;
        struct motion m = {.y = {0.3, -0.7}}, grown = {.ode = {.n = 1, .field = grow}, .y = {1}};
        phys_ode_hamiltonian(product_hamiltonian, 1, NULL, &m.ode, &m.error);
        motion_run(&m, method->name, h, 1, refused ? AD_E_ARGUMENT : AD_OK);
        if (refused)
            assert_mentions(m.error.message, "dop853");
        else
            assert_close(m.y[0], exact.y[0], 0, method->order > 1 ? 1e-6 : 4e-3);
        phys_ode_free(&m.ode);

        refused |= strcmp(method->name, "semi-implicit") == 0;
        motion_run(&grown, method->name, h, 0.5, refused ? AD_E_ARGUMENT : AD_OK);
        if (refused)
            assert_mentions(grown.error.message, "dop853");
        else
            assert_close(grown.y[0], 2, 0,
                         1.01 * (method->order > 1 ? 0.002 * 0.002 : 4 * log(2) * 0.002));
    }
}

static void is_called(const struct phys_ode *ode, size_t k, const char *expected)
{
    char name[64];
    phys_ode_component(ode, k, name, sizeof name);
    assert_string_equal(name, expected);
}

/* As errors name them. */
static void test_names_of_components(void **state)
{
    struct phys_system kepler = system_opened("kepler");
    struct phys_ode ode;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_ode_canonical(&kepler, &ode, &error), AD_OK);
    is_called(&ode, 1, "y");
    is_called(&ode, 2, "the momentum of x");
    phys_ode_free(&ode);
    assert_int_equal(phys_ode_hamiltonian(product_hamiltonian, 1, NULL, &ode, &error), AD_OK);
    is_called(&ode, 0, "q1");
    is_called(&ode, 1, "p1");
    phys_ode_free(&ode);
    phys_system_close(&kepler);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_long_implicit_steps),
        cmocka_unit_test(test_implicit_steps_to_their_limit),
        cmocka_unit_test(test_hamiltonian),
        cmocka_unit_test(test_scene_with_hamiltonian),
        cmocka_unit_test(test_what_methods_take),
        cmocka_unit_test(test_names_of_components),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
