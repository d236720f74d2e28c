/* Many bodies: near pairs give what all pairs give, friction agrees with the Lagrangian that has
   it, energy is conserved without it, and a gas stays one or becomes a solid. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/physics.h"
#include "physics/gas/order.h"

#include <malloc.h>
#include <stdlib.h>

/* A gas with its start. */
struct gas_run {
    struct phys_system system;
    struct phys_ode ode;
    double *y;
    struct ad_error error;
};

static void gas_open(struct gas_run *g, enum phys_gas_pairs pairs, size_t n,
                     const struct phys_setting set[])
{
    *g = (struct gas_run){0};
    assert_int_equal(phys_system_open("gas", &g->system, &g->error), AD_OK);
    for (size_t k = 0; k < n; k++)
        assert_int_equal(phys_system_set(&g->system, set[k].name, set[k].value, &g->error), AD_OK);
    if (phys_ode_gas(&g->system, pairs, &g->ode, &g->error) != AD_OK)
        fail_msg("%s", g->error.message);
    g->y = malloc(g->ode.n * sizeof *g->y);
    assert_non_null(g->y);
    g->system.scene->start(g->system.params, 3, g->y, g->y + g->system.dof, &g->error);
}

static void gas_close(struct gas_run *g)
{
    free(g->y);
    phys_ode_free(&g->ode);
    phys_system_close(&g->system);
}

static struct phys_simulation_info gas_run_to(struct gas_run *g, const char *method, double dt,
                                              double time)
{
    struct phys_simulation_info info;
    struct phys_simulation settings = {.size = sizeof settings,
                                       .integrator = phys_integrator_find(method, &g->error),
                                       .t1 = time,
                                       .dt = settings.integrator->adaptive ? 0 : dt,
                                       .rtol = dt,
                                       .atol = dt,
                                       .watch_energy = true};
    if (phys_simulate(&settings, &g->ode, g->y, &info, &g->error) != AD_OK)
        fail_msg("%s", g->error.message);
    return info;
}

#define SETTINGS(list) sizeof(list) / sizeof *(list), list

/* The lattice stands around (1/2, 1/2), and each body within half of the jitter of its place. */
static void test_lattice(void **state)
{
    static const struct phys_setting set[] = {{"bodies", 400}, {"jitter", 0.2}, {"spacing", 0.05}};
    (void)state;
    struct gas_run g;
    double mean = 0, most = 0;
    gas_open(&g, PHYS_GAS_AUTO, SETTINGS(set));
    for (size_t k = 0; k < g.system.dof; k++) {
        double place = (g.y[k] - 0.5) / 0.05 - 0.5; /* 20 a side: whole numbers */
        mean += (place - round(place)) / (double)g.system.dof;
        most = fmax(most, fabs(place - round(place)));
    }
    assert_true(most > 0.099 && most <= 0.1);
    assert_close(mean, 0, 0, 0.01);
    gas_close(&g);
}

/* ---- forces ---- */

static void compare_fields(struct gas_run *a, struct gas_run *b, const double *y)
{
    double *f = malloc(2 * a->ode.n * sizeof *f), *g = f + a->ode.n, largest = 0;
    assert_non_null(f);
    assert_int_equal(a->ode.field(a->ode.context, 0, y, f, &a->error), AD_OK);
    assert_int_equal(b->ode.field(b->ode.context, 0, y, g, &b->error), AD_OK);
    for (size_t k = a->system.dof; k < a->ode.n; k++)
        largest = fmax(largest, fabs(f[k]));
    for (size_t k = a->system.dof; k < a->ode.n; k++)
        assert_close(g[k], f[k], 0, 1e-13 * largest);
    assert_close(b->ode.energy(b->ode.context, 0, y), a->ode.energy(a->ode.context, 0, y), 1e-12,
                 0);
    free(f);
}

