/* Charts: what they write has the columns, rows and numbers that are promised, and the numbers are
   those of the methods. Nothing here asserts a time. */
#include "../close.h"
#include "../files.h"
#include "shell.h"
#include "../../apps/exact.h"
#include "../../apps/hand.h"
#include "../../apps/motions.h"
#include "../../apps/work.h"

#include <stdlib.h>
#include <string.h>

/* ---- tables ---- */

enum { MOST_ROWS = 1 << 14, MOST_COLUMNS = 32 };

struct table {
    size_t rows, columns;
    char *text;
    const char *name[MOST_COLUMNS];
    const char *cell[MOST_ROWS][MOST_COLUMNS];
};

static size_t split(char *line, const char *cells[])
{
    size_t n = 0;
    for (char *next = line; next && n < MOST_COLUMNS; n++) {
        cells[n] = next;
        next = strchr(next, ',');
        if (next)
            *next++ = '\0';
    }
    return n;
}

/* A table of the chart in the work folder; every row has the columns of the first. */
static struct table *table_read(const char *name)
{
    struct table *table = calloc(1, sizeof *table);
    size_t size;
    assert_non_null(table);
    table->text = files_read(shell_path(name), &size);
    for (char *line = strtok(table->text, "\n"); line; line = strtok(NULL, "\n")) {
        if (*line == '#')
            continue;
        if (!table->columns) {
            table->columns = split(line, table->name);
            continue;
        }
        assert_true(table->rows < MOST_ROWS);
        assert_int_equal(split(line, table->cell[table->rows++]), table->columns);
    }
    return table;
}

static void table_free(struct table *table)
{
    free(table->text);
    free(table);
}

static size_t column(const struct table *table, const char *name)
{
    for (size_t c = 0; c < table->columns; c++)
        if (strcmp(table->name[c], name) == 0)
            return c;
    print_error("no column %s\n", name);
    fail();
    return 0;
}

static double number(const struct table *table, size_t row, const char *name)
{
    char *end;
    const char *cell = table->cell[row][column(table, name)];
    double value = strtod(cell, &end);
    if (*cell == '\0' || *end != '\0' || !isfinite(value))
        print_error("row %zu, %s: '%s'\n", row, name, cell);
    assert_true(*cell != '\0' && *end == '\0' && isfinite(value));
    return value;
}

static bool is(const struct table *table, size_t row, const char *name, const char *value)
{
    return strcmp(table->cell[row][column(table, name)], value) == 0;
}

static void expect_header(const struct table *table, const char *header)
{
    char text[256] = "";
    for (size_t c = 0; c < table->columns; c++) {
        strcat(text, c ? "," : "");
        strcat(text, table->name[c]);
    }
    assert_string_equal(text, header);
}

static void expect_files(size_t n, const char *const names[])
{
    for (size_t k = 0; k < n; k++) {
        size_t size;
        free(files_read(shell_path(names[k]), &size));
        assert_true(size > 0);
    }
    assert_int_equal(shell_files(), n);
}

static bool gnuplot(void) { return system("command -v gnuplot >/dev/null") == 0; }

/* ---- integrators ---- */

/* The order seen between the two finest rows of a method on a problem that are not near rounding.
 */
static double order_of(const struct table *t, const char *problem, const char *method)
{
    double order = NAN, before = NAN, before_dt = NAN;
    for (size_t r = 0; r < t->rows; r++) {
        if (!is(t, r, "problem", problem) || !is(t, r, "method", method))
            continue;
        double e = number(t, r, "error"), dt = number(t, r, "setting");
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
        bool adaptive = is(t, r, "method", "dopri5") || is(t, r, "method", "dop853");
        assert_true(is(t, r, "knob", adaptive ? "tol" : "dt"));
        assert_true(number(t, r, "setting") > 0);
        assert_true(number(t, r, "steps") >= 1);
        assert_true(number(t, r, "evaluations") >= 1);
        assert_true(number(t, r, "seconds") > 0);
        assert_true(number(t, r, "error") >= 0 && number(t, r, "error") < 1);
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
                if (is(t, r, "problem", problem) && is(t, r, "method", method)) {
                    double e = number(t, r, "error");
                    first = rows++ ? first : e;
                    best = fmin(best, e);
                }
            bool separable = phys_integrators[k]->separable && strcmp(problem, "dblpend") == 0;
            if (separable)
                assert_int_equal(rows, 0);
            else if (strcmp(problem, "pendulum") == 0 && strcmp(method, "euler") != 0)
                assert_true(rows > 0 && (rows < 3 || best < first / 4));
        }
}

