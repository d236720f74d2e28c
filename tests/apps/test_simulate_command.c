/* leastaction simulate from outside: reports, choices, files, refusals. */
#include "tests/close.h"
#include "shell.h"
#include "physics/physics.h"
#include "physics/io/hdf5_file.h"
#include "physics/io/csv.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool has(const char *text) { return strstr(shell_last_line(), text) != NULL; }

static void test_report(void **state)
{
    (void)state;
    shell_works("$LA simulate kepler --integrator verlet --dt 0.006283185307179587 --time "
                "62.83185307179586 --json");
    assert_true(has("\"scene\": \"kepler\"") && has("\"integrator\": \"verlet\""));
    assert_true(shell_number("steps") == 10000);
    assert_true(shell_number("evaluations") == 10000);
    assert_close(shell_number("error"), 0.0103, 0.02, 0);
    assert_close(shell_number("energy"), -0.5, 1e-15, 0);
    assert_close(shell_number("energy_drift"), 5.06e-5, 0.01, 0);
    assert_true(shell_number("angular_momentum_change") < 1e-12);
    assert_true(isnan(shell_number("closest_approach")));
    shell_works("$LA simulate kepler --no-reference --json");
    assert_true(isnan(shell_number("error")));
}

static void test_bodies_and_reversal(void **state)
{
    (void)state;
    shell_works("$LA simulate figure8 --integrator gauss4 --dt 0.02 --reverse --json");
    assert_close(shell_number("closest_approach"), 0.6905266, 1e-6, 0);
    assert_true(shell_number("reversal_error") < 1e-12);
    assert_true(shell_number("momentum_change") < 1e-13);
    assert_true(shell_number("error") < 1e-8);
}

/* The state-transition matrix of the motion as it is listed, and 1 where rounding leaves none of
 * it. */
static void test_sensitivity(void **state)
{
    (void)state;
    double matrix[4];
    shell_works("$LA simulate spring --set m=1 --set k=9 --time 2 --sensitivity --json");
    const char *at = strstr(shell_last_line(), "\"sensitivity\": [");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "\"sensitivity\": [%lf, %lf, %lf, %lf]", &matrix[0], &matrix[1],
                            &matrix[2], &matrix[3]),
                     4);
    assert_close(matrix[0], cos(6), 1e-14, 1e-14);
    assert_close(matrix[1], sin(6) / 3, 1e-14, 1e-14);
    assert_close(matrix[2], -3 * sin(6), 1e-14, 1e-14);
    assert_close(matrix[3], cos(6), 1e-14, 1e-14);
    at = strstr(shell_last_line(), "\"parameter_sensitivity\": [");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "\"parameter_sensitivity\": [%lf, %lf, %lf, %lf]", &matrix[0],
                            &matrix[1], &matrix[2], &matrix[3]),
                     4); /* by m, k, q0, v0 */
    assert_close(matrix[0], 3 * sin(6), 1e-13, 0);
    assert_close(matrix[1], -sin(6) / 3, 1e-13, 0);
    assert_close(matrix[2], cos(6), 1e-13, 0);
    assert_close(matrix[3], sin(6) / 3, 1e-13, 0);
    assert_int_equal(shell("$LA simulate spring --sensitivity --by l"), 2);
    assert_int_equal(shell("$LA simulate dblpend --time 120 --no-reference --sensitivity"), 1);
    assert_int_equal(shell("$LA simulate gas --time 1 --no-reference --sensitivity"), 2);
}

/* Every scene and every integrator says how its energy drifts; those that need a scene that
   separates refuse the double pendulum, and say what to take. */
static void test_energy_is_always_reported(void **state)
{
    (void)state;
    for (size_t k = 0; phys_scenes[k]; k++) {
        char arguments[96];
        snprintf(arguments, sizeof arguments, "%s --no-reference --time 1 --json",
                 phys_scenes[k]->name);
        shell_works("$LA simulate %s", arguments);
        assert_true(shell_number("energy_drift") >= 0);
    }
    for (size_t k = 0; phys_integrators[k]; k++) {
        const struct phys_integrator *method = phys_integrators[k];
        const char *step = method->adaptive ? "" : "--dt 0.02";
        int status = shell("$LA simulate dblpend --no-reference --time 1 --json --integrator %s %s",
                           method->name, step);
        assert_int_equal(status, method->separable ? 2 : 0);
        if (method->separable)
            assert_mentions(shell_err(), "gauss2 implicit-midpoint dop853");
        else
            assert_true(shell_number("energy_drift") >= 0);
    }
}

