/* path --blocks, what ranks do, on one: the path of the solver of one process, in CSV and HDF5. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "tests/apps/shell.h"

#include <stdio.h>
#include <stdlib.h>

static void test_same_path(void **state)
{
    (void)state;
    static const char *const starts[] = {"--init ode",
                                         "--start theta=1 --end theta=-0.5 --time 30"};
    for (size_t k = 0; k < LENGTH(starts); k++) {
        const char *names[] = {"action", "grad_norm", "morse_index", "energy", "energy_drift"};
        double plain[LENGTH(names)], distance;
        shell_works("$LA path pendulum --rule gauss2 %s --csv plain.csv --json", starts[k]);
        for (size_t i = 0; i < LENGTH(names); i++)
            plain[i] = shell_number(names[i]);
        shell_works("$LA path pendulum --rule gauss2 %s --blocks --csv blocks.csv --out blocks.h5 "
                    "--json",
                    starts[k]);
        for (size_t i = 0; i < LENGTH(names); i++)
            assert_close(shell_number(names[i]), plain[i], 1e-9, 1e-11);
        shell_works(
            "paste -d, plain.csv blocks.csv | awk -F, 'NR > 1 { d = $2 - $4; "
            "if (d < 0) d = -d; if (d > m) m = d; t += $1 != $3 } END { print m + t, NR }'");
        int rows;
        assert_int_equal(sscanf(shell_out(), "%lf %d", &distance, &rows), 2);
        assert_true(distance < 1e-11 && rows == 101);
        shell_works("$LA dump blocks.h5 --dataset slices --csv h5.csv");
        shell_works("tail -n +2 blocks.csv | cut -d, -f2 | paste -d, - h5.csv | "
                    "awk -F, '$1 != $2 { m++ } END { print m + 0, NR }'");
        assert_string_equal(shell_out(), "0 100\n");
    }
}

static void test_refused(void **state)
{
    (void)state;
    static const struct {
        const char *options, *mentions;
    } rows[] = {{"--tol 1e-6", "--tol blocks"},
                {"--plot x.svg", "--plot blocks"},
                {"--all", "--all blocks"},
                {"--init x.csv", "--init x.csv line ode"},
                {"--start theta=1 --end theta=free", "free ends blocks"},
                {"--rule left+repeat", "left+repeat"}};
    for (size_t k = 0; k < LENGTH(rows); k++) {
        assert_int_equal(shell("$LA path pendulum --blocks %s --csv none.csv", rows[k].options), 2);
        assert_mentions(shell_err(), rows[k].mentions);
    }
    assert_int_equal(shell("test -e none.csv"), 1);
}

static void test_not_converged(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA path dblpend --blocks --adam-steps 0 --steps 1 --json"), 1);
    assert_mentions(shell_err(), "not converged");
    assert_mentions(shell_out(), "no_morse_index");
}

/* The action has no least value there: searches of lines go on to 1e291. */
static void test_that_runs_away(void **state)
{
    (void)state;
    static const char *const ways[] = {"", "--blocks"};
    for (size_t k = 0; k < LENGTH(ways); k++) {
        assert_int_equal(
            shell("$LA path sine-gordon --set sites=40 --solver lbfgs %s --csv none.csv", ways[k]),
            1);
        assert_mentions(shell_err(), "ran away");
    }
    assert_int_equal(shell("test -e none.csv"), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_same_path, shell_empty),
        cmocka_unit_test_teardown(test_refused, shell_empty),
        cmocka_unit_test_teardown(test_not_converged, shell_empty),
        cmocka_unit_test_teardown(test_that_runs_away, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
