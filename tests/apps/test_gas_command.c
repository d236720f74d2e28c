/* The gas from outside: states distinguished, pictures drawn, wrong parameters refused. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <string.h>

#define COMMON                                                                                     \
    "simulate gas --integrator verlet --set bodies=150 --set cutoff=3 --set walls=.01 --json "

static const char *end_order(void)
{
    const char *order = strstr(shell_last_line(), "\"order_end\": {");
    assert_non_null(order);
    return order;
}

static void test_states(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA " COMMON
                           "--set bodies=600 --set spacing=.08 --set speed=8e-3 --dt .1 "
                           "--time 150"),
                     0);
    assert_non_null(strstr(end_order(), "\"state\": \"gas-like\"}"));
    assert_true(shell_number_in("order_end", "neighbours") < 1.5);
    assert_true(shell_number_in("order_end", "peak") <
                4); /* of one moment: 150 bodies show 2 to 4.2 */
    assert_true(shell_number("energy_drift") < 0.02);
    assert_int_equal(shell("$LA " COMMON "--set spacing=.06 --set speed=4e-3 --set friction=.01 "
                           "--dt .2 --time 700"),
                     0);
    assert_non_null(strstr(end_order(), "\"state\": \"solid-like\"}"));
    assert_true(shell_number_in("order_end", "neighbours") > 4.3);
    assert_true(shell_number_in("order_end", "peak") > 8);
    /* in the crystal neighbours are where their pair's energy is least */
    assert_close(shell_number_in("order_end", "peak_at"), 0.04 * pow(2, 1 / 6.0), 0.03, 0);
}

static void test_pictures(void **state)
{
    (void)state;
    if (shell("command -v gnuplot") != 0) {
        print_message("skipped: no gnuplot\n");
        skip();
    }
    shell_clean();
    assert_int_equal(shell("$LA simulate gas --set bodies=120 --set cutoff=3 --integrator verlet "
                           "--dt .2 --time 20 --samples 5 --plot a.gif --quiet"),
                     0);
    assert_int_equal(
        shell("$LA simulate gas --integrator verlet --set bodies=20 --time 1 --plot a.png"), 0);
    assert_int_equal(shell_files(), 2);
}

static void test_refusals(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA simulate gas --set bodies=9000 --integrator verlet"), 2);
    assert_mentions(shell_err(), "cutoff");
    assert_int_equal(shell("$LA simulate gas --set cutoff=-2"), 2);
    assert_int_equal(shell("$LA simulate gas --set bodies=2.5"), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_states),
        cmocka_unit_test(test_pictures),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
