/* Every integrator: its order on the nonlinear pendulum, the symplectic form, reversal, what it
   conserves, and what it refuses. */
#include "../close.h"
#include "motion.h"

#include <string.h>

static const struct phys_setting unit_pendulum[] = {
    {"l", 1}, {"theta0", 0}, {"rate0", 1.8}, {NULL, 0}};

/* From q = 0, p = 2k with k = 0.9: q(t) = 2 asin(k sn(t, k)), p = 2 k cn(t, k). */
static void pendulum_at(double t, double *y)
{
    struct motion m;
    motion_open(&m, "pendulum", false, unit_pendulum);
    motion_run(&m, "dop853", 2.3e-14, t, AD_OK);
    memcpy(y, m.y, 2 * sizeof *y);
    motion_close(&m);
}

enum { STARTS = 32 };

/* Root mean square of the errors at t = 4 over starts on a ring around rest: at one place alone,
   the leading term of a high order vanishes by chance. */
static double ring_error(const struct phys_integrator *integrator, size_t steps)
{
    struct motion m;
    double sum = 0, t = 4, exact[2];
    motion_open(&m, "pendulum", integrator->lagrangian, unit_pendulum);
    for (size_t k = 0; k < STARTS; k++) {
        double angle = 2 * M_PI * (double)k / STARTS;
        double start[] = {1.2 * cos(angle), 1.1 * sin(angle)};
        memcpy(m.y, start, sizeof start);
        motion_run(&m, "gauss4", 0.04, t, AD_OK);
        memcpy(exact, m.y, sizeof exact);
        memcpy(m.y, start, sizeof start);
        motion_run_by(&m, integrator, t / (double)steps, t, AD_OK);
        sum += pow(m.y[0] - exact[0], 2) + pow(m.y[1] - exact[1], 2);
    }
    motion_close(&m);
    return sqrt(sum / STARTS);
}

/* Steps at which the error is far above rounding and in its power law. */
static const struct {
    size_t coarse, fine;
} steps_for[] = {[1] = {1000, 2000}, [2] = {100, 200}, [4] = {100, 200}, [5] = {150, 300},
                 [6] = {30, 60},     [8] = {10, 16},   [10] = {8, 12}};

static void test_order(void **state)
{
    (void)state;
    for (size_t k = 0; phys_integrators[k]; k++) {
        struct phys_integrator fixed = *phys_integrators[k];
        fixed.adaptive = false;
        size_t n = steps_for[fixed.order].coarse, N = steps_for[fixed.order].fine;
        double coarse = ring_error(&fixed, n), fine = ring_error(&fixed, N);
        double order = log(coarse / fine) / log((double)N / (double)n);
        print_message("%-18s order %.3f of %zu (errors %.1e, %.1e)\n", fixed.name, order,
                      fixed.order, coarse, fine);
        assert_close(order, (double)fixed.order, 0, 0.15);
    }
}

/* Largest entry of J^T Omega J - Omega, where J is the Jacobian of the motion by central
   differences of fourth order. */
static double form_error(const char *scene, bool canonical, const struct phys_setting *set,
                         const struct phys_integrator *integrator, double dt, double t)
{
    enum { N = 2 * MOTION_DOF };
    static const double at[] = {-2, -1, 1, 2}, weight[] = {1.0 / 12, -2.0 / 3, 2.0 / 3, -1.0 / 12};
    double J[N][N] = {{0}}, worst = 0, h = 1e-3;
    struct motion m;
    motion_open(&m, scene, canonical, set);
    size_t n = m.ode.n, half = n / 2;
    double start[N];
    memcpy(start, m.y, sizeof start);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < 4; i++) {
            memcpy(m.y, start, sizeof start);
            m.y[j] += at[i] * h;
            motion_run_by(&m, integrator, dt, t, AD_OK);
            for (size_t k = 0; k < n; k++)
                J[k][j] += weight[i] * m.y[k] / h;
        }
    motion_close(&m);
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) {
            double sum = a + half == b ? -1 : b + half == a ? 1 : 0;
            for (size_t k = 0; k < half; k++)
                sum += J[k][a] * J[half + k][b] - J[half + k][a] * J[k][b];
            worst = fmax(worst, fabs(sum));
        }
    return worst;
}

static void test_symplectic(void **state)
{
    (void)state;
    for (size_t k = 0; phys_integrators[k]; k++) {
        struct phys_integrator fixed = *phys_integrators[k];
        fixed.adaptive = false;
        double error = form_error("pendulum", fixed.lagrangian, unit_pendulum, &fixed, 0.2, 2);
        print_message("%-18s %.1e\n", fixed.name, error);
        if (fixed.symplectic)
            assert_true(error < 1e-9);
        else if (fixed.order < 8) /* at order 8 the step is too short to tell */
            assert_true(error > 1e-7);
    }
}

