/* The command from outside: output and files. Wrong use: test_errors.c. */
#include "tests/close.h"
#include "shell.h"
#include "apps/command.h"
#include "physics/io/hdf5_file.h"
#include "tests/mentions.h"

#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- help and version ---- */

static void test_help(void **state)
{
    (void)state;
    static const char *const names[] = {"scenes", "path", "check", "chart", "dump"};
    shell_works("$LA --help");
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        assert_non_null(strstr(shell_out(), names[k]));
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char first[64];
        shell_works("$LA %s --help", names[k]);
        snprintf(first, sizeof first, "leastaction %s ", names[k]);
        assert_ptr_equal(strstr(shell_out(), first), shell_out());
        assert_non_null(strstr(shell_out(), "--json"));
    }
    shell_works("$LA path --version");
    assert_string_equal(shell_out(), "leastaction " LEASTACTION_VERSION "\n");
}

/* Processes of a launcher that know nothing of each other would write the same files. */
static void test_launched_without_mpi(void **state)
{
    (void)state;
    static const char *const names[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        assert_int_equal(shell("%s=3 $LA path freebody --csv a.csv", names[k]), 2);
        assert_mentions(shell_err(), names[k]);
        assert_mentions(shell_err(), "3 processes");
        assert_int_equal(shell_files(), 0);
        shell_works("%s=1 $LA path freebody --quiet", names[k]);
    }
}

/* The dynamic loader lists what it loads before the command starts. */
static void test_large_libraries_are_loaded_on_use(void **state)
{
    (void)state;
    static const char *const names[] = {"hdf5", "blas", "lapack"};
    shell_works("LD_TRACE_LOADED_OBJECTS=1 $LA --version");
    assert_non_null(strstr(shell_out(), "libc.so"));
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        assert_null(strstr(shell_out(), names[k]));
}

/* ---- JSON ---- */

static void test_json_keys(void **state)
{
    (void)state;
    static const char *const keys[] = {
        "scene",     "dof",         "slices",      "dt",          "solver",       "rule",
        "steps",     "seconds",     "action",      "action_mean", "kinetic_mean", "potential_mean",
        "grad_norm", "morse_index", "mse_initial", "mse_final",   "max_error",    "energy_drift"};
    shell_works("$LA path freebody --preset paper --json");
    const char *at = shell_last_line();
    assert_int_equal(at[0], '{');
    assert_int_equal(at[strlen(at) - 1], '}');
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++) {
        char quoted[64];
        snprintf(quoted, sizeof quoted, "\"%s\": ", keys[k]);
        at = strstr(at, quoted); /* in this order */
        assert_non_null(at);
    }
    assert_true(shell_number("dof") == 1 && shell_number("slices") == 60 &&
                shell_number("steps") == 500);
    assert_true(shell_number("dt") == 0.25);
    /* the mean of L over the slices is action over their number and length */
    assert_close(shell_number("action"), shell_number("action_mean") * 60 * 0.25, 1e-12, 0);
    assert_close(shell_number("action_mean"),
                 shell_number("kinetic_mean") - shell_number("potential_mean"), 1e-12, 0);
    assert_true(shell_number("mse_final") < 0.01 * shell_number("mse_initial"));
    assert_true(isnan(shell_number("morse_index")));
}

static void test_every_scene_runs(void **state)
{
    (void)state;
    shell_works("$LA scenes --json");
    static const char *const names[] = {"freebody", "pendulum",  "dblpend", "threebody",
                                        "gas",      "ephemeris", "spring",  "kepler"};
    char text[32];
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        shell_works("$LA scenes --json");
        snprintf(text, sizeof text, "\"name\": \"%s\"", names[k]);
        assert_non_null(strstr(shell_out(), text));
        shell_works("$LA path %s --solver adam --steps 3 --json", names[k]);
        assert_true(isfinite(shell_number("action")) && isfinite(shell_number("mse_final")));
        shell_works("$LA scenes %s", names[k]);
    }
}

/* The stationary path of rule left is the ODE path: a descent that starts there has nothing to do.
 */
static void test_start_on_the_answer(void **state)
{
    (void)state;
    shell_works("$LA path kepler --init ode --solver adam --steps 0 --json");
    assert_true(shell_number("mse_initial") == 0 && shell_number("max_error") == 0);
    assert_close(shell_number("grad_norm"), 0, 0, 1e-12);
    shell_works("$LA path kepler --init ode --noise 0.05 --seed 3 --solver adam --steps 0 --json");
    assert_close(sqrt(shell_number("mse_initial")), 0.05, 0.25, 0);
    assert_true(shell_number("grad_norm") > 0.1);
}

