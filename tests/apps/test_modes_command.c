/* leastaction modes: tables, files and pictures of one run, and what it refuses; families
   of periodic motions from modes (simulate --mode). */
#include "tests/close.h"
#include "picture_text.h"
#include "shell.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void the_table_is_the_file(void **state)
{
    char line[256];
    int equilibrium, mode;
    double frequency, growth;
    (void)state;
    shell_works("$LA modes dblpend --json --csv modes.csv --out modes.h5 --plot mode.svg");
    const char *at = strstr(shell_last_line(), "\"modes\": [{\"equilibrium\": 1, \"mode\": 1");
    assert_non_null(at);
    assert_non_null(at = strstr(at, "\"frequency\": "));
    FILE *csv = fopen(shell_path("modes.csv"), "r");
    assert_non_null(csv);
    assert_non_null(fgets(line, sizeof line, csv));
    assert_string_equal(line, "equilibrium,mode,frequency,growth,uncertainty,a,shape_a,"
                              "shape_imaginary_a,b,shape_b,shape_imaginary_b\n");
    assert_non_null(fgets(line, sizeof line, csv));
    fclose(csv);
    assert_int_equal(sscanf(line, "%d,%d,%lf,%lf", &equilibrium, &mode, &frequency, &growth), 4);
    assert_close(frequency, sqrt(2 - sqrt(2)), 1e-13, 0);
    assert_close(strtod(at + 13, NULL), frequency, 1e-13, 0);
    shell_works("$LA dump modes.h5");
}

static void boxes_and_modes_are_chosen(void **state)
{
    (void)state;
    shell_works("$LA modes double-well --within x=.5:3 --json");
    assert_mentions(shell_last_line(), "\"q\": [1.5]");
    assert_int_equal(shell("$LA modes double-well --within y=0:1"), 2);
    assert_mentions(shell_err(), "--within double-well 'y'");
    assert_int_equal(shell("$LA modes double-well --within x=1:0"), 2);
    assert_int_equal(shell("$LA modes double-well --equilibrium 9"), 2);
    assert_mentions(shell_err(), "--equilibrium 3 9");
    assert_int_equal(shell("$LA modes double-well --mode 2"), 2);
    assert_int_equal(shell("$LA modes kepler"), 1);
    assert_mentions(shell_err(), "no equilibrium");
    assert_int_equal(shell("$LA modes pendulum --set damping=.1"), 2);
}

/* From the mode at rest until the pendulum stands; the table is written where that is not reached.
 */
static void a_family_begins_with_a_mode(void **state)
{
    (void)state;
    shell_works("$LA simulate pendulum --set l=1 --mode 1 --continue period=7 --json --csv f.csv");
    assert_close(shell_number("period"), 7, 1e-14, 0);
    const double E = shell_number("energy"); /* 7 = 4 K(sqrt(E/2)) */
    assert_close(E, 0.7176632967782709, 1e-12, 0);
    shell_works("head -1 f.csv | grep -qx 'number,value,uncertainty,mark,period,period_uncertainty,"
                "energy,closure,theta,v_theta,multiplier1,multiplier1_imaginary,multiplier2,"
                "multiplier2_imaginary' && tail -1 f.csv | cut -d, -f2 | grep -q '^7'");
    assert_int_equal(shell("$LA simulate pendulum --set l=1 --periodic 6.4 --continue energy=-1 "
                           "--csv f.csv --out f.h5 --plot f.svg --quiet"),
                     1);
    assert_mentions(shell_err(), "energy rest");
    shell_works("$LA simulate cr3bp --mode 3 --continue mu=.3:.29 --hold energy --no-reference");
    assert_int_equal(shell("$LA simulate sine-gordon --periodic 12 --continue sites=99:98"), 2);
    assert_mentions(shell_err(), "sites");
    assert_int_equal(shell("$LA simulate pendulum --set l=1 --periodic 6.3 --continue l=1.1:1.2 "
                           "--hold energy"),
                     2);
    assert_int_equal(shell("$LA simulate cubic --mode 1 --continue energy=.3"), 1); /* it escapes */
    assert_mentions(shell_err(), "energy=.3 0.166666667");
    shell_works("tail -1 f.csv | grep -q ',rest,6.28318530' && test -s f.svg && $LA dump f.h5 | "
                "grep -q family/state");
}

/* Labels of narrow panels are apart; across the plane of two bodies, what moves is z. */
static void a_family_in_space_is_drawn(void **state)
{
    (void)state;
    shell_works("$LA simulate cr3bp --mode 2 --continue energy=-1.59 --plot f.svg --quiet && "
                "grep -q '>z<' f.svg");
    picture_texts_are_apart();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_family_begins_with_a_mode, shell_empty),
        cmocka_unit_test_setup(a_family_in_space_is_drawn, shell_empty),
        cmocka_unit_test_setup(the_table_is_the_file, shell_empty),
        cmocka_unit_test_setup(boxes_and_modes_are_chosen, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
