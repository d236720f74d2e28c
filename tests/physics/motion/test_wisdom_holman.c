/* Wisdom and Holman's map: two bodies exactly, its orders in masses and step, energies over a long
   time, bodies in any order, and what it refuses. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <string.h>

enum { MOST = 3, DIMS = 2 };

/* Bodies of the scene; `told` times gm is what it declares. */
static struct {
    size_t bodies;
    double m[MOST], told, q[MOST * DIMS], v[MOST * DIMS];
} world;

static ad_var attraction(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    double half[MOST * DIMS], pairs[MOST];
    size_t n = 0;
    for (size_t k = 0; k < world.bodies * DIMS; k++)
        half[k] = 0.5 * world.m[k / DIMS];
    for (size_t i = 0; i < world.bodies; i++)
        for (size_t j = i + 1; j < world.bodies; j++)
            pairs[n++] = world.m[i] * world.m[j];
    ad_var r = ad_sqrt(phys_pair_squares(q, world.bodies, DIMS, 0));
    ad_var T = ad_sum_rows(ad_mul(ad_const(q.tape, world.bodies * DIMS, 1, half), ad_square(v)));
    return ad_add(T, ad_sum_rows(ad_div(ad_const(q.tape, n, 1, pairs), r)));
}

static void gm(const void *params, double values[])
{
    (void)params;
    for (size_t k = 0; k < world.bodies; k++)
        values[k] = world.m[k] * (k > 0 ? world.told : 1);
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    memcpy(q, world.q, world.bodies * DIMS * sizeof *q);
    memcpy(v, world.v, world.bodies * DIMS * sizeof *v);
    return AD_OK;
}

/* The star, and a planet of mass m at pericentre 1 - e (e > 1: e - 1) on the x axis. */
static void place(size_t k, double m, double pericentre, double e)
{
    world.m[k] = m;
    world.q[k * DIMS] = pericentre;
    world.v[k * DIMS + 1] = sqrt((world.m[0] + m) * (1 + e) / pericentre);
}

static void begin(double m)
{
    memset(&world, 0, sizeof world);
    world.bodies = 2;
    world.told = world.m[0] = 1;
    place(1, m, 1, 0);
}

/* Two bodies in the frame of their centre of mass, which has no digits to lose. */
static void rest(void)
{
    const double share = world.m[1] / (world.m[0] + world.m[1]), x = world.q[DIMS],
                 v = world.v[DIMS + 1];
    world.q[0] = -share * x;
    world.q[DIMS] = x + world.q[0];
    world.v[1] = -share * v;
    world.v[DIMS + 1] = v + world.v[1];
}

static struct watched {
    size_t every;
    bool (*sample)(void *context, double t, const double *y);
    bool (*proceed)(void *context);
    void *context;
} watched; /* by the next run */

/* From the world's start to t, in y; the greatest change of the energy, in units of it. */
static double follow(const char *method, double dt, double t, double *y)
{
    struct phys_scene scene = scene_of("world", world.bodies * DIMS, attraction, 10, 1, start);
    struct phys_system system;
    struct phys_ode ode;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    scene.dims = DIMS;
    scene.gm = gm;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    const struct phys_integrator *integrator = phys_integrator_find(method, &error);
    struct phys_simulation how = phys_simulation_of(integrator, dt, t);
    how.watch_energy = true;
    how.every = watched.every;
    how.sample = watched.sample;
    how.proceed = watched.proceed;
    how.context = watched.context;
    watched = (struct watched){0};
    assert_int_equal(phys_ode_for(&system, integrator, &ode, &error), AD_OK);
    start(NULL, 0, y, y + system.dof, &error);
    phys_simulate(&how, &ode, y, &info, &error);
    assert_no_error(&error);
    phys_ode_free(&ode);
    phys_system_close(&system);
    return info.energy_drift;
}

static double apart(size_t n, const double *a, const double *b)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(a[k] - b[k]));
    return most;
}

