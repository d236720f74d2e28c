/* Charts of motions and paths: their files have the documented columns, rows and numbers, and the
   numbers are those of the methods. No times are asserted. */
#include "chart_table.h"
#include "tests/apps/picture_text.h"
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "apps/bench/measure/motions.h"
#include "physics/physics.h"
#include "apps/bench/measure/work_precision.h"

#include <string.h>

/* ---- integrators ---- */

/* The order seen between the two finest rows of a method on a problem that are not near rounding.
 */
static double order_of(const struct table *t, const char *problem, const char *method)
{
    double order = NAN, before = NAN, before_dt = NAN;
    for (size_t r = 0; r < t->rows; r++) {
        if (!table_is(t, r, "problem", problem) || !table_is(t, r, "method", method))
            continue;
        double e = table_number(t, r, "error"), dt = table_number(t, r, "setting");
        if (e > 1e-11)
            order = log(before / e) / log(before_dt / dt);
        before = e;
        before_dt = dt;
    }
    return order;
}

static void check_integrator_rows(const struct table *t)
{
    for (size_t r = 0; r < t->rows; r++) {
        bool adaptive = table_is(t, r, "method", "dopri5") || table_is(t, r, "method", "dop853") ||
                        table_is(t, r, "method", "taylor");
        assert_true(table_is(t, r, "knob", adaptive ? "tol" : "dt"));
        assert_true(table_number(t, r, "setting") > 0);
        assert_true(table_number(t, r, "steps") >= 1);
        assert_true(table_number(t, r, "evaluations") >= 1);
        assert_true(table_number(t, r, "seconds") > 0);
        assert_true(table_number(t, r, "error") >= 0 && table_number(t, r, "error") < 1);
    }
}

/* Every method has rows on every problem that it suits, and gets better there. */
static void check_contests(const struct table *t)
{
    for (size_t p = 0; p < MOTION_PROBLEMS; p++)
        for (size_t k = 0; phys_integrators[k]; k++) {
            const char *problem = motion_problems[p].name, *method = phys_integrators[k]->name;
            double first = 0, best = INFINITY;
            size_t rows = 0;
            for (size_t r = 0; r < t->rows; r++)
                if (table_is(t, r, "problem", problem) && table_is(t, r, "method", method)) {
                    double e = table_number(t, r, "error");
                    first = rows++ ? first : e;
                    best = fmin(best, e);
                }
            bool separable = phys_integrators[k]->separable && strcmp(problem, "dblpend") == 0;
            if (phys_integrators[k]->dominated)
                assert_true(strcmp(problem, "ephemeris") == 0 ? rows > 0 : rows == 0);
            else if (separable || strcmp(method, "rattle") == 0) /* without constraints, verlet */
                assert_int_equal(rows, 0);
            else if (strcmp(problem, "pendulum") == 0 && strcmp(method, "euler") != 0)
                assert_true(rows > 0 && (rows < 3 || best < first / 4));
            if (strcmp(method, "taylor") == 0) /* down to rounding */
                assert_true(best < 1e-12);
        }
}

