/* leastaction fit: known motions, and the measured ones of tests/data. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Value and deviation of an unknown of the last line. */
static void unknown(const char *name, double *value, double *deviation)
{
    char key[80];
    snprintf(key, sizeof key, "\"name\": \"%s\"", name);
    const char *at = strstr(shell_last_line(), key);
    assert_non_null(at);
    assert_non_null(at = strstr(at, "\"value\": "));
    *value = strtod(at + 9, NULL);
    assert_non_null(at = strstr(at, "\"deviation\": "));
    *deviation = strtod(at + 13, NULL);
}

static double number(const char *key)
{
    char quoted[80];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(shell_last_line(), quoted);
    assert_non_null(at);
    return strtod(at + strlen(quoted), NULL);
}

static void a_simulated_motion_is_found_again(void **state)
{
    double value, deviation;
    (void)state;
    shell_works(
        "$LA simulate spring --set k=3 --set damping=0.1 --time 9 --samples 40 --csv m.csv");
    shell_works("$LA fit spring m.csv --free k,damping --json --csv fit.csv --out fit.h5");
    unknown("k", &value, &deviation);
    assert_close(value, 3, 1e-7, 0);
    unknown("damping", &value, &deviation);
    assert_close(value, 0.1, 1e-6, 0);
    shell_works("$LA dump fit.h5");
    shell_works("$LA fit spring m.csv --free k,damping --fixed-start --columns q=2 --json");
    unknown("k", &value, &deviation);
    assert_close(value, 3, 1e-7, 0);
}

/* Measured: length for g = 9.81 in its unit of time, damping; the last fifth is predicted. */
static void the_measured_pendulum_has_a_length(void **state)
{
    double value, deviation;
    (void)state;
    shell_works("$LA fit pendulum $ROOT/tests/data/schmidt-lipson/real_pend_h_1.txt --columns "
                "theta=o,v_theta=v --set g=9.81 --set l=5 --free l,damping --hold-out 0.2 --json");
    unknown("l", &value, &deviation);
    assert_close(value, 7.33, 0.005, 0);
    assert_true(deviation > 1e-4 && deviation < 0.01);
    unknown("damping", &value, &deviation);
    assert_close(value, 0.013, 0.03, 0);
    assert_true(number("held_rms") < 2 * number("rms"));
    assert_int_equal(
        shell("$LA fit pendulum $ROOT/tests/data/schmidt-lipson/real_pend_h_1.txt --columns "
              "theta=o,v_theta=v --set g=9.81 --set l=7 --free l,g --tries 1 --hold-out 0.8"),
        1);
    assert_mentions(shell_err(), "l, g apart");
}

static void the_measured_spring_is_linear(void **state)
{
    double value, deviation;
    (void)state;
    shell_works("$LA fit spring $ROOT/tests/data/schmidt-lipson/linear_h_1.txt --columns "
                "q=x,v_q=v --free k,damping,rest --hold-out 0.2 --tries 1 --json");
    unknown("k", &value, &deviation);
    assert_close(value, 3.001, 1e-3, 0);
    unknown("damping", &value, &deviation);
    assert_close(value, 0.1, 0.01, 0);
    assert_true(number("held_rms") < 2 * number("rms"));
    assert_true(number("autocorrelation") > 0.5); /* its noise is not independent */
}

static void what_does_not_move_tells_nothing(void **state)
{
    (void)state;
    shell_works("awk 'BEGIN { print \"t,theta\"; for (i = 0; i < 50; i++) print i / 10 \",0.5\" }' "
                ">still.csv");
    assert_int_equal(shell("$LA fit pendulum still.csv --free l --tries 1"), 1);
    assert_mentions(shell_err(), "do not change");
}

static void misuse_is_refused(void **state)
{
    (void)state;
    shell_works("$LA simulate spring --time 9 --samples 40 --csv m.csv");
    assert_int_equal(shell("$LA fit spring m.csv --free kk"), 2);
    assert_mentions(shell_err(), "kk");
    assert_int_equal(shell("$LA fit spring m.csv --free k --columns q=nobody"), 2);
    assert_mentions(shell_err(), "nobody");
    assert_int_equal(shell("$LA fit pendulum m.csv --free l"), 2);
    assert_mentions(shell_err(), "theta");
    assert_int_equal(shell("$LA fit spring m.csv --free k --noise q=-1"), 2);
    assert_int_equal(shell("$LA fit threebody m.csv --free cap_radius --columns x1=q"), 2);
    assert_mentions(shell_err(), "PHYS_PARAM");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_simulated_motion_is_found_again, shell_empty),
        cmocka_unit_test_setup(the_measured_pendulum_has_a_length, shell_empty),
        cmocka_unit_test_setup(the_measured_spring_is_linear, shell_empty),
        cmocka_unit_test_setup(what_does_not_move_tells_nothing, shell_empty),
        cmocka_unit_test_setup(misuse_is_refused, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