/* The double pendulum does not separate: its form is that of (q, p), and only implicit methods
   preserve it. */
static void test_symplectic_double_pendulum(void **state)
{
    (void)state;
    size_t tried = 0;
    for (size_t k = 0; phys_integrators[k]; k++) {
        const struct phys_integrator *method = phys_integrators[k];
        if (method->separable || method->adaptive || method->order < 2)
            continue;
        double error = form_error("dblpend", true, NULL, method, 0.05, 1);
        print_message("%-18s %.1e\n", method->name, error);
        assert_true(method->symplectic ? error < 1e-8 : error > 1e-7);
        tried++;
    }
    assert_true(tried >= 6);
    /* (q, v) are not conjugate: the form of (q, p) is not what Gauss's method preserves there */
    struct ad_error error = {0};
    const struct phys_integrator *gauss = phys_integrator_find("gauss2", &error);
    assert_true(form_error("dblpend", false, NULL, gauss, 0.05, 1) > 1e-3);
}

/* Back to the start: the distance after t and back. */
static double return_error(const char *scene, bool canonical, const struct phys_setting *set,
                           const struct phys_integrator *method, double dt, double t)
{
    struct motion m;
    double start[2 * MOTION_DOF], most = 0;
    motion_open(&m, scene, canonical, set);
    memcpy(start, m.y, sizeof start);
    motion_run_by(&m, method, dt, t, AD_OK);
    m.settings.t0 = t;
    motion_run_by(&m, method, dt, 0, AD_OK);
    for (size_t k = 0; k < m.ode.n; k++)
        most = fmax(most, fabs(m.y[k] - start[k]));
    motion_close(&m);
    return most;
}

static void test_reversal(void **state)
{
    (void)state;
    for (size_t k = 0; phys_integrators[k]; k++) {
        const struct phys_integrator *method = phys_integrators[k];
        if (method->adaptive)
            continue;
        double error = return_error("pendulum", method->lagrangian, unit_pendulum, method, 0.1, 10);
        if (method->symmetric)
            assert_true(error < 1e-12);
        else
            assert_true(error > 1e-7);
        if (method->symmetric && !method->separable)
            assert_true(return_error("dblpend", true, NULL, method, 0.02, 2) < 1e-11);
    }
}

static void totals(struct motion *m, struct phys_totals *totals)
{
    double q[MOTION_DOF], v[MOTION_DOF];
    phys_legendre *legendre;
    assert_int_equal(phys_legendre_new(&m->system, &legendre, &m->error), AD_OK);
    assert_int_equal(phys_ode_leave(&m->ode, 0, m->y, q, v, &m->error), AD_OK);
    phys_totals(legendre, q, v, 0, totals);
    phys_legendre_free(legendre);
}

/* Linear momentum is linear: all methods keep it. Angular momentum is bilinear in q and p: the
   symplectic ones here keep it, and explicit Runge-Kutta methods do not. */
static void test_momenta(void **state)
{
    (void)state;
    struct phys_totals before, after;
    for (size_t k = 0; phys_integrators[k]; k++) {
        const struct phys_integrator *method = phys_integrators[k];
        struct motion m;
        motion_open(&m, "pythagorean", method->lagrangian, NULL);
        m.y[6] = 0.3, m.y[9] = -0.2, m.y[11] = 0.1; /* momenta that are not zero */
        totals(&m, &before);
        motion_run_by(&m, method, method->adaptive ? 1e-6 : 0.01, 1, AD_OK);
        totals(&m, &after);
        /* velocities that are differences of positions carry their rounding over dt */
        double rounding = method->lagrangian ? 3e-11 : 1e-13;
        for (size_t axis = 0; axis < 2; axis++)
            assert_close(after.momentum[axis], before.momentum[axis], 0, rounding);
        assert_close(after.centre[0] - before.centre[0], before.momentum[0] / before.mass, 0,
                     rounding);
        double change = fabs(after.angular[2] / before.angular[2] - 1);
        print_message("%-18s angular momentum changes by %.1e\n", method->name, change);
        assert_true(method->symplectic ? change < rounding : change > 5e-11);
        motion_close(&m);
    }
}

/* ---- variational integrators ---- */