static void test_integrators(void **state)
{
    (void)state;
    static const char header[] = "problem,method,knob,setting,steps,evaluations,seconds,error";
    assert_int_equal(shell("$LA chart integrators --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("integrators.csv");
    table_expect_header(t, header);
    check_integrator_rows(t);
    check_contests(t);
    /* rk4 loses energy with order 5, but over time squared: its factor 16 shows in short runs */
    static const struct {
        const char *problem, *method;
        double order;
    } orders[] = {{"ephemeris", "rk4", 4},
                  {"pendulum", "verlet", 2},
                  {"pendulum", "yoshida4", 4},
                  {"pendulum", "gauss2", 4},
                  {"pendulum", "yoshida6", 6}};
    for (size_t k = 0; k < sizeof orders / sizeof *orders; k++)
        assert_close(order_of(t, orders[k].problem, orders[k].method), orders[k].order, 0, 0.3);
    table_free(t);
}

/* Symplectic methods err as much after 26 orbits as after 3, rk4 and dop853 several times as much.
 */
static void check_drift(const struct table *t, const char *method, bool bounded)
{
    double early = 0, late = 0;
    for (size_t r = 0; r < t->rows; r++) {
        if (!table_is(t, r, "method", method))
            continue;
        double periods = table_number(t, r, "periods"), e = table_number(t, r, "error");
        if (periods > 2 && periods < 5)
            early = fmax(early, e);
        late = periods > 20 ? fmax(late, e) : late;
    }
    assert_true(early > 0 && late > 0);
    assert_true(bounded ? late < 1.5 * early : late > 3 * early);
}

static void test_drift(void **state)
{
    (void)state;
    struct table *t = table_read("drift.csv");
    table_expect_header(t, "method,symplectic,setting,periods,error");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(table_number(t, r, "error") > 0);
    check_drift(t, "verlet", true);
    check_drift(t, "yoshida4", true);
    check_drift(t, "yoshida6", true);
    check_drift(t, "rk4", false);
    check_drift(t, "dop853", false);
    table_free(t);
}

static void test_ensembles(void **state)
{
    (void)state;
    struct table *t = table_read("ensembles.csv");
    table_expect_header(t, "scene,tolerance,alone_us,together_us,together_ratio,threads_us,"
                           "threads_ratio,same");
    assert_int_equal(t->rows, 5);
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(table_number(t, r, "together_ratio") > 0);
        assert_true(table_is(t, r, "same", "yes"));
    }
    table_free(t);
}

static void test_integrator_files(void **state)
{
    (void)state;
    static const char *const names[] = {"integrators.csv",
                                        "drift.csv",
                                        "ensembles.csv",
                                        "drift.svg",
                                        "integrators-pendulum.svg",
                                        "integrators-dblpend.svg",
                                        "integrators-kepler.svg",
                                        "integrators-kepler99.svg",
                                        "integrators-figure8.svg",
                                        "integrators-ephemeris.svg"};
    if (!gnuplot()) {
        print_message("gnuplot is not installed\n");
        skip();
    }
    expect_files(sizeof names / sizeof *names, names);
}

/* ---- paths ---- */

static double rule_order(const struct table *t, const char *scene, const char *rule)
{
    double order = NAN, before = NAN, slices = NAN;
    for (size_t r = 0; r < t->rows; r++)
        if (table_is(t, r, "scene", scene) && table_is(t, r, "rule", rule) &&
            table_is(t, r, "solver", "newton")) {
            double e = table_number(t, r, "error"), n = table_number(t, r, "slices") - 1;
            if (e > 1e-11)
                order = log(before / e) / log(n / slices);
            before = e;
            slices = n;
        }
    return order;
}

static double last_error(const struct table *t, const char *scene, const char *solver)
{
    double error = NAN;
    for (size_t r = 0; r < t->rows; r++)
        if (table_is(t, r, "scene", scene) && table_is(t, r, "solver", solver))
            error = table_number(t, r, "error");
    return error;
}

static void test_rules(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart paths --quick --quiet --out ."), 0);
    picture_texts_are_apart();
    struct table *t = table_read("rules.csv");
    table_expect_header(t, "scene,solver,rule,slices,seconds,error");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(table_number(t, r, "seconds") > 0 && table_number(t, r, "error") > 0);
    for (size_t k = 0; phys_rules[k]; k++) {
        /* between fixed ends, where forces depend on positions alone, `left` is `trapezoid` */
        bool left = strcmp(phys_rules[k]->name, "left") == 0;
        double order = left ? 2 : (double)phys_rules[k]->order;
        assert_close(rule_order(t, "kepler", phys_rules[k]->name), order, 0, 0.15);
    }
    table_free(t);
}

static void test_solvers(void **state)
{
    (void)state;
    static const char *const scenes[] = {"freebody", "pendulum", "threebody", "ephemeris"};
    struct table *t = table_read("paths.csv");
    table_expect_header(t, "scene,solver,step,seconds,error");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(table_number(t, r, "seconds") >= 0 && table_number(t, r, "error") >= 0);
    for (size_t k = 0; k < 4; k++) {
        assert_true(last_error(t, scenes[k], "Newton") < 1e-12);
        double adam = last_error(t, scenes[k], "Adam as published");
        assert_true(adam > 1e-4 && adam < 0.2); /* it stays where the published one does */
    }
    table_free(t);
}

/* Of the same run: errors against the motion are those asked for and estimated. */
static void test_boundaries(void **state)
{
    (void)state;
    struct table *t = table_read("boundaries.csv");
    table_expect_header(t, "problem,method,tol,rule,elements,seconds,first,estimate,largest,error");
    assert_int_equal(t->rows, 6 * 3);
    for (size_t r = 0; r < t->rows; r++) {
        double tol = table_number(t, r, "tol"), error = table_number(t, r, "error");
        assert_true(error > 0 && error < tol && table_number(t, r, "seconds") > 0);
        assert_true(table_number(t, r, "largest") <= table_number(t, r, "estimate") + 1e-12);
        assert_true(r % 3 == 0 || error < table_number(t, r - 1, "error"));
    }
    table_free(t);
}

/* ---- the parts ---- */

static void test_kepler_answer(void **state)
{
    (void)state;
    double q[2], v[2];
    exact_kepler(0.6, 1, q, v);
    assert_close(q[0], -0.628948176826624, 0, 2e-15);
    assert_close(q[1], 0.799664730970039, 0, 2e-15);
    assert_close(0.5 * (v[0] * v[0] + v[1] * v[1]) - 1 / hypot(q[0], q[1]), -0.5, 1e-14, 0);
    assert_close(q[0] * v[1] - q[1] * v[0], 0.8, 1e-14, 0);
    exact_kepler(0.99, 1e-3, q, v); /* near the centre, where Newton's method is hard pressed */
    assert_close(0.5 * (v[0] * v[0] + v[1] * v[1]) - 1 / hypot(q[0], q[1]), -0.5, 1e-12, 0);
}

static void test_pendulum_answer(void **state)
{
    (void)state;
    double q, v;
    exact_pendulum(0.9, 100, &q, &v);
    assert_close(q, -0.60755999, 0, 1e-8);
    assert_close(0.5 * v * v - cos(q), 2 * 0.81 - 1, 1e-14, 0);
    exact_pendulum(sin(M_PI / 4), 7.41629870921, &q, &v); /* a period */
    assert_close(q, 0, 0, 1e-10);
    assert_close(v, 2 * sin(M_PI / 4), 1e-10, 0);
}

/* An explicit method of another family comes to the ends that the charts measure against. */
static void test_found_answers(void **state)
{
    (void)state;
    struct ad_error error = {0};
    for (size_t p = 0; p < MOTION_PROBLEMS; p++) {
        struct problem motion;
        struct phys_ode ode = {0};
        struct problem_cost cost;
        const struct phys_integrator *method = phys_integrator_find("dop853", &error);
        bool suits = false;
        problem_open(&motion_problems[p], &motion, &error);
        problem_field(&motion, method, &ode, &suits, &error);
        problem_run(&motion, method, &ode, 1e-15, &cost, &error);
        assert_int_equal(error.status, AD_OK);
        assert_true(suits && cost.complete && motion.doubt < 1e-12);
        assert_true(cost.error < 2e-10); /* e = 0.99 keeps ten digits, the others twelve */
        assert_true(cost.error < 2e-12 || strcmp(motion_problems[p].name, "kepler99") == 0);
        phys_ode_free(&ode);
        problem_close(&motion);
    }
}

static void test_work_between_runs(void **state)
{
    (void)state;
    const struct work_curve curves[] = {
        {.name = "slow",
         .knob = "dt",
         .n = 2,
         .point = {{1, 10, 40, 1e-2, 1e-2}, {0.1, 100, 400, 1e-1, 1e-6}}},
        {.name = "rough", .knob = "dt", .n = 1, .point = {{1, 10, 10, 1e-3, 1e-3}}},
    };
    struct work_point at;
    assert_true(work_at(&curves[0], 1e-4, &at)); /* half way on logarithmic scales */
    assert_close(at.seconds, sqrt(1e-3), 1e-12, 0);
    assert_close(at.steps, sqrt(1e3), 1e-12, 0);
    assert_close(at.setting, sqrt(0.1), 1e-12, 0);
    assert_false(work_at(&curves[1], 1e-4, &at));
    assert_int_equal(work_best(2, curves, 1e-2, &at), 1);
    assert_int_equal(work_best(2, curves, 1e-4, &at), 0);
    assert_int_equal(work_best(2, curves, 1e-7, &at), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kepler_answer),
        cmocka_unit_test(test_pendulum_answer),
        cmocka_unit_test(test_found_answers),
        cmocka_unit_test(test_work_between_runs),
        cmocka_unit_test_setup(test_integrators, shell_empty),
        cmocka_unit_test(test_drift),
        cmocka_unit_test(test_ensembles),
        cmocka_unit_test(test_integrator_files),
        cmocka_unit_test_setup(test_rules, shell_empty),
        cmocka_unit_test(test_solvers),
        cmocka_unit_test(test_boundaries),
    };
    return cmocka_run_group_tests_name("charts of motions", tests, shell_setup, shell_teardown);
}