static void test_integrators(void **state)
{
    (void)state;
    static const char header[] = "problem,method,knob,setting,steps,evaluations,seconds,error";
    assert_int_equal(shell("$LA chart integrators --quick --quiet --out ."), 0);
    struct table *t = table_read("integrators.csv");
    expect_header(t, header);
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
        if (!is(t, r, "method", method))
            continue;
        double periods = number(t, r, "periods"), e = number(t, r, "error");
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
    expect_header(t, "method,symplectic,setting,periods,error");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(number(t, r, "error") > 0);
    check_drift(t, "verlet", true);
    check_drift(t, "yoshida4", true);
    check_drift(t, "yoshida6", true);
    check_drift(t, "rk4", false);
    check_drift(t, "dop853", false);
    table_free(t);
}

static void test_integrator_files(void **state)
{
    (void)state;
    static const char *const names[] = {"integrators.csv",
                                        "drift.csv",
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
        if (is(t, r, "scene", scene) && is(t, r, "rule", rule) && is(t, r, "solver", "newton")) {
            double e = number(t, r, "error"), n = number(t, r, "slices") - 1;
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
        if (is(t, r, "scene", scene) && is(t, r, "solver", solver))
            error = number(t, r, "error");
    return error;
}

static void test_rules(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart paths --quick --quiet --out ."), 0);
    struct table *t = table_read("rules.csv");
    expect_header(t, "scene,solver,rule,slices,seconds,error");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(number(t, r, "seconds") > 0 && number(t, r, "error") > 0);
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
    expect_header(t, "scene,solver,step,seconds,error");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(number(t, r, "seconds") >= 0 && number(t, r, "error") >= 0);
    for (size_t k = 0; k < 4; k++) {
        assert_true(last_error(t, scenes[k], "Newton") < 1e-12);
        double adam = last_error(t, scenes[k], "Adam as published");
        assert_true(adam > 1e-4 && adam < 0.2); /* it stays where the published one does */
    }
    table_free(t);
}

static void test_gradients(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart gradients --quick --quiet --out ."), 0);
    struct table *t = table_read("gradients.csv");
    assert_int_equal(t->rows, HAND_N);
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(number(t, r, "tape_gradient_ns") > 0);
        assert_true(number(t, r, "hand_gradient_ns") > 0);
        assert_true(number(t, r, "tape_product_ns") > 0);
        assert_true(number(t, r, "hessian_blocks_ns") > 0);
        assert_true(number(t, r, "disagreement") < 1e-11);
        assert_true(number(t, r, "second_disagreement") < 1e-11);
    }
    table_free(t);
}

/* Three bodies moved together have the same action: their gradient adds up to nothing, and so do
   the second derivatives times any vector. */
static void test_gradient_values(void **state)
{
    (void)state;
    static const char *const names[] = {"gradient", "product"};
    struct table *t = table_read("gradients-values.csv");
    expect_header(t, "scene,coordinate,slice,x,u,gradient,product,adam");
    for (size_t k = 0; k < 2; k++) {
        double sum = 0, largest = 0;
        for (size_t r = 0; r < t->rows; r++) {
            double value = number(t, r, names[k]);
            if (is(t, r, "scene", "threebody")) {
                sum += value;
                largest = fmax(largest, fabs(value));
            }
        }
        assert_true(largest > 0);
        assert_close(sum, 0, 0, 1e-13 * 600 * largest);
    }
    table_free(t);
}

/* Bytes a slice, and a pair, do not rise with their number. */
static void test_linear(void **state)
{
    (void)state;
    static const char *const names[] = {"program_bytes", "tape_bytes"};
    assert_int_equal(shell("$LA chart linear --quick --quiet --out ."), 0);
    struct table *t = table_read("linear.csv");
    assert_int_equal(t->rows, 3 + 4); /* of slices, of bodies */
    for (size_t r = 1; r < t->rows; r++) {
        double factor = number(t, r, "units") / number(t, r - 1, "units");
        if (strcmp(t->cell[r][0], t->cell[r - 1][0]) != 0)
            continue;
        assert_true(factor > 1);
        for (size_t k = 0; k < 2; k++)
            assert_true(number(t, r, names[k]) < 1.05 * factor * number(t, r - 1, names[k]));
        assert_true(number(t, r, "interpreted_seconds") > 0);
        assert_true(number(t, r, "compiled_seconds") > 0);
    }
    table_free(t);
}

/* Newton ends on the stationary path, where the published descent is not. */
static void test_jobs(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart jobs --quick --quiet --out ."), 0);
    struct table *t = table_read("jobs.csv");
    size_t paths = 0;
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(number(t, r, "published_seconds") > 0 && number(t, r, "our_seconds") > 0);
        if (!is(t, r, "group", "path"))
            continue;
        paths++;
        assert_true(number(t, r, "published_error") > 1e-4);
        assert_true(number(t, r, "our_error") < 1e-12);
        assert_true(number(t, r, "level_seconds") <= number(t, r, "our_seconds"));
    }
    assert_int_equal(paths, 5);
    table_free(t);
}