/* Largest difference of the coordinates after t by two methods, both in (q, p). */
static double difference(const char *scene, const char *one, const char *other, double dt, double t)
{
    struct motion a, b;
    double most = 0;
    motion_open(&a, scene, true, NULL);
    motion_open(&b, scene, true, NULL);
    motion_run(&a, one, dt, t, AD_OK);
    motion_run(&b, other, dt, t, AD_OK);
    for (size_t k = 0; k < a.ode.n; k++)
        most = fmax(most, fabs(a.y[k] - b.y[k]));
    motion_close(&a);
    motion_close(&b);
    return most;
}

/* For any Lagrangian, the rules on Gauss's points are Gauss's methods for its Hamiltonian. */
static void test_variational_gauss(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"variational-midpoint", "implicit-midpoint"},
                                           {"variational-gauss2", "gauss2"},
                                           {"variational-gauss4", "gauss4"}};
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        assert_true(difference("kepler", pairs[k][0], pairs[k][1], 0.02, 3) < 1e-11);
        assert_true(difference("dblpend", pairs[k][0], pairs[k][1], 0.02, 3) < 1e-11);
        assert_true(difference("arenstorf", pairs[k][0], pairs[k][1], 1e-3, 0.1) < 1e-10);
    }
    assert_true(difference("dblpend", "variational-trapezoid", "implicit-midpoint", 0.02, 3) >
                1e-7);
}

/* The positions of rule left are the published path, marched from the same first two slices. */
static void test_variational_left(void **state)
{
    enum { SLICES = 50 };
    (void)state;
    struct motion m;
    double path[2 * SLICES], dt = 0.05;
    phys_motion *motion;
    motion_open(&m, "kepler", true, NULL);
    assert_int_equal(phys_motion_new(&m.system, &motion, &m.error), AD_OK);
    for (size_t i = 0; i < SLICES; i++) {
        path[i] = m.y[0];
        path[SLICES + i] = m.y[1];
        m.settings.t0 = (double)i * dt;
        motion_run(&m, "variational-left", dt, (double)(i + 1) * dt, AD_OK);
    }
    double marched[2 * SLICES];
    memcpy(marched, path, sizeof path);
    assert_int_equal(phys_ode_path(motion, SLICES, dt, 1, marched, &m.error), AD_OK);
    for (size_t k = 0; k < 2 * SLICES; k++)
        assert_close(path[k], marched[k], 0, 1e-11);
    phys_motion_free(motion);
    motion_close(&m);
}

static void test_refusals(void **state)
{
    (void)state;
    struct motion m;
    motion_open(&m, "dblpend", false, NULL);
    assert_null(m.ode.kick);
    motion_run(&m, "verlet", 0.01, 1, AD_E_ARGUMENT);
    assert_non_null(strstr(m.error.message, "dblpend"));
    assert_non_null(strstr(m.error.message, "implicit-midpoint"));
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
    assert_non_null(strstr(error.message, "dop853"));
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
            assert_non_null(strstr(m.error.message, "take a smaller step than"));
    }
}

/* ---- Hamiltonians ---- */

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
        bool refused = method->separable || method->lagrangian;
        double h = method->adaptive ? 1e-10 : 0.002;
        struct motion m = {.y = {0.3, -0.7}}, grown = {.ode = {.n = 1, .field = grow}, .y = {1}};
        phys_ode_hamiltonian(product_hamiltonian, 1, NULL, &m.ode, &m.error);
        motion_run(&m, method->name, h, 1, refused ? AD_E_ARGUMENT : AD_OK);
        if (refused)
            assert_non_null(strstr(m.error.message, "take gauss2, implicit-midpoint or dop853"));
        else
            assert_close(m.y[0], exact.y[0], 0, method->order > 1 ? 1e-6 : 4e-3);
        phys_ode_free(&m.ode);

        refused |= strcmp(method->name, "semi-implicit") == 0;
        motion_run(&grown, method->name, h, 0.5, refused ? AD_E_ARGUMENT : AD_OK);
        if (refused)
            assert_non_null(
                strstr(grown.error.message, "take gauss2, implicit-midpoint or dop853"));
        else
            assert_close(grown.y[0], 2, 0,
                         1.01 * (method->order > 1 ? 0.002 * 0.002 : 4 * log(2) * 0.002));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_symplectic),
        cmocka_unit_test(test_symplectic_double_pendulum),
        cmocka_unit_test(test_reversal),
        cmocka_unit_test(test_momenta),
        cmocka_unit_test(test_variational_gauss),
        cmocka_unit_test(test_variational_left),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_long_implicit_steps),
        cmocka_unit_test(test_implicit_steps_to_their_limit),
        cmocka_unit_test(test_hamiltonian),
        cmocka_unit_test(test_what_methods_take),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