/* Also after the bodies have moved so far that the pairs were listed anew, many times. */
static void test_near_pairs_are_enough(void **state)
{
    const struct phys_setting cut[] = {{"bodies", 90},  {"cutoff", 2.5}, {"spacing", 0.05},
                                       {"speed", 5e-3}, {"walls", 0.05}, {"friction", 0.01}};
    const struct phys_setting wide[] = {{"bodies", 40}, {"cutoff", 100}, {"spacing", 0.05}};
    struct gas_run all, near;
    (void)state;
    gas_open(&all, PHYS_GAS_ALL, SETTINGS(cut));
    gas_open(&near, PHYS_GAS_NEAR, SETTINGS(cut));
    for (int k = 0; k < 5; k++) {
        compare_fields(&all, &near, near.y);
        gas_run_to(&near, "verlet", 0.1, 30);
    }
    gas_close(&all);
    gas_close(&near);
    gas_open(&all, PHYS_GAS_ALL, SETTINGS(wide)); /* a cutoff beyond everyone */
    gas_open(&near, PHYS_GAS_NEAR, SETTINGS(wide));
    compare_fields(&all, &near, all.y);
    gas_close(&all);
    gas_close(&near);
}

/* However often pairs are listed anew, no memory is left over. */
static void test_lists_leave_nothing(void **state)
{
    const struct phys_setting cut[] = {
        {"bodies", 90}, {"cutoff", 2.5}, {"spacing", 0.05}, {"speed", 2e-2}, {"walls", 0.05}};
    struct gas_run g;
    (void)state;
    gas_open(&g, PHYS_GAS_NEAR, SETTINGS(cut));
    gas_run_to(&g, "verlet", 0.1, 60);
    size_t before = mallinfo2().uordblks; /* 0 where a sanitizer has its own malloc */
    gas_run_to(&g, "verlet", 0.1, 120);
    size_t after = mallinfo2().uordblks;
    assert_in_range(after, 0, before + before / 4);
    gas_close(&g);
}

/* The equations of motion of exp(friction t) (T - V), by the general way. */
static void test_friction_is_in_the_lagrangian(void **state)
{
    const struct phys_setting set[] = {{"bodies", 12}, {"cutoff", 2.2},   {"spacing", 0.045},
                                       {"speed", 0.1}, {"friction", 0.3}, {"walls", 1},
                                       {"m", 1.7}};
    struct gas_run g;
    phys_motion *motion;
    double a[24], rate[48];
    (void)state;
    gas_open(&g, PHYS_GAS_AUTO, SETTINGS(set));
    assert_int_equal(phys_motion_new(&g.system, &motion, &g.error), AD_OK);
    g.y[0] -= 0.1; /* into a wall */
    for (double t = 0; t < 9; t += 4) {
        assert_int_equal(phys_motion_acceleration(motion, g.y, g.y + 24, t, a, &g.error), AD_OK);
        g.ode.field(g.ode.context, t, g.y, rate, &g.error);
        for (size_t k = 0; k < 24; k++)
            assert_close(rate[24 + k], a[k], 1e-11, 1e-13);
    }
    phys_motion_free(motion);
    gas_close(&g);
}

/* A body on its own slows down exactly, with any step. */
static void test_free_flight_with_friction(void **state)
{
    const struct phys_setting set[] = {
        {"bodies", 2}, {"cutoff", 2}, {"spacing", 1}, {"friction", 0.2}, {"speed", 1}};
    struct gas_run g;
    (void)state;
    gas_open(&g, PHYS_GAS_AUTO, SETTINGS(set));
    double before = g.y[4];
    gas_run_to(&g, "verlet", 0.7, 7);
    assert_close(g.y[4], before * exp(-0.2 * 7), 1e-13, 0);
    gas_close(&g);
}

/* Verlet with friction is still of second order, and symmetric. */
static void test_order_with_friction(void **state)
{
    const struct phys_setting set[] = {
        {"bodies", 9}, {"spacing", 0.048}, {"friction", 0.1}, {"speed", 2e-3}};
    double error[2];
    struct gas_run fine, g;
    (void)state;
    gas_open(&fine, PHYS_GAS_AUTO, SETTINGS(set));
    gas_run_to(&fine, "dop853", 1e-13, 20);
    for (int k = 0; k < 2; k++) {
        double sum = 0;
        gas_open(&g, PHYS_GAS_AUTO, SETTINGS(set));
        gas_run_to(&g, "verlet", k ? 0.05 : 0.1, 20);
        for (size_t i = 0; i < g.system.dof; i++)
            sum += pow(g.y[i] - fine.y[i], 2);
        error[k] = sqrt(sum);
        gas_close(&g);
    }
    assert_close(log2(error[0] / error[1]), 2, 0, 0.1);
    gas_close(&fine);
}

