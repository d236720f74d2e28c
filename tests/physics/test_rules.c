/* Action rules: their orders of convergence, exact actions, and the layout of paths with nodes
   between the slices. */
#include "published.h"
#include "physics/physics.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct phys_rule *rule_named(const char *name)
{
    struct ad_error error = {0};
    const struct phys_rule *rule = phys_rule_find(name, &error);
    assert_no_error(&error);
    return rule;
}

static void set(struct phys_system *system, const char *name, double value)
{
    struct ad_error error = {0};
    phys_system_set(system, name, value, &error);
    assert_no_error(&error);
}

/* ---- the tables ---- */

/* Weights integrate, node values interpolate and slopes differentiate polynomials as they should.
 */
static void gauss_tables_are_exact_for_polynomials(void **state)
{
    (void)state;
    for (const struct phys_rule *rule = rule_named("gauss2"); rule->name; rule++) {
        struct phys_rule_table t;
        rule->fill(rule, &t);
        for (size_t p = 0; p < 2 * t.points; p++) {
            double integral = 0;
            for (size_t j = 0; j < t.points; j++)
                integral += t.weight[j] * pow(t.time[j], (double)p);
            assert_close(integral, 1 / (double)(p + 1), 1e-13, 0);
        }
        for (size_t j = 0; j < t.points; j++)
            for (size_t p = 0; p <= t.degree; p++) {
                double value = 0, slope = 0;
                for (size_t k = 0; k <= t.degree; k++) {
                    value += t.q[j][k] * pow(t.node[k], (double)p);
                    slope += t.v[j][k] * pow(t.node[k], (double)p);
                }
                assert_close(value, pow(t.time[j], (double)p), 0, 1e-13);
                assert_close(slope, p ? (double)p * pow(t.time[j], (double)p - 1) : 0, 0, 3e-12);
            }
    }
}

static void rules_are_found_by_name(void **state)
{
    (void)state;
    struct ad_error error = {0};
    assert_int_equal(rule_named("gauss24")->order, 48);
    assert_null(phys_rule_find("gauss1", &error));
    assert_int_equal(error.status, AD_E_ARGUMENT);
}

/* ---- order ---- */

struct problem {
    const char *scene;
    double time;
    double q[2], action; /* exact: position at half the time, action of the whole */
    double ends[2][2];
};

/* The stationary path of n elements between exact ends, from an approximate one, and its action. */
static double *stationary(const struct phys_system *system, const struct phys_rule *rule,
                          const struct problem *problem, size_t n, const double *start,
                          double *action)
{
    size_t dof = system->dof, slices = n + 1;
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = rule,
                                          .slices = slices,
                                          .dt = problem->time / (double)n,
                                          .steps = 60,
                                          .learning_rate = 1};
    struct phys_path_info info;
    struct ad_error error = {0};
    double *path = malloc(rule->degree * dof * slices * sizeof *path);
    for (size_t k = 0; k < dof; k++) {
        memcpy(path + k * slices, start + k * slices, slices * sizeof *path);
        path[k * slices] = problem->ends[0][k];
        path[k * slices + n] = problem->ends[1][k];
    }
    phys_rule_interpolate(rule, dof, slices, path);
    phys_path_solve(phys_solver_find("newton", &error), system, &settings, path, &info, &error);
    assert_no_error(&error);
    assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
    *action = info.action;
    return path;
}

struct errors {
    double path, action; /* the second with its sign */
};

/* Errors of the stationary path: largest at the middle slice, and of the action. */
static struct errors errors_of(const struct phys_system *system, const struct phys_rule *rule,
                               const struct problem *problem, size_t n, const double *start)
{
    struct errors errors = {0, 0};
    double action, *path = stationary(system, rule, problem, n, start, &action);
    for (size_t k = 0; k < system->dof; k++)
        errors.path = fmax(errors.path, fabs(path[k * (n + 1) + n / 2] - problem->q[k]));
    errors.action = action - problem->action;
    free(path);
    return errors;
}

/* The motion from the scene's start as an approximate path of n elements. */
static double *fine(const struct phys_system *system, double time, size_t n)
{
    double q[2], v[2], *path = malloc(2 * (n + 1) * sizeof *path);
    struct ad_error error = {0};
    system->scene->start(system->params, 1, q, v, &error);
    phys_motion_path(system, NULL, q, v, n + 1, time / (double)n, path, &error);
    assert_no_error(&error);
    return path;
}

