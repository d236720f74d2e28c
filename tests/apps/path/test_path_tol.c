/* leastaction path --tol, from outside: on motions with known solutions the estimated error is true
   to a factor of ten, and the error is what was asked for. */
#include "tests/close.h"
#include "tests/apps/shell.h"
#include "apps/bench/measure/motions.h"
#include "physics/io/csv.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- known answers: q at time t ---- */

static void spring(double t, double *q) { q[0] = cos(t) + 0.3 * sin(t); }

static void freebody(double t, double *q) { q[0] = 8 * t - t * t / 2; }

static void kepler(double t, double *q)
{
    double v[2];
    exact_kepler(0.6, t, q, v);
}

static void pendulum(double t, double *q)
{
    double v[1];
    exact_pendulum(0.8, t, q, v);
}

static const struct known {
    const char *run;
    void (*at)(double t, double *q);
} known[] = {
    {"spring --set v0=0.3", spring},
    {"spring --set v0=0.3 --dt 0.05", spring},
    {"freebody", freebody},
    {"kepler --init ode --dt 0.02", kepler},
    {"kepler --init ode --dt 0.05", kepler},
    {"pendulum --init ode --set theta0=0 --set rate0=1.6 --set l=1 --dt 0.025", pendulum},
    {"pendulum --init ode --set theta0=0 --set rate0=1.6 --set l=1 --dt 0.09", pendulum},
};

/* Largest error of a coordinate of the path in found.csv. */
static double largest_error(const struct known *answer)
{
    size_t rows, columns;
    double *values, q[2], most = 0, dt = shell_number("dt");
    struct ad_error error = {0};
    assert_int_equal(phys_table_read(shell_path("found.csv"), &rows, &columns, &values, &error),
                     AD_OK);
    assert_true((double)rows == shell_number("slices"));
    for (size_t i = 0; i < rows; i++) {
        answer->at((double)i * dt, q);
        assert_close(values[i * columns], (double)i * dt, 1e-12, 0);
        for (size_t k = 1; k < columns; k++)
            most = fmax(most, fabs(values[i * columns + k] - q[k - 1]));
    }
    free(values);
    return most;
}

static void holds(const struct known *answer, const char *rule, double tolerance)
{
    char command[256];
    snprintf(command, sizeof command, "$LA path %s %s --tol %g --csv found.csv --json", answer->run,
             rule, tolerance);
    shell_works("%s", command);
    double error = largest_error(answer), estimate = shell_number("error_estimate");
    print_message("%-75s %s %.0e: %3.0f slices, estimate %.1e, error %.1e\n", answer->run, rule,
                  tolerance, shell_number("slices"), estimate, error);
    assert_true(estimate < tolerance);
    assert_true(error < tolerance);
    assert_true(error <= 10 * estimate);
}

static void test_estimate_is_honest(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        for (double tolerance = 1e-3; tolerance > 1e-10; tolerance *= 1e-3)
            holds(&known[k], "", tolerance);
}

/* With a rule given, elements alone are doubled; each rule on a third of the motions. */
static void test_rule_stays(void **state)
{
    (void)state;
    static const struct {
        const char *rule;
        double tolerance;
    } cases[] = {{"left", 1e-2},   {"midpoint", 1e-4}, {"trapezoid", 1e-4},
                 {"gauss2", 1e-7}, {"gauss3", 1e-9},   {"gauss6", 1e-10}};
    char option[32], written[32];
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
        for (size_t k = c % 3; k < sizeof known / sizeof *known; k += 3) {
            snprintf(option, sizeof option, "--rule %s", cases[c].rule);
            snprintf(written, sizeof written, "\"rule\": \"%s\"", cases[c].rule);
            holds(&known[k], option, cases[c].tolerance);
            assert_non_null(strstr(shell_last_line(), written));
        }
}

/* A looser tolerance never takes more work; the reason is told. */
static void test_least_that_will_do(void **state)
{
    (void)state;
    double before = 0;
    for (double tolerance = 1e-2; tolerance > 1e-11; tolerance /= 10) {
        char command[128];
        snprintf(command, sizeof command,
                 "$LA path kepler --init ode --dt 0.02 --rule gauss4 "
                 "--tol %g --json",
                 tolerance);
        shell_works("%s", command);
        assert_true(shell_number("slices") >= before);
        before = shell_number("slices");
    }
    assert_true(before > 17);
    shell_works("$LA path spring --tol 1e-6");
    assert_mentions(shell_out(), "chosen: 8 gauss4 1e-06");
    shell_works("$LA path spring --tol 1e-6 --json");
    assert_mentions(shell_last_line(), "\"chosen\": 8 gauss4");
}