/* The relative position after a time t from pericentre, by Kepler's equation; |a| = 1, mu. */
static void kepler_equation(double e, double mu, double t, double x[DIMS])
{
    const long double M = sqrtl(mu) * t;
    long double low = M - 1, high = M + 1; /* of e < 1 */
    if (e > 1) {
        low = 0;
        high = 20;
    }
    for (int i = 0; i < 120; i++) {
        long double E = (low + high) / 2, f = e < 1 ? E - e * sinl(E) - M : e * sinhl(E) - E - M;
        *(f < 0 ? &low : &high) = E;
    }
    x[0] = (double)(e < 1 ? cosl(low) - e : e - coshl(low));
    x[1] = (double)(e < 1 ? sqrtl(1 - (long double)e * e) * sinl(low)
                          : sqrtl((long double)e * e - 1) * sinhl(low));
}

static const char *const methods[] = {"wisdom-holman", "wisdom-holman-corrected"};

/* Whatever the step: shorter and longer than a period, once through the pericentre or often. The
   corrector goes four steps to and fro, which costs digits next to a pericentre. */
static void test_two_bodies_are_exact(void **state)
{
    (void)state;
    static const double es[] = {0, 0.3, 0.9, 0.99, 1.01, 1.5, 10}, steps[] = {0.01, 0.37, 2.9, 21};
    for (size_t i = 0; i < sizeof es / sizeof *es; i++)
        for (size_t j = 0; j < sizeof steps / sizeof *steps; j++)
            for (size_t k = 0; k < (es[i] < 0.5 ? 2 : 1); k++) {
                const double e = es[i], m = 0.05, t = 2 * 21;
                double y[4 * DIMS], x[DIMS];
                begin(m);
                place(1, m, fabs(1 - e), e);
                rest();
                follow(methods[k], steps[j], t, y);
                kepler_equation(e, 1 + m, t, x);
                const double error = hypot(y[2] - y[0] - x[0], y[3] - y[1] - x[1]);
                print_message("%s, e = %-4g steps of %-4g: %.1e\n", methods[k], e, steps[j], error);
                assert_true(error < 1e-11);
            }
}

/* A star and two planets of mass m; the error of steps dt at t = 60. */
static double planets(const char *method, double m, double dt)
{
    double y[4 * MOST], exact[4 * MOST];
    begin(m);
    world.bodies = 3;
    place(2, 0.7 * m, 2.1, 0.2);
    follow("taylor", 1e-15, 60, exact);
    follow(method, dt, 60, y);
    return apart(3 * DIMS, y, exact);
}

/* e h^4, or with a corrector e h^10, of small masses e; e^2 h^2 of larger ones. */
static void test_orders(void **state)
{
    (void)state;
    static const double ratio[] = {16, 1024}, allowed[] = {3, 300}, dt[] = {0.25, 0.16};
    for (size_t k = 0; k < 2; k++) {
        const double coarse = planets(methods[k], 1e-6, 2 * dt[k]),
                     small = coarse / planets(methods[k], 1e-6, dt[k]),
                     large = planets(methods[k], 0.02, 0.04) / planets(methods[k], 0.02, 0.02),
                     masses = coarse / planets(methods[k], 1e-7, 2 * dt[k]);
        print_message("%s, halving: %.2f, %.2f; a tenth of the masses: %.2f\n", methods[k], small,
                      large, masses);
        assert_close(small, ratio[k], 0, allowed[k]);
        assert_close(large, 4, 0, 0.2);
        assert_close(masses, 10, 0, 1);
    }
}

/* Masses that the scene declares wrongly cost accuracy, and no more. */
static void test_masses_told_wrongly(void **state)
{
    (void)state;
    double y[4 * MOST], exact[4 * MOST], error[2];
    for (size_t k = 0; k < 2; k++) {
        planets(methods[0], 1e-3, 1);
        world.told = 1.5;
        follow("taylor", 1e-15, 60, exact);
        follow("wisdom-holman", k ? 0.01 : 0.02, 60, y);
        error[k] = apart(3 * DIMS, y, exact);
    }
    assert_close(error[0] / error[1], 4, 0, 0.3);
    assert_true(error[1] < 1e-6);
}

