/* Every integrator: its order on the nonlinear pendulum, the symplectic form, reversal, and what it
   conserves. */
#include "tests/close.h"
#include "motion.h"
#include "physics/integrators/stepper.h"

#include <float.h>
#include <string.h>

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

/* The number of steps from which on errors follow their power law, that of half as many more being
   above rounding. */
static size_t steps_for(const struct phys_integrator *fixed)
{
    const double p = (double)fixed->order, small = fmax(pow(10, -2 * p), 5e-11);
    size_t n = 8;
    for (double error; (error = ring_error(fixed, n)) > small;)
        n = 1 + (size_t)((double)n * fmin(pow(error / small, 1 / p), 16));
    return n;
}

static void test_order(void **state)
{
    (void)state;
    size_t n_methods = 0;
    while (phys_integrators[n_methods])
        n_methods++;
    for (size_t k = 0; k <= n_methods; k++) { /* and the one that makes references */
        struct phys_integrator fixed = *(k < n_methods ? phys_integrators[k] : &phys_extrapolation);
        fixed.adaptive = false;
        if (fixed.order == 0 || fixed.dominated) /* test_taylor, test_wisdom_holman */
            continue;
        size_t n = steps_for(&fixed), N = n + n / 2;
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
        if (fixed.dominated)
            continue;
        double error = form_error("pendulum", fixed.lagrangian, unit_pendulum, &fixed, 0.2, 2);
        print_message("%-18s %.1e\n", fixed.name, error);
        if (fixed.symplectic)
            assert_true(error < 1e-9);
        else if (fixed.order && fixed.order < 8) /* at order 8 the step is too short to tell */
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

/* What rounding does to the way there and back. A variational method takes its momenta from
   velocities that are differences of rounded nodes, v_j = sum_k v_jk X_k / h: an element's momentum
   is off by up to eps/2 |q| sum_j w_j |v_js| sum_k |v_jk| / h, at random from element to element,
   and the distance grows with the time. Other methods never divide by h. */
static double rounding_of(const struct phys_integrator *method, double size, double dt, double t)
{
    const struct phys_rule *rule = method->lagrangian ? method->coefficients : NULL;
    struct phys_rule_table table;
    double amplified = 0, steps = 2 * t / dt;
    if (!rule)
        return 1e-12;
    rule->fill(rule, &table);
    for (size_t j = 0; j < table.points; j++) {
        double sum = 0;
        for (size_t k = 0; k <= table.degree; k++)
            sum += fabs(table.v[j][k]);
        amplified += table.weight[j] * fabs(table.v[j][table.degree]) * sum;
    }
    return 0.5 * DBL_EPSILON * size * amplified / dt * sqrt(steps) * t;
}

static void test_reversal(void **state)
{
    (void)state;
    for (size_t k = 0; phys_integrators[k]; k++) {
        const struct phys_integrator *method = phys_integrators[k];
        if (method->adaptive || method->dominated)
            continue;
        double error = return_error("pendulum", method->lagrangian, unit_pendulum, method, 0.1, 10);
        double allowed = rounding_of(method, 2.24 /* 2 asin(rate0 / 2) */, 0.1, 10);
        print_message("%-21s back to %.1e, rounding %.1e\n", method->name, error, allowed);
        if (method->symmetric)
            assert_true(error < allowed);
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
        if (method->dominated)
            continue;
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

/* E11: stages that begin from the last step's polynomial take fewer iterations than those that
   begin from the rate, as in runs of one step each. */
static void test_stages_are_carried_on(void **state)
{
    enum { STEPS = 50 };
    const double dt = 0.05;
    struct motion m;
    size_t alone = 0;
    (void)state;
    motion_open(&m, "pendulum", false, unit_pendulum);
    double start[] = {m.y[0], m.y[1]};
    for (size_t k = 0; k < STEPS; k++) {
        motion_run(&m, "gauss4", dt, dt, AD_OK);
        alone += m.info.evaluations;
    }
    double end[] = {m.y[0], m.y[1]};
    memcpy(m.y, start, sizeof start);
    motion_run(&m, "gauss4", dt, STEPS * dt, AD_OK);
    print_message("%zu evaluations, %zu in runs of one step\n", m.info.evaluations, alone);
    assert_close(m.y[0], end[0], 0, 1e-13);
    assert_close(m.y[1], end[1], 0, 1e-13);
    assert_true(7 * m.info.evaluations < 6 * alone);
    motion_close(&m);
}

/* Units change neither results nor work: a stiff pendulum whose coordinates are `unit` times as
   large, in steps so long that implicit stages need Newton's method. */
static enum ad_status pendulum_in(void *context, double t, const double *y, double *rate,
                                  struct ad_error *error)
{
    const double unit = *(const double *)context;
    (void)t, (void)error;
    rate[0] = y[1];
    rate[1] = -9 * unit * sin(y[0] / unit);
    return AD_OK;
}

static void test_units(void **state)
{
    (void)state;
    static const char *const methods[] = {"implicit-midpoint", "gauss2", "gauss3", "gauss4",
                                          "gauss5"};
    static const double units[] = {1, 0x1p-30, 0x1p40};
    for (size_t k = 0; k < LENGTH(methods); k++) {
        double end = 0;
        size_t work = 0;
        for (size_t i = 0; i < LENGTH(units); i++) {
            double unit = units[i], y[2] = {1.1 * unit, 0.3 * unit};
            struct phys_ode ode = {.n = 2, .field = pendulum_in, .context = &unit};
            struct phys_simulation_info info;
            struct ad_error error = {0};
            struct phys_simulation s = {.size = sizeof s,
                                        .integrator = phys_integrator_find(methods[k], &error),
                                        .t1 = 9,
                                        .dt = 0.6};
            if (phys_simulate(&s, &ode, y, &info, &error) != AD_OK)
                fail_msg("%s, unit %g: %s", methods[k], unit, error.message);
            if (i == 0)
                end = y[0], work = info.evaluations;
            assert_true(y[0] / unit == end && info.evaluations == work); /* powers of 2 */
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_units),
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_symplectic),
        cmocka_unit_test(test_symplectic_double_pendulum),
        cmocka_unit_test(test_reversal),
        cmocka_unit_test(test_momenta),
        cmocka_unit_test(test_stages_are_carried_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