/* Ends of a motion; the middle and the action of the stationary path between them to rounding. */
static void solve_exactly(const struct phys_system *system, struct problem *problem)
{
    enum { FINE = 60, SLICES = FINE + 1 };
    double *start = fine(system, problem->time, FINE);
    for (size_t k = 0; k < system->dof; k++) {
        problem->ends[0][k] = start[k * SLICES];
        problem->ends[1][k] = start[k * SLICES + FINE];
    }
    double *exact =
        stationary(system, rule_named("gauss8"), problem, FINE, start, &problem->action);
    for (size_t k = 0; k < system->dof; k++)
        problem->q[k] = exact[k * SLICES + FINE / 2];
    free(start);
    free(exact);
}

/* Slopes of log error between n and 2 n elements approach the order of the rule. For separable L
   the discrete equations of `left` are those of `trapezoid`: its path between two ends has order 2,
   its action keeps order 1. */
static void check_orders(const struct phys_system *system, struct problem *problem)
{
    static const struct {
        const char *rule;
        size_t coarse, fine; /* elements a unit of time */
        double path_order;
    } cases[] = {{"left", 64, 128, 2},  {"midpoint", 64, 128, 2}, {"trapezoid", 64, 128, 2},
                 {"gauss2", 16, 32, 4}, {"gauss3", 8, 16, 6},     {"gauss4", 4, 6, 8},
                 {"gauss5", 3, 4, 10}};
    const double rounding = 1e-13;
    solve_exactly(system, problem);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const struct phys_rule *rule = rule_named(cases[c].rule);
        size_t unit = (size_t)problem->time, n = cases[c].coarse * unit, m = cases[c].fine * unit;
        double *a = fine(system, problem->time, n), *b = fine(system, problem->time, m);
        struct errors coarse = errors_of(system, rule, problem, n, a);
        struct errors finer = errors_of(system, rule, problem, m, b);
        double ratio = log((double)m / (double)n);
        double path = log(coarse.path / finer.path) / ratio;
        double action = log(coarse.action / finer.action) / ratio;
        print_message("%-9s %-9s path %.2e %.2e: order %.3f; action %.2e %.2e: order %.3f\n",
                      problem->scene, cases[c].rule, coarse.path, finer.path, path, coarse.action,
                      finer.action, action);
        if (finer.path > rounding)
            assert_close(path, cases[c].path_order, 0, 0.15);
        if (fabs(finer.action) > rounding)
            assert_close(action, (double)rule->order, 0, 0.15);
        free(a);
        free(b);
    }
}

static void orders_on_the_pendulum(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("pendulum", &system, &error);
    set(&system, "l", 1);
    set(&system, "theta0", 0.3);
    set(&system, "rate0", 1.4);
    check_orders(&system, &(struct problem){.scene = "pendulum", .time = 12});
    phys_system_close(&system);
}

static void orders_on_kepler(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("kepler", &system, &error);
    set(&system, "e", 0.3);
    check_orders(&system, &(struct problem){.scene = "kepler", .time = 2});
    phys_system_close(&system);
}

/* ---- known actions ---- */

/* Action of the stationary path between ends, found from a start path that is changed in place. */
static double action_of(const struct phys_system *system, const char *rule, size_t slices,
                        double dt, double *path)
{
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = rule_named(rule),
                                          .slices = slices,
                                          .dt = dt,
                                          .steps = 100,
                                          .learning_rate = 1};
    struct phys_path_info info;
    struct ad_error error = {0};
    phys_rule_interpolate(settings.rule, system->dof, slices, path);
    phys_path_solve(phys_solver_find("newton", &error), system, &settings, path, &info, &error);
    assert_no_error(&error);
    assert_int_equal(info.stop, PHYS_STOP_ROUNDING);
    return info.action;
}

/* w = T = 1, x from 1 to 0: S = cot(1)/2. */
static void action_of_the_oscillator(void **state)
{
    static const struct {
        const char *rule;
        double error, tolerance;
    } cases[] = {{"trapezoid", -2.7e-6, 5e-8}, {"left", -1.6e-3, 5e-5}, {"gauss4", 0, 1e-13}};
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double path[4 * 161] = {[0] = 1};
        double S = action_of(&spring, cases[k].rule, 161, 1. / 160, path);
        assert_close(S - 0.5 / tan(1), cases[k].error, 0, cases[k].tolerance);
    }
    phys_system_close(&spring);
}