/* Ten times as long, the energy is off by no more; and the way back ends at the start. */
static void test_energy_and_reversal(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        double y[4 * MOST], turned[4 * MOST];
        planets(methods[k], 1e-3, 1);
        const double brief = follow(methods[k], 0.3, 600, y),
                     long_time = follow(methods[k], 0.3, 6000, turned);
        print_message("%s, energy: %.2e, ten times as long %.2e\n", methods[k], brief, long_time);
        assert_true(brief < 1e-5 && brief > 1e-10);
        assert_true(long_time < 2 * brief);
        memcpy(turned, world.q, sizeof world.q);
        memcpy(world.q, y, sizeof world.q);
        memcpy(world.v, y + 3 * DIMS, sizeof world.v);
        follow(methods[k], 0.3, -600, y);
        assert_true(apart(3 * DIMS, y, turned) < 1e-10);
    }
}

/* What the state is at a sample does not depend on which others were looked at, or on the end. */
static bool keep_last(void *context, double t, const double *y)
{
    (void)t;
    memcpy(context, y, 4 * 3 * sizeof *y);
    return true;
}

static bool a_hundred_steps(void *context) { return (*(size_t *)context)++ < 100; }

static void test_samples(void **state)
{
    (void)state;
    double last[4 * MOST], alone[4 * MOST], interrupted[4 * MOST];
    size_t steps = 0;
    planets(methods[1], 1e-3, 1);
    watched = (struct watched){.every = 10, .sample = keep_last, .context = last};
    follow(methods[1], 0.3, 30, alone);
    watched = (struct watched){.proceed = a_hundred_steps, .context = &steps};
    follow(methods[1], 0.3, 60, interrupted);
    assert_memory_equal(last, alone, 4 * 3 * sizeof *alone);
    assert_memory_equal(interrupted, alone, 4 * 3 * sizeof *alone);
}

/* The star last, the planets in either order. */
static void test_bodies_in_any_order(void **state)
{
    (void)state;
    static const size_t at[MOST] = {2, 0, 1};
    for (size_t method = 0; method < 2; method++) {
        double y[4 * MOST], other[4 * MOST], sorted[2 * MOST];
        planets(methods[method], 1e-3, 1);
        follow(methods[method], 0.3, 60, y);
        const double m[MOST] = {world.m[0], world.m[1], world.m[2]};
        double q[MOST * DIMS], v[MOST * DIMS];
        memcpy(q, world.q, sizeof q);
        memcpy(v, world.v, sizeof v);
        for (size_t k = 0; k < MOST; k++) {
            world.m[at[k]] = m[k];
            memcpy(world.q + at[k] * DIMS, q + k * DIMS, DIMS * sizeof *q);
            memcpy(world.v + at[k] * DIMS, v + k * DIMS, DIMS * sizeof *v);
        }
        follow(methods[method], 0.3, 60, other);
        for (size_t k = 0; k < MOST; k++)
            memcpy(sorted + k * DIMS, other + at[k] * DIMS, DIMS * sizeof *q);
        assert_true(apart(3 * DIMS, y, sorted) < 1e-12);
    }
}

static void refused(const char *scene, const char *name, double value, const char *why)
{
    struct phys_system system = system_opened(scene);
    struct ad_error error = {0};
    struct phys_motion_solution m;
    const struct phys_motion_settings how = {.size = sizeof how,
                                             .integrator =
                                                 phys_integrator_find("wisdom-holman", &error),
                                             .time = 1,
                                             .tolerance = 0,
                                             .dt = 0.1};
    if (name)
        system_set(&system, name, value);
    phys_motion_solve(&system, &how, &m, &error);
    assert_int_equal(error.status, AD_E_ARGUMENT);
    assert_mentions(error.message, why);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

static void test_refusals(void **state)
{
    (void)state;
    refused("kepler", NULL, 0, "gm");
    refused("figure8", NULL, 0, "gm");
    refused("dblpend", NULL, 0, "positions and time only");
    refused("ephemeris", "relativity", 1, "positions and time only");
    refused("ephemeris", "mass_mars", 1e30, "10 times the mass");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_bodies_are_exact),
        cmocka_unit_test(test_orders),
        cmocka_unit_test(test_masses_told_wrongly),
        cmocka_unit_test(test_energy_and_reversal),
        cmocka_unit_test(test_samples),
        cmocka_unit_test(test_bodies_in_any_order),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
