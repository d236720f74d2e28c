/* Messages of the command for the failures in this folder: what failed, where, what to try. */
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

static const struct {
    const char *arguments;
    int status;
    const char *says; /* on standard error, but not with --quiet where the status is 0 */
} cases[] = {
    {"spring --integrator verlet --dt 2.001 --time 20010 --no-reference", 0,
     "2.001 q 2 verlet 0.3* energy"},
    {"spring --integrator rk4 --dt 2.829 --time 2829", 0, "2.82843 rk4 dop853"},
    {"spring --integrator euler --dt 0.01 --time 10", 0, "euler 1.03 period verlet"},
    {"cubic --integrator verlet --dt 1.7320508 --set q0=0.01 --time 3000", 1,
     "resonance step 8* finite x"},
    {"kepler --set e=0.99 --integrator verlet --dt 0.00628 --time 6.28", 0, "0.002 verlet dop853"},
    {"fall --time 2", 1, "step t 1.11072073* velocity x collision"},
    {"dimer --integrator verlet --dt 0.19 --time 95", 0, "0.19 x* verlet"},
    {"dimer --set r0=0", 2, "r0 0 distance"},
    {"dblpend --time 60 --horizon 1e-9", 0, "chaotic 3.07 3.18 t 50"},
    {"dblpend --integrator verlet --dt 0.01", 2, "dblpend verlet gauss2"},
};

enum { N_CASES = sizeof cases / sizeof *cases };

static void each_failure_is_told_in_words(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_CASES; k++) {
        int status = shell("$LA simulate %s --json", cases[k].arguments);
        if (status != cases[k].status)
            print_error("simulate %s: %s", cases[k].arguments, shell_err());
        assert_int_equal(status, cases[k].status);
        assert_mentions(shell_err(), cases[k].says);
        if (status == 0)
            assert_mentions(shell_last_line(), cases[k].says);
    }
}

static void quiet_runs_keep_warnings_for_json(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA simulate %s --quiet --json", cases[0].arguments), 0);
    assert_string_equal(shell_err(), "");
    assert_mentions(shell_last_line(), cases[0].says);
}

static void good_runs_are_not_warned_of(void **state)
{
    (void)state;
    static const char *const good[] = {
        "spring --integrator verlet --dt 0.1",    "spring --integrator rk4 --dt 0.1",
        "kepler --integrator yoshida4 --dt 0.01", "kepler --set e=0.99 --time 6.28",
        "cubic --integrator implicit-midpoint",   "dimer --integrator verlet --dt 0.02",
        "dblpend --integrator gauss2 --dt 0.01",  "pendulum --integrator verlet",
        "kepler --horizon 1e-9 --time 60",        "ephemeris --integrator verlet",
    };
    for (size_t k = 0; k < sizeof good / sizeof *good; k++) {
        assert_int_equal(shell("$LA simulate %s --json", good[k]), 0);
        assert_string_equal(shell_err(), "");
        assert_mentions(shell_last_line(), "\"warnings\": []");
    }
}

/* After the horizon the error is as large as the motion, whatever the method; before, it is not. */
static void errors_are_compared_before_the_horizon(void **state)
{
    (void)state;
    assert_int_equal(
        shell("$LA simulate dblpend --tol 1e-11 --integrator dop853 --time 80 --horizon 1e-9 --json"
              " --quiet"),
        0);
    assert_mentions(shell_last_line(), "\"chaotic\": true");
    assert_true(shell_number("lyapunov_exponent") > 0.3 && shell_number("lyapunov_exponent") < 0.4);
    assert_true(shell_number("horizon") > 46 && shell_number("horizon") < 53);
    const char *key = "\"error_before_horizon\": ", *at = strstr(shell_last_line(), key);
    const char *whole = strstr(shell_last_line(), "\"error\": ");
    assert_true(at && whole);
    assert_true(strtod(at + strlen(key), NULL) < 0.01);
    assert_true(strtod(whole + strlen("\"error\": "), NULL) > 0.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_failure_is_told_in_words),
        cmocka_unit_test(quiet_runs_keep_warnings_for_json),
        cmocka_unit_test(good_runs_are_not_warned_of),
        cmocka_unit_test(errors_are_compared_before_the_horizon),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
