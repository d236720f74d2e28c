/* --scan: the rows are those of single runs, in any order; what fails is told; misuse is refused.
 */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Line `row` of a file of the work folder. */
static void line_of(const char *name, int row, char *line, size_t size)
{
    FILE *file = fopen(shell_path(name), "r");
    assert_non_null(file);
    for (int k = 0; k <= row; k++)
        assert_non_null(fgets(line, (int)size, file));
    fclose(file);
}

static double number(const char *text, const char *key)
{
    char quoted[80];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(text, quoted);
    assert_non_null(at);
    return strtod(at + strlen(quoted), NULL);
}

static void rows_are_single_runs(void **state)
{
    char up[4096], down[4096];
    (void)state;
    shell_works("$LA simulate pendulum --scan theta0=0.5:2.5:3 --set l=2 --time 5 --event "
                "'theta<0' --json --csv up.csv --out scan.h5 --plot scan.svg");
    const char *row = strstr(shell_last_line(), "{\"theta0\": 1.5");
    assert_non_null(row);
    const double energy = number(row, "energy"), drift = number(row, "energy_drift"),
                 event = number(row, "events.1.t");
    shell_works(
        "$LA simulate pendulum --set theta0=1.5 --set l=2 --time 5 --event 'theta<0' --json");
    assert_true(number(shell_last_line(), "energy") == energy);
    assert_true(number(shell_last_line(), "energy_drift") == drift);
    assert_true(number(shell_last_line(), "t") == event);
    shell_works("$LA simulate pendulum --scan theta0=2.5:0.5:3 --set l=2 --time 5 --event "
                "'theta<0' --quiet --csv down.csv");
    for (int k = 0; k < 3; k++) {
        line_of("up.csv", 1 + k, up, sizeof up);
        line_of("down.csv", 3 - k, down, sizeof down);
        assert_string_equal(up, down);
    }
    shell_works("$LA dump scan.h5");
    assert_mentions(shell_out(), "/scanned/theta0");
    assert_mentions(shell_out(), "/results/energy_drift");
}

static void two_parameters_are_a_map(void **state)
{
    char line[8192];
    double m, k, frequency;
    int status;
    (void)state;
    shell_works("$LA modes spring --scan m=1:4:2 --scan k=1:100:3:log --curves "
                "modes.1.frequency --csv map.csv --plot map.svg --quiet");
    line_of("map.csv", 0, line, sizeof line);
    assert_true(strncmp(line, "m,k,status,", 11) == 0);
    line_of("map.csv", 5, line, sizeof line); /* m 4, k 10 */
    assert_int_equal(sscanf(line, "%lf,%lf,%d", &m, &k, &status), 3);
    assert_true(m == 4 && status == 0);
    assert_close(k, 10, 1e-14, 0);
    /* Cells meet half way: of m 1 at 2.5, of k 10 at the roots of 10 and 1000. */
    shell_works("mkdir none && PATH=$PWD/none $LA modes spring --scan m=1:4:2 --scan "
                "k=1:100:3:log --plot cells.svg --quiet && grep '^1 [-0-9.]* [0-9.]* 10 ' "
                "cells.svg.dat");
    double right, low, high;
    assert_int_equal(sscanf(shell_out(), "1 -0.5 %lf 10 %lf %lf", &right, &low, &high), 3);
    assert_close(right, 2.5, 1e-11, 0);
    assert_close(low, sqrt(10), 1e-11, 0);
    assert_close(high, sqrt(1000), 1e-11, 0);
    shell_works("$LA modes spring --scan m=1:4:2 --scan k=1:100:3:log --json");
    const char *last = strstr(shell_last_line(), "\"m\": 4, \"k\": 100,");
    assert_non_null(last);
    frequency = number(last, "modes.1.frequency");
    assert_close(frequency, 5, 1e-14, 0);
}

static void what_fails_is_told(void **state)
{
    char line[4096];
    (void)state;
    assert_int_equal(
        shell("$LA simulate kepler --scan e=0.5:1.5:3 --time 1 --csv partly.csv --quiet"), 1);
    assert_mentions(shell_err(), "2 of 3 e = 1");
    line_of("partly.csv", 1, line, sizeof line);
    assert_true(strncmp(line, "0.5,0,", 6) == 0);
    line_of("partly.csv", 3, line, sizeof line);
    assert_true(strncmp(line, "1.5,2,,", 7) == 0);
}