/* The motion is stationary as dt goes to 0: halving it divides the gradient there by four and more
   (that of the action a slice, of second order where cubics lead to the nodes between). */
static void test_rules_with_nodes(void **state)
{
    (void)state;
    static const char *const rules[] = {"midpoint", "trapezoid", "gauss2", "gauss3"};
    for (size_t k = 0; k < sizeof rules / sizeof *rules; k++) {
        shell_works(
            "$LA path kepler --rule %s --init ode --solver adam --steps 0 --slices 101 --dt 0.03 "
            "--json",
            rules[k]);
        double coarse = shell_number("grad_norm");
        shell_works(
            "$LA path kepler --rule %s --init ode --solver adam --steps 0 --slices 201 --dt "
            "0.015 --json",
            rules[k]);
        assert_true(shell_number("grad_norm") > 0 && shell_number("grad_norm") < coarse / 4);
    }
    shell_works("$LA path kepler --rule gauss3 --solver adam --steps 3 --out run.h5 --json");
    shell_works("$LA dump run.h5 --json");
    assert_non_null(strstr(shell_out(), "\"shape\": [4, 2, 101]"));
}

static void test_set_and_preset(void **state)
{
    (void)state;
    shell_works("$LA path spring --init ode --solver adam --steps 0 --set k=4 --set=q0=0.5 --json");
    double potential = shell_number("potential_mean");
    shell_works("$LA path spring --init ode --solver adam --steps 0 --json");
    assert_true(fabs(potential - shell_number("potential_mean")) > 1e-3);
    shell_works("$LA path pendulum --preset paper --steps 7 --json");
    assert_true(shell_number("steps") == 7);
    assert_non_null(strstr(shell_last_line(), "\"rule\": \"left+repeat\""));
}

static void test_why_interpreted(void **state)
{
    static const char *const runs[][2] = {
        {"path pendulum --solver adam --steps 3 -v", "too few runs"},
        {"path pendulum --solver adam --steps 3 -v --no-native", "LEASTACTION_NATIVE=0"},
        {"path pendulum --solver adam --steps 3", NULL},
        {"simulate kepler --time 1 --verbose", "the series"},
        {"simulate kepler --time 1 --integrator taylor -v", "the series"},
        {"simulate kepler --time 1e5 --integrator taylor --no-reference -v", NULL},
        {"simulate gas --set cutoff=3 --time .1 -v --no-native", "lists of near pairs"},
    };
    for (size_t k = 0; k < LENGTH(runs); k++) {
        shell_works("$LA %s", runs[k][0]);
        const char *why = strstr(shell_out(), "interpreted: ");
        assert_true(runs[k][1] ? why && strstr(why, runs[k][1]) : !why);
    }
    (void)state;
}

/* ---- results ---- */

static void test_outputs_agree(void **state)
{
    (void)state;
    struct ad_error error = {0};
    phys_hdf5 *file;
    shell_works(
        "$LA path threebody --preset paper --steps 20 --every 7 --out run.h5 --csv found.csv "
        "--json");
    assert_int_equal(shell_files(), 2);
    double action = shell_number("action_mean");
    assert_int_equal(phys_hdf5_open(shell_path("run.h5"), &file, &error), AD_OK);
    double steps[4], history[21], number;
    assert_int_equal(phys_hdf5_read(file, "step", 0, 4, steps, &error), AD_OK);
    assert_true(steps[0] == 0 && steps[1] == 7 && steps[2] == 14 && steps[3] == 20);
    assert_int_equal(phys_hdf5_read(file, "history/action_mean", 0, 21, history, &error), AD_OK);
    assert_true(history[20] == action && history[0] > action);
    assert_int_equal(phys_hdf5_get(file, "parameters", "m1", &number, &error), AD_OK);
    assert_true(number == 1);
    char *text;
    assert_int_equal(phys_hdf5_get_text(file, "/", "command", &text, &error), AD_OK);
    assert_string_equal(text,
                        "leastaction path threebody --preset paper --steps 20 --every 7 --out "
                        "run.h5 --csv found.csv --json");
    free(text);
    double path[6 * 100];
    assert_int_equal(phys_hdf5_read(file, "path", 3, 1, path, &error), AD_OK);
    phys_hdf5_close(file);
    FILE *csv = fopen(shell_path("found.csv"), "r");
    assert_non_null(csv);
    assert_int_equal(fscanf(csv, "%*[^\n]"), 0); /* the line of names */
    for (size_t i = 0; i < 100; i++)
        for (size_t k = 0; k <= 6; k++) {
            assert_int_equal(fscanf(csv, k ? ",%lf" : " %lf", &number), 1);
            assert_true(k ? number == path[(k - 1) * 100 + i] : number >= (double)i / 100);
        }
    fclose(csv);
}