/* The double pendulum does not separate: symplectic methods run in (q, p). */
static void test_energy_of_a_scene_that_does_not_separate(void **state)
{
    (void)state;
    shell_works(
        "$LA simulate dblpend --integrator gauss3 --dt 0.01 --time 50 --no-reference --json");
    assert_true(shell_number("energy_drift") < 1e-9);
    shell_works(
        "$LA simulate dblpend --integrator variational-trapezoid --dt 0.01 --time 5 --json");
    assert_true(shell_number("error") < 1e-2 && shell_number("error") > 1e-6);
}

/* The estimate is an upper bound but for a factor of ten at most, and the error meets what was
   asked, on motions of several kinds and accuracies. */
static void test_tolerance_is_met(void **state)
{
    (void)state;
    static const char *const runs[] = {
        "kepler --time 20",    "pendulum",         "figure8",         "dblpend --time 5",
        "arenstorf --time 10", "spring --time 30", "dimer --time 10", "cubic --time 30"};
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++)
        for (double tolerance = 1e-3; tolerance > 1e-10; tolerance *= 1e-3) {
            char arguments[96];
            snprintf(arguments, sizeof arguments, "%s --tol %g --json", runs[k], tolerance);
            shell_works("$LA simulate %s", arguments);
            double error = shell_number("error"), estimate = shell_number("error_estimate");
            print_message("%-20s %.0e: estimate %.1e, error %.1e\n", runs[k], tolerance, estimate,
                          error);
            assert_true(isnan(estimate) ||
                        estimate <= tolerance); /* NaN: tightened by the error measured */
            assert_true(error <= tolerance);
            assert_true(isnan(estimate) || error <= 10 * estimate);
        }
    shell_works("$LA simulate kepler --integrator yoshida4 --tol 1e-4 --json");
    assert_true(has("\"integrator\": \"yoshida4\"") && shell_number("error") < 1e-4);
}

static void test_files(void **state)
{
    (void)state;
    size_t rows, columns;
    double *values, energy[12];
    struct ad_error error = {0};
    shell_works("$LA simulate kepler --samples 11 --csv k.csv --out k.h5 --plot k.svg --quiet");
    assert_int_equal(phys_table_read(shell_path("k.csv"), &rows, &columns, &values, &error), AD_OK);
    assert_int_equal(rows, 12);
    assert_int_equal(columns, 5);
    assert_close(values[11 * 5], 3.14159265358979, 1e-14, 0);
    assert_close(values[11 * 5 + 1], -1.6, 1e-7, 0); /* apocentre after half a period */
    free(values);
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_open(shell_path("k.h5"), &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_read(file, "energy", 0, 12, energy, &error), AD_OK);
    assert_close(energy[11], -0.5, 1e-7, 0);
    phys_hdf5_close(file);
    assert_true(shell_files() >= 3); /* without gnuplot: data and commands for the picture */
}