/* The colours of a map are those of its numbers, all of them; a run without one has none. */
static void a_map_shows_all_and_what_is_missing(void **state)
{
    double low, high, least, most;
    int missing;
    (void)state;
    assert_int_equal(shell("mkdir none && PATH=$PWD/none $LA simulate pendulum --time 1 --scan "
                           "l=-1:1:3 --scan theta0=1:2:2 --curves energy --plot map.svg --quiet"),
                     1);
    shell_works(
        "sed -n 's/^set cbrange .\\([^:]*\\):\\([^]]*\\)./\\1 \\2/p' map.svg.gp; awk '/^#/ "
        "{next} $7 == \"NaN\" {m++; next} {if (!n++) a = b = $7; if ($7 < a) a = $7; if ($7 > b) "
        "b = $7} END {print a, b, m}' map.svg.dat");
    assert_int_equal(
        sscanf(shell_out(), "%lf %lf %lf %lf %d", &low, &high, &least, &most, &missing), 5);
    assert_close(low, least, 1e-5, 0);
    assert_close(high, most, 1e-5, 0);
    assert_int_equal(missing, 2);
    shell_works("grep -c 'grey: runs without this number' map.svg.gp");
}

/* Crossings 2 and 3 of each run are points of the first panel; asked first, drawn first. */
static void items_share_a_panel(void **state)
{
    (void)state;
    shell_works("mkdir none && PATH=$PWD/none $LA simulate spring --scan k=1:2:3 --time 20 --tol "
                "1e-6 --event "
                "'q>0' --curves events.2-3.t,energy --plot items.svg --quiet");
    shell_works("awk '!/^#/ { print NF }' items.svg.dat | sort -u");
    assert_string_equal(shell_out(), "4\n"); /* k, energy, two times */
    shell_works("grep -o 'using 1:([$][0-9]' items.svg.gp");
    assert_string_equal(shell_out(), "using 1:($3\nusing 1:($4\nusing 1:($2\n");
}

static void misuse_is_refused(void **state)
{
    static const char *const wrong[][2] = {
        {"--scan l=1:2", "--scan: expected NAME=FROM:TO:N"},
        {"--scan l=1:2:1", "--scan: expected NAME=FROM:TO:N"},
        {"--scan l=1:2:3:cubic", "--scan: expected NAME=FROM:TO:N"},
        {"--scan l=1::2:3", "--scan: expected NAME=FROM:TO:N"},
        {"--scan l=1:2:3:log:more", "--scan: expected NAME=FROM:TO:N"},
        {"--scan l=-1:2:3:log", "--scan: log needs values above 0"},
        {"--scan length=1:2:3", "length"},
        {"--scan l=1:2:3 --set l=4", "--scan does not go with --set l"},
        {"--scan l=1:2:3 --scan l=1:2:3", "--scan: l twice"},
        {"--scan l=1:2:3 --scan g=1:2:3 --scan m=1:2:3",
         "--scan: at most 2 of --scan, --sweep and --seeds"},
        {"--scan l=1:2:100000 --scan g=1:2:3", "--scan: 300000 runs"},
        {"--scan l=1:2:3 --curves events.1-2.t", "--curves: no number 'events.1-2.t'"},
        {"--scan l=1:2:2 --scan m=1:2:2 --time 9 --event theta=0 --curves events.1-2.t",
         "--curves: 2 numbers; a map shows one"},
        {"--scan l=1:2:3 --time 9 --event theta=0 --curves events.1-9.t",
         "'events.1-9.t' are 9 numbers, of which the results have"},
        {"--scan l=1:2:3 --curves nothing", "--curves: no number 'nothing'"},
        {"--scan l=-2:-1:2 --time -1", "--time"},
        {"--curves energy", "--curves needs --scan, --sweep or --seeds"},
    };
    (void)state;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        assert_int_equal(shell("$LA simulate pendulum %s", wrong[k][0]), 2);
        assert_mentions(shell_err(), wrong[k][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(rows_are_single_runs, shell_empty),
        cmocka_unit_test_setup(two_parameters_are_a_map, shell_empty),
        cmocka_unit_test_setup(what_fails_is_told, shell_empty),
        cmocka_unit_test_setup(a_map_shows_all_and_what_is_missing, shell_empty),
        cmocka_unit_test_setup(items_share_a_panel, shell_empty),
        cmocka_unit_test_setup(misuse_is_refused, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
