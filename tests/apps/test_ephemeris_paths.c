/* A18: for every window, the path between two epochs of Horizons tables is that of the tables'
   motion, or the exit status is not 0. */
#include "shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdio.h>

/* Tables of three years, from a motion with relativity: headers of the real ones, rows of ours. */
static int setup(void **state)
{
    if (shell_setup(state) != 0)
        return -1;
    return shell(
        "mkdir -p ../years && $LA simulate ephemeris --set relativity=1 --time 94694400 "
        "--samples 1096 --integrator dop853 --tol 1e-12 --no-reference --csv ../years/rows "
        "--quiet\n"
        "k=1; for body in sun mercury venus earth mars; do\n"
        "  { sed '/SOE/q' \"$ROOT/tests/data/horizons/$body.txt\"\n"
        "    awk -F, -v k=$k 'NR > 1 {\n"
        "      for (i = 0; i < 6; i++)\n"
        "        x[i] = $(2 + 15 * int(i / 3) + 3 * (k - 1) + i %% 3) / 1000\n"
        "      printf \"%%.9f = A.D. 2022-Jul-14 00:00:00.0000 TDB\\n\"\\\n"
        "        \" X =%%.15E Y =%%.15E Z =%%.15E\\n VX=%%.15E VY=%%.15E VZ=%%.15E\\n\"\\\n"
        "        \" LT= 0 RG= 0 RR= 0\\n\", 2459774.5 + NR - 2, x[0], x[1], x[2], x[3],\\\n"
        "        x[4], x[5] }\n"
        "      END { print \"$$EOE\" }' ../years/rows; } > ../years/$body.txt\n"
        "  k=$((k + 1)); done; rm ../years/rows");
}

static const char real[] = "\"$ROOT/tests/data/horizons\"", years[] = "../years";

/* What it came to by default, and how far it is from the table. */
static void test_default_is_the_table_s_path(void **state)
{
    static const struct {
        const char *data, *options;
        double most; /* m; the model lacks the Moon: some thousand km of the Earth */
    } rows[] = {
        {real, "--rule gauss3", 2e7},
        {real, "", 2e9},
        {real, "--rule gauss2 --from 100 --days 100 --bodies sun,mercury,venus", 2e7},
        {real, "--rule gauss3 --from 250 --days 90", 2e7},
        {real, "--rule gauss3 --from 2022-03-01 --days 30 --dims 2", 2e9},
        {real, "--rule gauss3 --days 40 --bodies sun,mercury", 2e7},
        {years, "--rule gauss3 --from 0 --days 65", 1e4},
        {years, "--rule gauss3 --from 500 --days 100", 1e6},
        {years, "--rule gauss2 --from 30 --days 400 --bodies sun,mercury", 1e7},
        {years, "--from 700 --days 100 --dims 2", 5e9},
        {years, "--from 1000 --days 97", 4e9},
    };
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        if (shell("$LA path ephemeris --data %s %s --json", rows[k].data, rows[k].options) != 0)
            fail_msg("'%s': %s", rows[k].options, shell_err());
        if (!(shell_number("max_error") < rows[k].most))
            fail_msg("'%s': %g m", rows[k].options, shell_number("max_error"));
    }
}

/* The motion begins with the table's velocity, and is led to the table's last epoch. */
static void test_motion_from_the_table_s_velocity(void **state)
{
    (void)state;
    shell_works("$LA path ephemeris --data %s --rule gauss3 --init ode --json", real);
    assert_true(shell_number("max_error") < 1e7);
    assert_true(shell_number("mse_initial") < 1e15); /* with (q1 - q0) / dt: 3e18 */
    shell_works("$LA path ephemeris --data %s --rule gauss3 --from 300 --days 150 --init ode "
                "--json",
                years);
    assert_true(shell_number("mse_initial") < 1e13);
    assert_true(shell_number("max_error") < 1e6);
}

static void test_another_path_is_not_success(void **state)
{
    static const struct {
        const char *data, *options;
    } rows[] = {
        {real, "--rule gauss3 --init line"},
        {real, "--init line --days 150"},
        {years, "--rule gauss2 --from 400 --days 70 --init line"},
    };
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        assert_int_equal(
            shell("$LA path ephemeris --data %s %s --json", rows[k].data, rows[k].options), 1);
        if (k == 0)
            assert_mentions(shell_err(), "--init table");
        assert_true(shell_number("reference_distance") > 1e10);
    }
    /* short windows have one path, from a line, too; and the published setting stays */
    shell_works("$LA path ephemeris --data %s --init line --days 20", real);
    shell_works("$LA path ephemeris --data %s --preset paper", real);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_default_is_the_table_s_path),
        cmocka_unit_test(test_motion_from_the_table_s_velocity),
        cmocka_unit_test(test_another_path_is_not_success),
    };
    return cmocka_run_group_tests_name("ephemeris_paths", tests, setup, shell_teardown);
}
