/* leastaction path --start, --end, --time: what is given stands in the path found, to the last bit,
   and what is left free is where its momentum vanishes. */
#include "tests/close.h"
#include "tests/apps/shell.h"
#include "physics/io/csv.h"

#include <math.h>
#include <stdlib.h>

/* First and last rows of found.csv without the time: [2 x n]; that is *time. */
static void read_ends(size_t n, double *ends, double *time)
{
    size_t rows, columns;
    double *values;
    struct ad_error error = {0};
    assert_int_equal(phys_table_read(shell_path("found.csv"), &rows, &columns, &values, &error),
                     AD_OK);
    assert_int_equal(columns, n + 1);
    for (size_t k = 0; k < n; k++) {
        ends[k] = values[1 + k];
        ends[n + k] = values[(rows - 1) * columns + 1 + k];
    }
    *time = values[(rows - 1) * columns];
    free(values);
}

/* Whatever the path starts from, its ends are those given. */
static void ends_stand(void **state)
{
    (void)state;
    static const char *const how[] = {"",
                                      "--init line",
                                      "--init ode",
                                      "--init guess.csv --slices 5",
                                      "--tol 1e-6",
                                      "--tol 1e-5 --rule midpoint",
                                      "--rule gauss3",
                                      "--rule left+repeat",
                                      "--rule trapezoid",
                                      "--all --rule gauss4",
                                      "--init guess.csv --slices 5 --tol 1e-6"};
    double ends[4], time;
    shell_works("printf 'theta\\n0\\n0.1\\n0.3\\n0.2\\n0.5\\n' >guess.csv");
    for (size_t k = 0; k < sizeof how / sizeof *how; k++) {
        shell_works("$LA path pendulum --start theta=-pi/3 --end theta=1.2+2pi --time 21.5 %s "
                    "--csv found.csv --quiet",
                    how[k]);
        read_ends(1, ends, &time);
        assert_true(ends[0] == -M_PI / 3);
        assert_true(ends[1] == 1.2 + 2 * M_PI);
        assert_close(time, 21.5, 0, 1e-14);
    }
}

/* Order of names does not matter; rows of tables, and the scene's own start. */
static void ends_from_elsewhere(void **state)
{
    (void)state;
    double ends[4], time;
    shell_works("$LA path kepler --start y=0,x=1 --end y=1.2,x=-.5 --time 2 --csv found.csv --tol "
                "1e-6 --quiet");
    read_ends(2, ends, &time);
    assert_true(ends[0] == 1 && ends[1] == 0 && ends[2] == -.5 && ends[3] == 1.2);
    shell_works("$LA path kepler --start found.csv --end found.csv --time 2 --rule gauss4 --slices "
                "12 --csv found.csv.2 --quiet && mv found.csv.2 found.csv");
    read_ends(2, ends, &time);
    assert_true(ends[0] == 1 && ends[1] == 0 && ends[2] == -.5 && ends[3] == 1.2);
    shell_works("$LA path pendulum --set theta0=0.3 --end theta=0.7 --csv found.csv --quiet");
    read_ends(1, ends, &time);
    assert_true(ends[0] == 0.3 && ends[1] == 0.7);
    assert_close(time, 99, 0, 1e-14);
}

/* q(0) = 1, q(T) free: cos(T - t) / cos(T). */
static void a_free_coordinate(void **state)
{
    (void)state;
    shell_works("$LA path spring --end q=free --time 1.1 --tol 1e-8 --json");
    assert_close(shell_number("value"), 1 / cos(1.1), 0, 1e-8);
    assert_true(shell_number("free_momentum") < 1e-7);
    shell_works("$LA path spring --start q=free --end q=0.5 --time 0.9 --rule gauss4 --json");
    assert_close(shell_number("value"), 0.5 / cos(0.9), 0, 1e-8);
}

/* x(T) = 1 - x(0): x = cos(t - T / 2) / (2 cos(T / 2)); by every rule that comes near. */
static void a_relation(void **state)
{
    (void)state;
    static const char *const how[] = {"--tol 1e-8", "--rule gauss4", "--rule gauss2 --solver lbfgs",
                                      "--rule gauss3 --init ode"};
    double ends[2], time;
    for (size_t k = 0; k < sizeof how / sizeof *how; k++) {
        shell_works("$LA path spring --relate 'q(T)=-q(0)+1' --time 1.4 %s --csv found.csv --json",
                    how[k]);
        assert_true(shell_number("free_momentum") < 1e-5);
        read_ends(1, ends, &time);
        assert_close(ends[0], 0.5, 0, 1e-5);
        assert_close(ends[1], 1 - ends[0], 1e-15, 1e-15);
    }
    shell_works("$LA path kepler --start y=0 --relate 'x(T)=-.5*x(0),y(T)-pi/2*x(0)=1e-1-.1' "
                "--time 3 --tol 1e-9 --csv found.csv --json");
    assert_true(shell_number("free_momentum") < 1e-7);
    double two[4];
    read_ends(2, two, &time);
    assert_true(two[1] == 0);
    assert_close(two[2], -.5 * two[0], 1e-14, 0);
    assert_close(two[3], M_PI / 2 * two[0], 1e-14, 0);
    assert_int_equal(shell("$LA path pendulum --set l=1 --relate 'theta(T)=theta(0)+2pi' --time 5 "
                           "--tol 1e-6"),
                     1); /* one of a family that is shifted in time */
    shell_works("$LA path pendulum --set l=1 --start theta=0 --relate 'theta(T)=theta(0)+2pi' "
                "--time 5 --tol 1e-6");
    assert_int_equal(shell("$LA path spring --relate 'q(T)=--2'"), 2);
    assert_int_equal(shell("$LA path spring --relate \"q(T)=$(printf '9%%.0s' $(seq 90))\""), 2);
    shell_works("$LA path spring --relate 'q(T)=q(0)+1' --time 2 --rule gauss4 --all --json");
    assert_true(shell_number("starts_led") >= 30 && shell_number("free_momentum") < 1e-8);
}

