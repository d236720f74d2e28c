/* What a path is compared with (A2, A4, A5, H6, H8): never itself, never a diverging motion. */
#include "tests/close.h"
#include "tests/apps/shell.h"

#include <string.h>

/* A4: the motion of the same discretisation is the path itself; the true motion is not. */
static void test_true_motion(void **state)
{
    (void)state;
    shell_works("$LA path pendulum --init ode --json");
    assert_close(shell_number("true_distance"), 0.0527269, 1e-4, 0);
    assert_true(shell_number("true_known") < 1e-8);
    assert_true(shell_number("discretisation_error") > 1e-4);
    shell_works("$LA path kepler --slices 11 --dt .314159 --init ode --json");
    assert_true(shell_number("true_distance") > 3);
}

/* The measured error of discretisation falls as the order of the rule says; `left` has, where L
   separates, the positions of the trapezoidal rule between fixed ends. */
static void test_discretisation(void **state)
{
    (void)state;
    static const struct {
        const char *rule;
        double order;
        int elements; /* errors far above rounding */
    } rules[] = {{"left", 2, 40},
                 {"midpoint", 2, 40},
                 {"trapezoid", 2, 40},
                 {"gauss2", 4, 40},
                 {"gauss3", 6, 16}};
    for (size_t k = 0; k < LENGTH(rules); k++) {
        double error[2];
        for (int fine = 0; fine < 2; fine++) {
            int elements = rules[k].elements * (fine + 1);
            shell_works("$LA path pendulum --init ode --set theta0=0 --set rate0=1.6 --set l=1 "
                        "--rule %s --slices %d --dt %g --json",
                        rules[k].rule, elements + 1, 2.0 / elements);
            error[fine] = shell_number("discretisation_error");
        }
        assert_close(log2(error[0] / error[1]), rules[k].order, 0.15, 0);
    }
}

/* A5 */
static void test_another_path(void **state)
{
    (void)state;
    shell_works("$LA path pendulum --tol 1e-9");
    assert_non_null(strstr(shell_out(), "--all"));
    shell_works("$LA path pendulum --tol 1e-9 --json");
    assert_true(shell_number("reference_distance") > 4 && isnan(shell_number("max_error")));
    assert_true(shell_number("discretisation_error") < 1e-9);
    assert_non_null(strstr(shell_out(), "\"another_path\": true"));
    shell_works("$LA path pendulum --init ode --rule gauss2 --json");
    assert_non_null(strstr(shell_out(), "\"another_path\": false"));
    assert_true(shell_number("max_error") == shell_number("reference_distance"));
}

/* --tol asks for an accuracy, which the path found has, whichever it is: exit status 0 above. Who
   names a reference asks for its path. */
static void test_another_path_than_asked(void **state)
{
    (void)state;
    shell_works("$LA path pendulum --init ode --rule gauss4 --csv ode.csv --quiet");
    assert_int_equal(
        shell("$LA path pendulum --init line --rule gauss4 --reference ode.csv --json"), 1);
    assert_true(shell_number("reference_distance") > 1);
    assert_non_null(strstr(shell_err(), "--init ode.csv"));
    shell_works("$LA path pendulum --init ode.csv --rule gauss4 --reference ode.csv --json");
    assert_true(shell_number("max_error") < 1e-9);
}

/* A motion that the grid of the path cannot hold is another path all the same. */
static void test_another_motion(void **state)
{
    (void)state;
    shell_works("$LA path pythagorean --json");
    assert_non_null(strstr(shell_out(), "\"another_path\": true"));
    assert_true(shell_number("reference_distance") > 7 && isnan(shell_number("max_error")));
    shell_works("$LA path kepler --rule gauss2 --slices 11 --dt 0.3 --json");
    assert_non_null(strstr(shell_out(), "\"another_path\": false"));
}

/* A4: the crude motion of a close encounter spirals away to (-40, 10). */
static void test_close_encounter(void **state)
{
    (void)state;
    shell_works("$LA path arenstorf --json");
    assert_true(shell_number("max_error") < 0.05 && shell_number("discretisation_error") < 0.05);
}