/* The cut and shifted law has an energy, which Verlet keeps to second order in the step: here in
   units of the well's depth, a body. */
static void test_energy(void **state)
{
    const struct phys_setting set[] = {
        {"bodies", 200}, {"cutoff", 3}, {"spacing", 0.06}, {"speed", 5e-3}, {"walls", 0.01}};
    double drift[2];
    (void)state;
    for (int k = 0; k < 2; k++) {
        struct gas_run g;
        gas_open(&g, PHYS_GAS_AUTO, SETTINGS(set));
        struct phys_simulation_info info = gas_run_to(&g, "verlet", k ? 0.05 : 0.1, 100);
        drift[k] = info.energy_drift * fabs(info.energy_start) / 200 / 2.5e-5;
        gas_close(&g);
    }
    assert_true(drift[0] < 0.02 && drift[1] < 0.005);
    assert_true(drift[0] / drift[1] > 2.5);
}

/* ---- states ---- */

static struct phys_order settle(struct gas_run *g, double dt, double time)
{
    struct phys_order order;
    double shell = sqrt(sqrt(3)) * pow(2, 1 / 6.0) * phys_system_get(&g->system, "sigma");
    gas_run_to(g, "verlet", dt, time);
    assert_int_equal(phys_order(g->system.bodies, g->y, shell, NULL, NULL, &order, &g->error),
                     AD_OK);
    return order;
}

static void test_gas_and_solid(void **state)
{
    const struct phys_setting hot[] = {
        {"bodies", 200}, {"cutoff", 3}, {"spacing", 0.08}, {"speed", 8e-3}, {"walls", 0.01}};
    const struct phys_setting damped[] = {{"bodies", 200}, {"cutoff", 3},   {"spacing", 0.06},
                                          {"speed", 5e-3}, {"walls", 0.01}, {"friction", 0.01}};
    struct gas_run g;
    (void)state;
    gas_open(&g, PHYS_GAS_AUTO, SETTINGS(hot));
    struct phys_order gas = settle(&g, 0.1, 200);
    gas_close(&g);
    gas_open(&g, PHYS_GAS_AUTO, SETTINGS(damped));
    struct phys_order solid = settle(&g, 0.2, 800);
    gas_close(&g);
    print_message("gas: %.2f neighbours, hexatic %.3f; solid: %.2f, %.3f\n", gas.neighbours,
                  gas.hexatic, solid.neighbours, solid.hexatic);
    assert_int_equal(gas.state, PHYS_STATE_GAS);
    assert_int_equal(solid.state, PHYS_STATE_SOLID);
    assert_true(gas.neighbours < 1.5 && gas.hexatic < 0.25);
    assert_true(solid.neighbours > 4.5 && solid.hexatic > 0.7);
}

/* ---- refusals ---- */

static void test_refusals(void **state)
{
    struct phys_system system;
    struct phys_ode ode = {0};
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_system_open("gas", &system, &error), AD_OK);
    phys_system_set(&system, "bodies", 5000, &error);
    assert_int_equal(phys_ode_gas(&system, PHYS_GAS_AUTO, &ode, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "cutoff");
    phys_ode_free(&ode);
    error = (struct ad_error){0};
    phys_system_set(&system, "bodies", 50, &error);
    assert_int_equal(phys_ode_gas(&system, PHYS_GAS_NEAR, &ode, &error), AD_E_ARGUMENT);
    phys_ode_free(&ode);
    error = (struct ad_error){0};
    assert_int_equal(phys_system_set(&system, "cutoff", -1, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_near_pairs_are_enough),
        cmocka_unit_test(test_lists_leave_nothing),
        cmocka_unit_test(test_friction_is_in_the_lagrangian),
        cmocka_unit_test(test_free_flight_with_friction),
        cmocka_unit_test(test_order_with_friction),
        cmocka_unit_test(test_energy),
        cmocka_unit_test(test_gas_and_solid),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