/* The last velocity counted twice adds dt L there. */
static void repeated_velocity_adds_to_the_action(void **state)
{
    (void)state;
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    ad_tape *tape = ad_tape_new(AD_F64);
    struct phys_action action;
    ad_program *program;
    double path[161], S;
    for (size_t i = 0; i <= 160; i++)
        path[i] = sin(1 - (double)i / 160) / sin(1);
    phys_action_record(tape, &spring, rule_named("left+repeat"), 161, 1. / 160, 0, &action);
    assert_int_equal(ad_compile(tape, 1, &action.action, &program), AD_OK);
    ad_set(program, action.path, path);
    ad_run(program);
    ad_get(program, action.action, &S);
    assert_close(S - 0.5 / tan(1), 2.8e-3, 0, 5e-5);
    ad_program_free(program);
    ad_tape_free(tape);
    phys_system_close(&spring);
}

static void action_in_uniform_gravity(void **state)
{
    (void)state;
    const double T = 1.7, x0 = 0.3, x1 = -1.1, m = 1.3, g = 9.1, dt = T / 20;
    const double exact = m * (x1 - x0) * (x1 - x0) / (2 * T) - m * g * T * (x0 + x1) / 2 -
                         m * g * g * T * T * T / 24;
    struct phys_system body;
    struct ad_error error = {0};
    phys_system_open("freebody", &body, &error);
    set(&body, "m", m);
    set(&body, "g", g);
    double path[2 * 21] = {[0] = x0, [20] = x1};
    double S = action_of(&body, "trapezoid", 21, dt, path);
    assert_close(S - exact, m * g * g * T * dt * dt / 24, 1e-9, 0);
    assert_close(action_of(&body, "gauss2", 21, dt, path), exact, 1e-14, 0);
    phys_system_close(&body);
}

/* The whole ellipse, from pericentre to pericentre: 3 pi with e = .6, a = GM = 1. */
static void action_of_an_orbit(void **state)
{
    (void)state;
    enum { N = 60 };
    struct phys_system kepler;
    struct ad_error error = {0};
    phys_system_open("kepler", &kepler, &error);
    double *orbit = fine(&kepler, 2 * M_PI, N);
    double *path = malloc(8 * 2 * (N + 1) * sizeof *path);
    memcpy(path, orbit, 2 * (N + 1) * sizeof *path);
    assert_close(action_of(&kepler, "gauss8", N + 1, 2 * M_PI / N, path), 3 * M_PI, 1e-10, 0);
    free(orbit);
    free(path);
    phys_system_close(&kepler);
}

/* C9: a number out of range is answered with the range. */
static void numbers_have_a_range(void **state)
{
    (void)state;
    static const char *const names[] = {"gauss99", "gauss1", "gauss25"};
    for (size_t k = 0; k < LENGTH(names); k++) {
        struct ad_error error = {0};
        assert_null(phys_rule_find(names[k], &error));
        assert_non_null(strstr(error.message, "gauss2 to gauss24"));
    }
}

/* A cubic, which elements of degree 3 and 4 hold exactly, on one grid and on another. */
static void resampling_keeps_polynomials(void **state)
{
    (void)state;
    enum { DOF = 2, FROM = 4, TO = 6, MOST = 4 };
    const struct phys_grid from = {rule_named("gauss3"), FROM, 0.5, NULL},
                           to = {rule_named("gauss4"), TO, 0.3, NULL};
    const struct phys_grid *const grids[] = {&from, &to};
    double path[2][MOST * DOF * TO] = {{0}};
    struct ad_error error = {0};
    for (size_t g = 0; g < 2; g++) {
        struct phys_rule_table table;
        size_t n = grids[g]->slices, s = grids[g]->rule->degree;
        grids[g]->rule->fill(grids[g]->rule, &table);
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < s; k++) {
                double t = ((double)i + (i + 1 < n ? table.node[k] : 0)) * grids[g]->dt;
                path[g][k * DOF * n + i] = 1 + t * (2 - t * (3 - t));
                path[g][(k * DOF + 1) * n + i] = t * t;
            }
    }
    double *found = phys_path_resample(&from, path[0], &to, DOF, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < to.rule->degree * DOF * TO; k++)
        assert_close(found[k], path[1][k], 0, 1e-13);
    free(found);
    assert_null(phys_path_resample(&from, NULL, &to, DOF, &error));
    assert_int_equal(error.status, AD_E_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gauss_tables_are_exact_for_polynomials),
        cmocka_unit_test(rules_are_found_by_name),
        cmocka_unit_test(numbers_have_a_range),
        cmocka_unit_test(resampling_keeps_polynomials),
        cmocka_unit_test(orders_on_the_pendulum),
        cmocka_unit_test(orders_on_kepler),
        cmocka_unit_test(action_of_the_oscillator),
        cmocka_unit_test(repeated_velocity_adds_to_the_action),
        cmocka_unit_test(action_in_uniform_gravity),
        cmocka_unit_test(action_of_an_orbit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