/* The ends of a file are kept to the last digit, whatever lies between them. */
static void test_ends_of_a_file(void **state)
{
    (void)state;
    size_t rows, columns;
    double *values;
    struct ad_error error = {0};
    shell_works("printf 'x\\n0.1\\n0.7\\n-0.4\\n0.3\\n' > start.csv");
    shell_works(
        "$LA path spring --init start.csv --slices 4 --dt 0.5 --tol 1e-8 --csv found.csv --json");
    assert_int_equal(phys_table_read(shell_path("found.csv"), &rows, &columns, &values, &error),
                     AD_OK);
    double T = 1.5, b = (0.3 - 0.1 * cos(T)) / sin(T);
    assert_true(columns == 2 && values[1] == 0.1 && values[2 * rows - 1] == 0.3);
    for (size_t i = 0; i < rows; i++) {
        double t = (double)i * T / (double)(rows - 1);
        assert_close(values[2 * i + 1], 0.1 * cos(t) + b * sin(t), 0, 1e-8);
    }
    free(values);
}

/* Each level finds another of several paths from the guess: the climb goes on with one of them. */
static void test_one_of_several(void **state)
{
    (void)state;
    size_t rows[2], columns;
    double *values[2], worst = 0;
    struct ad_error error = {0};
    for (int k = 0; k < 2; k++) {
        shell_works("$LA path dblpend --tol %s --csv found.csv --json --quiet",
                    k ? "1e-9" : "1e-6");
        assert_true(shell_number("discretisation_error") < (k ? 1e-9 : 1e-6));
        assert_int_equal(
            phys_table_read(shell_path("found.csv"), &rows[k], &columns, &values[k], &error),
            AD_OK);
        assert_int_equal(columns, 3);
    }
    size_t each = (rows[1] - 1) / (rows[0] - 1);
    for (size_t i = 0; i < rows[0]; i++)
        for (size_t c = 1; c < columns; c++)
            worst =
                fmax(worst, fabs(values[0][i * columns + c] - values[1][i * each * columns + c]));
    assert_true(worst > 0 && worst < 1e-6);
    free(values[0]);
    free(values[1]);
}

/* From a line elements hold a path through a collision until they are fine: the climb begins again
   after descents, and doubles none. */
static void test_through_a_collision(void **state)
{
    (void)state;
    shell_works("$LA path figure8 --time 2 --tol 1e-6 --json --quiet");
    assert_true(shell_number("slices") <= 65);
    assert_true(shell_number("true_distance") < 1e-6);
    assert_close(shell_number("action"), 7.737998331865, 0, 1e-8);
    shell_works("$LA path figure8 --time 2.1 --tol 1e-6 --json --quiet");
    assert_true(shell_number("true_distance") < 1e-6);
}

/* Few elements of high order part from it, more do not; nearer to the centre a line leads through
   it, and the motion, which the ends are of, is the start. */
static void test_past_a_centre(void **state)
{
    (void)state;
    shell_works("$LA path kepler --set e=.95 --tol 1e-8 --json --quiet");
    assert_true(shell_number("slices") <= 257);
    assert_true(shell_number("true_distance") < 1e-8);
    assert_close(shell_number("action"), 1.5 * M_PI, 0, 1e-8);
    shell_works("$LA path kepler --set e=.999 --tol 1e-8 --json --quiet");
    assert_mentions(shell_last_line(), "\"along_motion\": true");
    assert_true(shell_number("discretisation_error") < 1e-8);
    assert_true(shell_number("max_error") < 1e-8);
    assert_close(shell_number("action"), 1.5 * M_PI, 0, 1e-8);
    assert_int_equal(shell("$LA path kepler --set e=.999 --tol 1e-8 --init line --quiet"), 1);
    assert_mentions(shell_err(), "singular");
    /* the grid alone holds it: no motion is near, and its error is not that of a finer grid */
    assert_int_equal(shell("$LA path kepler --set e=.98 --json --quiet"), 1);
    assert_mentions(shell_err(), "singularity");
    assert_true(shell_number("discretisation_error") > 0.19);
    assert_int_equal(shell("$LA path kepler --set e=.98 --solver lbfgs --quiet"), 1);
    assert_mentions(shell_err(), "passes a singularity between two slices");
    assert_int_equal(shell("$LA path kepler --start x=1,y=0 --end=x=-1,y=0 --time 3 --slices 51 "
                           "--rule gauss4 --json --quiet"),
                     1);
    assert_mentions(shell_last_line(), "\"no_morse_index\": singularity");
    assert_null(strstr(shell_last_line(), "\"second_variation\""));
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        int status;
        const char *arguments, *message;
    } cases[] = {
        {2, "spring --tol 0", "--tol 0"},
        {2, "spring --tol nan", "--tol"},
        {2, "pendulum --tol 1e-3 --preset paper", "--tol --preset"},
        {2, "spring --tol 1e-3 --all", "--tol --all"},
        {2, "spring --tol 1e-3 --energy 1", "--tol --all --energy"},
        {2, "spring --tol 1e-3 --ends start", "--tol --ends"},
        {2, "spring --tol 1e-3 --hold 2", "--tol --hold"},
        {2, "spring --tol 1e-3 --grad-tol 0.1", "--tol --grad-tol"},
        {2, "spring --tol 1e-3 --solver adam", "--tol --solver newton adam"},
        {2, "spring --tol 1e-3 --lr 0.1", "--tol --solver newton adam"},
        {1, "spring --tol 1e-17", "rounding"},
        {1, "kepler --init ode --dt 0.5 --tol 1e-12", "ends known"},
        {1, "kepler --init ode --dt 0.02 --rule left --tol 1e-8", "--tol 1e-08 16384 left"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        int status = shell("$LA path %s --csv x.csv", cases[k].arguments);
        if (status != cases[k].status)
            print_error("%s: exit %d, %s", cases[k].arguments, status, shell_err());
        assert_int_equal(status, cases[k].status);
        assert_mentions(shell_err(), cases[k].message);
        assert_string_equal(shell_out(), "");
        assert_int_equal(shell_files(), 0);
    }
}