/* H8: between the ends of a file there is no reference, and no error against one. */
static void test_ends_of_a_file(void **state)
{
    (void)state;
    shell_works("printf 'a\\n0\\n0.3\\n0.9\\n' >ends.csv");
    shell_works("$LA path spring --init ends.csv --slices 3 --dt 0.4 --tol 1e-9 --json "
                "--out run.h5 --plot run.svg");
    assert_true(isnan(shell_number("max_error")) && isnan(shell_number("mse_final")));
    assert_true(shell_number("true_distance") < 1e-8);
    assert_true(shell_number("discretisation_error") < 1e-9);
    assert_int_equal(shell("$LA path spring --init ends.csv --slices 3 --dt 0.4 --solver adam "
                           "--steps 5 --stop-at-reference"),
                     2);
}

/* A2: what starts from a start begins with its position and its velocity. */
static void test_start(void **state)
{
    (void)state;
    shell_works("$LA path kepler --ends start --json");
    assert_true(shell_number("max_error") < 1e-12 && shell_number("energy_drift") < 0.1);
    double action = shell_number("action");
    shell_works("$LA path kepler --ends start --init ode --json");
    assert_true(shell_number("action") == action);
    shell_works("$LA path kepler --ends start --rule gauss4 --json");
    assert_true(shell_number("true_distance") < 1e-8);
    assert_int_equal(shell("$LA path kepler --ends start --init line"), 2);
}

/* A6: theta of a heavy top stays in [.50, .55]; only a crude motion of it diverges. */
static void test_reference_that_diverges(void **state)
{
    (void)state;
    shell_works("$LA build $ROOT/tests/apps/scenes/top.c --quiet --include $ROOT --out top.so");
    shell_works("$LA check ./top.so");
    shell_works("$LA path ./top.so --rule gauss4 --init ode --json");
    assert_true(shell_number("true_distance") < 1e-6);
    assert_true(shell("$LA path ./top.so --json") < 2);
    /* by its own discrete equations it does not: march finds the reference itself */
    shell_works("$LA path ./top.so --ends start --json");
    assert_non_null(strstr(shell_out(), "\"the motion of this discretisation\""));
    assert_true(shell_number("reference_distance") < 1e-10);
    assert_true(shell_number("true_distance") < 0.5);
    shell_works(
        "$LA path arenstorf --json --solver adam --steps 3 | grep -F '\"the true motion\"'");
}

static void build_scene(const char *name)
{
    shell_works("$LA build $ROOT/tests/apps/scenes/%s.c --quiet --include $ROOT --out %s.so", name,
                name);
}

/* A16, F6: an energy that L does not keep has no drift; with a potential that depends on v it is
   v L_v - L that is kept, here 0.325, and not T + V. */
static void test_energy(void **state)
{
    (void)state;
    build_scene("good");
    shell_works("$LA path ./good.so --rule gauss4 --json");
    assert_non_null(strstr(shell_out(), "\"energy_conserved\": false"));
    assert_true(isnan(shell_number("energy_drift")));
    build_scene("magnetic");
    shell_works("$LA path ./magnetic.so --rule gauss4 --init ode --json");
    assert_non_null(strstr(shell_out(), "\"energy_conserved\": true"));
    assert_true(shell_number("energy_drift") < 1e-8);
    assert_close(shell_number("energy"), 0.325, 1e-8, 0);
    assert_true(shell_number("true_distance") < 1e-8);
}

/* At kinks a finer rule errs alike: the distance from the true motion between the same ends is more
   than from its path. dop853 by 1e-13 and steps of 1e-3: 2.42e-5. */
static void test_kinks(void **state)
{
    (void)state;
    build_scene("kinked_masses");
    shell_works("$LA path ./kinked_masses.so --rule gauss2 --init ode --json");
    assert_close(shell_number("reference_distance"), 2.42e-5, 0, 2e-7);
    assert_true(shell_number("discretisation_error") >= shell_number("reference_distance"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_true_motion, shell_empty),
        cmocka_unit_test_teardown(test_discretisation, shell_empty),
        cmocka_unit_test_teardown(test_another_path, shell_empty),
        cmocka_unit_test_teardown(test_another_path_than_asked, shell_empty),
        cmocka_unit_test_teardown(test_another_motion, shell_empty),
        cmocka_unit_test_teardown(test_close_encounter, shell_empty),
        cmocka_unit_test_teardown(test_ends_of_a_file, shell_empty),
        cmocka_unit_test_teardown(test_start, shell_empty),
        cmocka_unit_test_teardown(test_energy, shell_empty),
        cmocka_unit_test_teardown(test_kinks, shell_empty),
        cmocka_unit_test_teardown(test_reference_that_diverges, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