static void test_hnn_steps(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart hnn --quick --quiet --out ."), 0);
    struct table *t = table_read("hnn-steps.csv");
    assert_int_equal(t->rows, 2 * 2 * 2); /* kinds, precisions, threads */
    for (size_t r = 0; r < t->rows; r++) {
        assert_true(number(t, r, "step_ms") > 0 && number(t, r, "field_us") > 0);
        assert_true(number(t, r, "blas_share") > 0 && number(t, r, "blas_share") < 1);
        assert_true(number(t, r, "products_ms") > 0 && number(t, r, "activation_ms") > 0);
    }
    table_free(t);
}

/* How many steps fit into the time is the machine's; where a number of steps leads is not. */
static double loss_after(const struct table *t, const char *model, const char *type, double step)
{
    for (size_t r = 0; r < t->rows; r++)
        if (is(t, r, "model", model) && is(t, r, "precision", type) && number(t, r, "step") == step)
            return number(t, r, "test_loss");
    print_error("no row of %s in %s after %g steps\n", model, type, step);
    fail();
    return NAN;
}

static void test_hnn_learning(void **state)
{
    (void)state;
    struct table *t = table_read("hnn-learning.csv");
    expect_header(t, "model,precision,width,step,seconds,test_loss,energy_mse");
    for (size_t r = 0; r < t->rows; r++)
        assert_true(number(t, r, "seconds") > 0 && number(t, r, "energy_mse") > 0);
    static const char *const models[] = {"hnn", "baseline"};
    for (size_t k = 0; k < 2; k++)
        assert_close(loss_after(t, models[k], "f32", 4), loss_after(t, models[k], "f64", 4), 1e-3,
                     0);
    table_free(t);
}

static double least_rollout_error(const struct table *t, const char *type)
{
    double least = INFINITY;
    for (size_t r = 0; r < t->rows; r++)
        if (is(t, r, "precision", type))
            least = fmin(least, number(t, r, "error"));
    return least;
}

/* The roundings of f32, 6e-8, add up over hundreds of steps; f64 goes on to the reference. */
static void test_hnn_rollouts(void **state)
{
    (void)state;
    struct table *t = table_read("hnn-rollouts.csv");
    expect_header(t, "method,precision,setting,evaluations,seconds,error");
    assert_true(least_rollout_error(t, "f64") < 1e-9);
    assert_true(least_rollout_error(t, "f32") > 1e-9 && least_rollout_error(t, "f32") < 1e-4);
    double error[2] = {NAN, NAN}, dt[2] = {NAN, NAN}; /* of the two finest */
    for (size_t r = 0; r < t->rows; r++)
        if (is(t, r, "method", "rk4") && is(t, r, "precision", "f64")) {
            error[0] = error[1], dt[0] = dt[1];
            error[1] = number(t, r, "error"), dt[1] = number(t, r, "setting");
        }
    assert_close(log(error[0] / error[1]) / log(dt[0] / dt[1]), 4, 0, 0.5);
    table_free(t);
}

static void test_hnn_files(void **state)
{
    (void)state;
    static const char *const names[] = {"hnn-steps.csv", "hnn-learning.csv", "hnn-learning.svg",
                                        "hnn-rollouts.csv", "hnn-rollouts.svg"};
    if (!gnuplot()) {
        print_message("gnuplot is not installed\n");
        skip();
    }
    expect_files(sizeof names / sizeof *names, names);
}

static void test_wrong_format(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA chart paths --format pdf --out new"), 2);
    assert_string_equal(shell_err(),
                        "leastaction chart: --format: expected svg or png, got 'pdf'\n");
    assert_int_equal(shell_files(), 0);
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
        cmocka_unit_test_setup(test_wrong_format, shell_empty),
        cmocka_unit_test_setup(test_gradients, shell_empty),
        cmocka_unit_test(test_gradient_values),
        cmocka_unit_test_setup(test_linear, shell_empty),
        cmocka_unit_test_setup(test_jobs, shell_empty),
        cmocka_unit_test_setup(test_hnn_steps, shell_empty),
        cmocka_unit_test(test_hnn_learning),
        cmocka_unit_test(test_hnn_rollouts),
        cmocka_unit_test(test_hnn_files),
        cmocka_unit_test_setup(test_integrators, shell_empty),
        cmocka_unit_test(test_drift),
        cmocka_unit_test(test_integrator_files),
        cmocka_unit_test_setup(test_rules, shell_empty),
        cmocka_unit_test(test_solvers),
    };
    return cmocka_run_group_tests_name("charts", tests, shell_setup, shell_teardown);
}