static double *table_of(const char *name, size_t *n)
{
    size_t rows, columns;
    double *values;
    struct ad_error error = {0};
    assert_int_equal(phys_table_read(shell_path(name), &rows, &columns, &values, &error), AD_OK);
    *n = rows * columns;
    return values;
}

/* H4: here distances fall faster from level to level than the rule's order, which promised 1.1e-10
   where 6.8e-9 was true; the rule of higher order sends it on. */
static void test_a_fall_that_is_too_fast(void **state)
{
    (void)state;
    shell_works("printf '0.34065175956363225,-0.11476133927267451\n"
                "0.71687989907944893,-0.99668865431139486\n"
                "1.0931080385952656,-1.8786159693501152\n' >ends.csv");
    shell_works("$LA path dblpend --init ends.csv --slices 3 --dt 1.48718891734734115 "
                "--tol 1e-9 --csv found.csv --json");
    double estimate = shell_number("error_estimate"), most = 0;
    char command[128];
    snprintf(command, sizeof command,
             "$LA path dblpend --init found.csv --rule gauss12 --slices %.0f --dt %.17g",
             shell_number("slices"), shell_number("dt"));
    assert_true(shell_number("discretisation_error") < estimate && estimate < 1e-9);
    assert_true(shell_number("true_distance") < 1e-8);
    shell_works("%s --csv finer.csv", command);
    size_t n, m;
    double *found = table_of("found.csv", &n), *finer = table_of("finer.csv", &m);
    assert_int_equal(n, m);
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(found[k] - finer[k]));
    assert_true(most > 0 && most < estimate);
    free(found);
    free(finer);
}

/* L without a mass has no motion, whatever gives the ends. */
static void test_no_mass(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *fault;
    } cases[] = {{"spring --set m=0", "m=0:"},
                 {"spring --set k=2 --set m=0 --init ends.csv --slices 3 --dt 0.1", "m=0:"},
                 {"dblpend --set m2=0 --ends start", "m2=0:"},
                 {"pendulum --set l=0 --tol 1e-6", "l=0:"},
                 {"gas --set m=0", "m=0:"}};
    shell_works("printf '0\n.1\n.2\n' >ends.csv");
    for (size_t k = 0; k < LENGTH(cases); k++) {
        assert_int_equal(shell("$LA path %s", cases[k].arguments), 2);
        assert_mentions(shell_err(), cases[k].fault);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_estimate_is_honest, shell_empty),
        cmocka_unit_test_setup(test_rule_stays, shell_empty),
        cmocka_unit_test_setup(test_least_that_will_do, shell_empty),
        cmocka_unit_test_setup(test_ends_of_a_file, shell_empty),
        cmocka_unit_test_setup(test_a_fall_that_is_too_fast, shell_empty),
        cmocka_unit_test_setup(test_no_mass, shell_empty),
        cmocka_unit_test_setup(test_one_of_several, shell_empty),
        cmocka_unit_test_setup(test_through_a_collision, shell_empty),
        cmocka_unit_test_setup(test_past_a_centre, shell_empty),
        cmocka_unit_test_setup(test_refusals, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