/* From rest the velocity falls through zero after every period, 6.69997566437. */
static void test_events(void **state)
{
    (void)state;
    static const char command[] =
        "pendulum --set l=1 --set theta0=1 --tol 1e-13 --integrator dop853 "
        "--no-reference --time 21 --json";
    const double period = 6.69997566437;
    char arguments[200];
    snprintf(arguments, sizeof arguments, "%s --event 'v_theta<0' --out e.h5", command);
    shell_works("$LA simulate %s", arguments);
    const char *at = shell_last_line();
    for (int k = 1; k <= 3; k++) {
        at = strstr(at, "{\"event\": \"v_theta<0\", \"t\": ");
        assert_non_null(at);
        at = strstr(at, "\"t\": ") + 5;
        assert_close(strtod(at, NULL), k * period, 1e-11, 0);
    }
    assert_null(strstr(at, "v_theta<0"));
    double times[3], states[6];
    struct ad_error error = {0};
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_open(shell_path("e.h5"), &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_read(file, "events/time", 0, 3, times, &error), AD_OK);
    assert_int_equal(phys_hdf5_read(file, "events/state", 0, 3, states, &error), AD_OK);
    assert_close(times[2], 3 * period, 1e-11, 0);
    assert_close(states[4], 1, 1e-12, 0);
    phys_hdf5_close(file);

    snprintf(arguments, sizeof arguments, "%s --until theta=0 --csv e.csv", command);
    shell_works("$LA simulate %s", arguments);
    assert_true(has("\"stop\": \"event\""));
    assert_close(shell_number("time"), period / 4, 1e-11, 0);
    size_t rows, columns;
    double *values; /* the samples go on up to the event, the last one is there */
    assert_int_equal(phys_table_read(shell_path("e.csv"), &rows, &columns, &values, &error), AD_OK);
    assert_close(values[3 * (rows - 1)], period / 4, 1e-11, 0);
    assert_close(values[3 * (rows - 2)], floor(period / 4 / 0.021) * 0.021, 1e-12, 0);
    free(values);

    assert_int_equal(shell("$LA simulate kepler --until x=3"), 1); /* with the results so far */
    assert_mentions(shell_err(), "--until x=3");
    assert_mentions(shell_out(), "x=3");
    /* the end of its axis */
    shell_works("$LA simulate kepler --until distance:1=1 --integrator gauss4 --dt 0.1 --json");
    assert_true(has("\"stop\": \"event\""));
    assert_close(shell_number("time"), M_PI / 2 - 0.6, 1e-4, 0);
    shell_works("$LA simulate ephemeris --event distance:mercury,venus=1e11 --no-reference --json");
    assert_true(has("{\"event\": \"distance:mercury,venus=1e11\""));
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        int status;
        const char *arguments, *message;
    } cases[] = {
        {2, "kepler --integrator verle", "'verle' 'verlet'"},
        {2, "kepler --tol 0", "--tol 0"},
        {2, "kepler --time -1", "--time 0 -1"},
        {2, "kepler --dt 0.1", "--dt needs --integrator NAME"},
        {2, "kepler --integrator rk4 --dt 0.1 --tol 1", "--dt --tol"},
        {2, "kepler --integrator dop853 --dt 0.1", "--dt dop853 --tol"},
        {2, "kepler --samples 0", "--samples 1 0"},
        {2, "kepler --every 2 --samples 3", "--every --samples"},
        {2, "kepler --event x", "expected QUANTITY=VALUE"},
        {2, "kepler --event x=a", "expected QUANTITY=VALUE"},
        {2, "kepler --until z=1", "kepler 'z' x"},
        {2, "figure8 --event distance:1,4=1", "'distance:1,4'"},
        {2, "pendulum --event distance:1=1", "'distance:1'"},
        {2, "kepler --set e=2", "e 2"},
        {2, "kepler --csv no/k.csv", "no/k.csv"},
        {2, "dblpend --integrator verlet", "implicit-midpoint"},
        {1, "fall --time 2", "1.11072073*"},
        {1, "fall --time 2 --tol 1e-6", "1.11072*"},
        {1, "dblpend --time 200 --tol 1e-8", "reach"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        bool named = strstr(cases[k].arguments, "--csv") != NULL;
        int status = shell("$LA simulate %s%s", cases[k].arguments, named ? "" : " --csv x.csv");
        if (status != cases[k].status || shell_files())
            print_error("%s: exit %d, %s", cases[k].arguments, status, shell_err());
        assert_int_equal(status, cases[k].status);
        assert_mentions(shell_err(), cases[k].message);
        assert_string_equal(shell_out(), "");
        assert_int_equal(shell_files(), 0);
    }
}

/* Extrema between rows are known better than the error of the motion: 1e-10 beside 1e-8. */
static void test_near_touches(void **state)
{
    (void)state;
    shell_works("$LA simulate spring --set k=4 --time 31.3 --event q=1.0000000001");
    assert_mentions(shell_err(), "q=1.0000000001 8");
    shell_works("$LA simulate spring --set k=4 --time 31.3 --event q=1.0001");
    assert_string_equal(shell_err(), "");
}