/* The first run is before all tests, the second after them: another second of the clock. */
static int first_run(void **state)
{
    return shell_setup(state) ||
           shell(
               "$LA path pendulum --preset paper --seed 5 --out run.h5 --csv found.csv --quiet && "
               "mkdir ../first && mv run.h5 found.csv ../first");
}

static void test_equal_runs_equal_files(void **state)
{
    (void)state;
    shell_works("$LA path pendulum --preset paper --seed 5 --out run.h5 --csv found.csv --quiet");
    shell_works("cmp run.h5 ../first/run.h5 && cmp found.csv ../first/found.csv");
    shell_works("$LA path pendulum --preset paper --seed 6 --csv found.csv --quiet");
    assert_int_equal(shell("cmp -s found.csv ../first/found.csv"), 1);
}

static void test_csv_on_standard_output(void **state)
{
    (void)state;
    shell_works("$LA path kepler --solver adam --steps 2 --slices 5 --csv - --json");
    assert_ptr_equal(strstr(shell_out(), "t,x,y\n"), shell_out());
    assert_int_equal(shell_last_line()[0], '{');
    shell_works("$LA path kepler --solver adam --steps 2 --slices 5 --csv - --quiet | wc -l");
    assert_int_equal(atoi(shell_out()), 6);
}

/* What asks for no output prints none. */
static void test_quiet(void **state)
{
    (void)state;
    static const char *const runs[] = {
        "path pendulum",
        "simulate kepler",
        "quantum --points 257",
        "quantum --preset paper --scale 0.25",
        "quantum --scene double-slit --points 180 --steps 99",
    };
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        shell_works("$LA %s --quiet", runs[k]);
        assert_string_equal(shell_out(), "");
    }
    shell_works("$LA simulate kepler --samples 4 --csv - --quiet | wc -l");
    assert_int_equal(atoi(shell_out()), 6);
}

/* C10 */
static void test_units_that_are_none(void **state)
{
    (void)state;
    shell_works("$LA simulate kepler --no-reference --samples 2");
    assert_non_null(strstr(shell_out(), "t = 3.14159, "));
    shell_works("$LA scenes kepler; $LA scenes spring");
    assert_non_null(strstr(shell_out(), "2 coordinates, 101 slices of 0.0314159\n"));
    assert_non_null(strstr(shell_out(), "1 coordinate, 100 slices of 0.025 s\n"));
}

static void test_found_path_as_start(void **state)
{
    (void)state;
    shell_works("$LA path kepler --solver adam --steps 9 --csv found.csv --json");
    double action = shell_number("action");
    shell_works(
        "$LA path kepler --solver adam --steps 0 --init found.csv --reference found.csv --json");
    assert_true(shell_number("action") == action && shell_number("mse_initial") == 0);
    shell_works("cut -d, -f2,3 found.csv >plain.csv"); /* C11: without the time as well */
    shell_works("$LA path kepler --solver adam --steps 0 --init plain.csv --json");
    assert_true(shell_number("action") == action);
    static const char *const same[] = {
        "awk -F, '{print $3, $1, $2}' OFS=, found.csv", /* any order, by name */
        "awk -F, '{print $2, $3, $2}' OFS=, found.csv", /* beside others */
        "sed 's/t,x,y/t,a,b/' found.csv",               /* names of one's own: in order */
        "awk -F, 'NR > 1 {print $2, $3}' found.csv"};   /* no names at all */
    for (size_t k = 0; k < LENGTH(same); k++) {
        shell_works("%s >same.csv; $LA path kepler --solver adam --steps 0 --init same.csv --json",
                    same[k]);
        assert_true(shell_number("action") == action);
    }
    static const char *const others[] = {
        "sed 1d found.csv",                   /* nothing says that the first is the time */
        "cut -d, -f1,2 found.csv",            /* the time and one coordinate: not two */
        "sed 's/t,x,y/a,x,b/' found.csv",     /* a coordinate is missing */
        "sed 's/t,x,y/t,v_x,v_y/' found.csv", /* velocities are no coordinates */
        "sed 's/t,x,y/a,b,c/' found.csv"};
    for (size_t k = 0; k < LENGTH(others); k++)
        assert_int_equal(shell("%s >other.csv; $LA path kepler --steps 0 --solver adam --init "
                               "other.csv",
                               others[k]),
                         2);
    shell_works("awk -F, 'NR == 4 {$1 = 0.5} 1' OFS=, found.csv >wrong.csv");
    static const char *const wrong[] = {"--init wrong.csv", "--init ode --reference wrong.csv",
                                        "--init found.csv --dt 0.05"};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++)
        assert_int_equal(shell("$LA path kepler --solver adam --steps 0 %s", wrong[k]), 2);
}