/* Upwards with energy E to a height: v0 - v1, by all rules but left to rounding; free in height,
   too, it stops at the top. */
static void a_free_time(void **state)
{
    (void)state;
    double v0 = sqrt(2 * 3.2), v1 = sqrt(2 * (3.2 - 0.8)), time;
    shell_works("$LA path freebody --end x=0.8 --time free --dt 0.02 --slices 21 --energy 3.2 "
                "--tol 1e-9 --json");
    assert_close(shell_number("time"), v0 - v1, 0, 1e-8);
    assert_close(shell_number("energy"), 3.2, 0, 1e-8);
    shell_works("$LA path brachistochrone --tol 1e-8 --json");
    assert_close(shell_number("time"), 1.801603122, 0, 1e-8);
    assert_int_equal(shell("$LA path freebody --end x=0.8 --time free --energy -1"), 1);
    shell_works("$LA path freebody --end x=0.8 --time free --dt 0.2 --slices 31 --energy 3.2 --all "
                "--csv found.csv --json");
    assert_close(shell_number_in("paths", "time"), v0 - v1, 1e-10, 0);
    assert_close(shell_number("time_limit"), 6, 1e-10, 0);
    assert_close(shell_number("time"), v0 - v1, 1e-10, 0);
    assert_close(shell_number("energy"), 3.2, 1e-10, 0);
    double ends[2];
    read_ends(1, ends, &time);
    assert_close(time, v0 - v1, 1e-10, 0);
    assert_int_equal(shell("$LA path freebody --end x=4 --time free --energy 3.2 --all"), 1);
    assert_int_equal(shell("$LA path brachistochrone --all"), 1); /* L is singular at its start */
    assert_int_equal(shell("$LA path freebody --end x=9 --time free --energy 3.2 --tol 1e-6"), 1);
}

/* H6: a motion that is not finite, and not needed, fails nothing. */
static void no_motion_is_needed(void **state)
{
    (void)state;
    static const char *const how[] = {"", "--init guess.csv", "--rule gauss2", "--tol 1e-3"};
    shell_works("printf 'q\\n1\\n.1\\n0\\n0\\n.5\\n' >guess.csv");
    assert_int_not_equal(shell("$LA path spring --set k=-1e6 --slices 5 --tol 1e-3"), 0);
    for (size_t k = 0; k < sizeof how / sizeof *how; k++) {
        shell_works("$LA path spring --set k=-1e6 --end q=.5 --time 0.01 --slices 5 %s --json",
                    how[k]);
    }
}

/* Files of a scene with a coordinate t have a column `time`, and are read as they were written. */
static void a_coordinate_named_t(void **state)
{
    (void)state;
    double ends[4], time;
    shell_works(
        "$LA build $ROOT/tests/apps/scenes/world_line.c --quiet --include $ROOT --out w.so");
    shell_works("$LA simulate ./w.so --time 2 --csv motion.csv --quiet && grep -q "
                "'^time,t,x,v_t,v_x$' motion.csv");
    shell_works("$LA path ./w.so --csv found.csv --quiet && grep -q '^time,t,x$' found.csv");
    shell_works(
        "$LA path ./w.so --start found.csv --end found.csv --init found.csv --csv again.csv "
        "--quiet && mv again.csv found.csv");
    read_ends(2, ends, &time);
    assert_close(time, 1, 0, 1e-12);
    assert_true(ends[0] == 3 && ends[1] == 0.5);
    assert_close(ends[2], 4.25, 0, 1e-12);
    assert_close(ends[3], 1.25, 0, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(ends_stand, shell_empty),
        cmocka_unit_test_setup(ends_from_elsewhere, shell_empty),
        cmocka_unit_test_setup(a_free_coordinate, shell_empty),
        cmocka_unit_test_setup(a_relation, shell_empty),
        cmocka_unit_test_setup(a_free_time, shell_empty),
        cmocka_unit_test_setup(no_motion_is_needed, shell_empty),
        cmocka_unit_test_setup(a_coordinate_named_t, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