/* Rows in their order, each as that motion alone; what fails is named, and the rest is there. */
static void test_ensemble(void **state)
{
    (void)state;
    size_t rows, cols, alone_rows, alone_cols;
    double *table, *alone;
    struct ad_error error = {0};
    shell_works("printf 'e,v_y\\n0.1,1\\n0.5,0.7\\n0,1.1\\n' > starts.csv; "
                "$LA simulate kepler --ensemble starts.csv --time 3 --samples 4 --threads 2 "
                "--csv all.csv --out all.h5 --json");
    assert_true(shell_number("members") == 3 && shell_number("failed") == 0);
    assert_true(shell_number("error") < 1e-6);
    assert_int_equal(phys_table_read(shell_path("all.csv"), &rows, &cols, &table, &error), AD_OK);
    assert_true(rows == 15 && cols == 7);
    shell_works("$LA simulate kepler --set e=0.5 --integrator taylor --tol 1e-9 --time 3 "
                "--samples 4 --no-reference --csv one.csv --quiet");
    assert_int_equal(
        phys_table_read(shell_path("one.csv"), &alone_rows, &alone_cols, &alone, &error), AD_OK);
    assert_true(alone_rows == 5 && alone_cols == 5);
    for (size_t i = 0; i < rows; i++)
        assert_true(table[i * cols] == (double)(i / 5 + 1));
    assert_true(table[5 * cols + 2] == alone[1] && table[5 * cols + 5] == 0.7);
    free(table);
    free(alone);

    shell_works("printf 'e\\n0.1\\n0.5\\n' > e.csv; "
                "$LA simulate kepler --ensemble e.csv --time 3 --samples 4 --csv all.csv --quiet; "
                "grep ^2 all.csv | cut -d , -f 2-6 > second; tail -n +2 one.csv | cmp - second");
    assert_int_equal(shell("printf 'v_y,x\\n1,1\\n0,1\\n1,0.7\\n' > fall.csv; $LA simulate kepler "
                           "--ensemble fall.csv --time 3 --json"),
                     1);
    assert_true(shell_number("failed") == 1);
    assert_non_null(strstr(shell_err(), "row 2"));
    assert_int_equal(shell("$LA simulate kepler --ensemble e.csv --time 3 --tol 1e-30"), 1);
    assert_int_equal(shell("$LA simulate kepler --ensemble e.csv --event y=0 --until x=9"), 1);
    shell_works("printf 'e\\n0.1\\n0.5\\n0.2\\n' > u.csv; "
                "$LA simulate kepler --ensemble u.csv --time 9 --until 'x<0' --json");
    assert_true(shell_number("members") == 3 && shell_number("mean") < 1e-12);
    assert_int_equal(shell("$LA simulate kepler --ensemble u.csv --time 9 --until 'x<-1.3'"), 1);
    assert_non_null(strstr(shell_err(), "2 of 3"));
    assert_non_null(strstr(shell_err(), "rows 1, 3"));
    const char *const wrong[] = {
        "printf '1,2\\n3,4\\n' > f.csv; $LA simulate kepler --ensemble f.csv",
        "printf 'x,x\\n3,4\\n' > f.csv; $LA simulate kepler --ensemble f.csv",
        "printf 'x,z\\n3,4\\n' > f.csv; $LA simulate kepler --ensemble f.csv",
        "printf 'x,y\\n3\\n' > f.csv; $LA simulate kepler --ensemble f.csv",
        "printf 'x,y\\n3,nan\\n' > f.csv; $LA simulate kepler --ensemble f.csv",
        "printf 'x,gm\\n1,2\\n' > f.csv; $LA simulate kepler --ensemble f.csv --set gm=2",
        "$LA simulate kepler --ensemble f.csv --scan gm=1:2:2",
        "$LA simulate kepler --ensemble none.csv",
        "$LA simulate kepler --ensemble e.csv --integrator rk4",
        "$LA simulate kepler --ensemble e.csv --reverse",
        "$LA simulate kepler --ensemble e.csv --sensitivity",
        "$LA simulate kepler --ensemble e.csv --every 3",
    };
    for (size_t k = 0; k < LENGTH(wrong); k++)
        if (shell("%s", wrong[k]) != 2)
            fail_msg("%s: not exit status 2", wrong[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_ensemble, shell_empty),
        cmocka_unit_test_setup(test_near_touches, shell_empty),
        cmocka_unit_test_setup(test_report, shell_empty),
        cmocka_unit_test_setup(test_bodies_and_reversal, shell_empty),
        cmocka_unit_test_setup(test_sensitivity, shell_empty),
        cmocka_unit_test_setup(test_energy_of_a_scene_that_does_not_separate, shell_empty),
        cmocka_unit_test_setup(test_tolerance_is_met, shell_empty),
        cmocka_unit_test_setup(test_files, shell_empty),
        cmocka_unit_test_setup(test_energy_is_always_reported, shell_empty),
        cmocka_unit_test_setup(test_events, shell_empty),
        cmocka_unit_test_setup(test_refusals, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