/* ---- runs that do not reach what was asked ---- */

static void test_not_converged(void **state)
{
    (void)state;
    assert_int_equal(
        shell("$LA path kepler --solver adam --steps 3 --grad-tol 1e-12 --json --csv found.csv"),
        1);
    assert_mentions(shell_err(), "leastaction path: steps |gradient|");
    assert_int_equal(shell_last_line()[0], '{');
    assert_int_equal(shell_files(), 1);
    shell_works("$LA path spring --steps 4000 --lr 1e-3 --grad-tol 0.3 --json");
    assert_non_null(strstr(shell_last_line(), "\"stop\": \"tolerance reached\""));
}

/* Half of the ellipse e = .6 takes the energy -1/2 either way; nothing has another. */
static void test_energy_that_no_path_has(void **state)
{
    static const char shorter[] = "--rule gauss3 --slices 30";
    (void)state;
    assert_int_equal(shell("$LA path kepler %s --energy 0 --csv found.csv", shorter), 1);
    assert_mentions(shell_err(), "energy 0");
    assert_non_null(strstr(shell_err(), " -0.5 "));
    assert_int_equal(shell_files(), 0);
    shell_works("$LA path kepler %s --energy -0.5 --json", shorter);
    assert_non_null(strstr(shell_last_line(), "\"unseen_paths\": "));
    assert_true(fabs(shell_number("energy") + 0.5) <= shell_number("energy_tolerance"));
    assert_close(shell_number("energy_tolerance"), 1e-3, 1e-12, 0);
    assert_int_equal(shell("$LA path kepler %s --energy -0.4985", shorter), 1);
    assert_non_null(strstr(shell_err(), "has -0.5,")); /* A11: 0.3 % off is none */
}

static void test_not_finite(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA path pendulum --lr 1e300 --out run.h5 --csv a.csv --plot a.svg"),
                     1);
    assert_mentions(shell_err(), "leastaction path: step 1");
    assert_int_equal(shell_files(), 0);
}

static void test_interrupted(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA path pendulum --preset paper --steps 2000000000 --every 100000000 "
                           "--out run.h5 --json & pid=$!; " SHELL_INTERRUPT),
                     1);
    assert_mentions(shell_err(), "leastaction path: interrupted");
    assert_non_null(strstr(shell_last_line(), "\"stop\": \"interrupted\""));
    assert_int_equal(shell_files(), 1);
    shell_works("$LA dump run.h5 | grep stop");
    assert_string_equal(shell_out(), "    stop = interrupted\n");
}

/* The paths so far are listed, and no number is given for the rest. */
static void test_interrupted_search(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA path kepler --start x=1,y=0 --end x=-.5,y=1.2 --time 20 --rule "
                           "gauss4 --slices 81 --all --json & pid=$!; " SHELL_INTERRUPT),
                     1);
    assert_mentions(shell_err(), "leastaction path: interrupted more");
    assert_non_null(strstr(shell_last_line(), "\"interrupted\": true"));
    assert_non_null(strstr(shell_last_line(), "\"unseen_paths\": null"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_help, shell_empty),
        cmocka_unit_test_teardown(test_launched_without_mpi, shell_empty),
        cmocka_unit_test_teardown(test_large_libraries_are_loaded_on_use, shell_empty),
        cmocka_unit_test_teardown(test_json_keys, shell_empty),
        cmocka_unit_test_teardown(test_every_scene_runs, shell_empty),
        cmocka_unit_test_teardown(test_start_on_the_answer, shell_empty),
        cmocka_unit_test_teardown(test_rules_with_nodes, shell_empty),
        cmocka_unit_test_teardown(test_set_and_preset, shell_empty),
        cmocka_unit_test_teardown(test_why_interpreted, shell_empty),
        cmocka_unit_test_teardown(test_outputs_agree, shell_empty),
        cmocka_unit_test_teardown(test_csv_on_standard_output, shell_empty),
        cmocka_unit_test_teardown(test_quiet, shell_empty),
        cmocka_unit_test_teardown(test_units_that_are_none, shell_empty),
        cmocka_unit_test_teardown(test_found_path_as_start, shell_empty),
        cmocka_unit_test_teardown(test_not_converged, shell_empty),
        cmocka_unit_test_teardown(test_energy_that_no_path_has, shell_empty),
        cmocka_unit_test_teardown(test_not_finite, shell_empty),
        cmocka_unit_test_teardown(test_interrupted, shell_empty),
        cmocka_unit_test_teardown(test_interrupted_search, shell_empty),
        cmocka_unit_test_teardown(test_equal_runs_equal_files, shell_empty),
    };
    return cmocka_run_group_tests(tests, first_run, shell_teardown);
}
