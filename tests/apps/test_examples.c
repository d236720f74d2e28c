/* Builds the Lagrangians of docs/examples as a reader would; each passes its checks and moves by
   its closed form. */
#include "tests/close.h"
#include "tests/files.h"
#include "shell.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static void build(const char *name, const char *settings)
{
    shell_clean();
    assert_int_equal(
        shell("$LA build $ROOT/docs/examples/%s.c --include $ROOT --out %s.so", name, name), 0);
    assert_string_equal(shell_err(), ""); /* no warnings */
    assert_int_equal(shell("$LA check ./%s.so %s", name, settings), 0);
}

/* Runs a command line that writes CSV to `file` and reads row `row` (-1: the last) after the
   header; returns the number of columns. */
static size_t row_of(const char *file, int row, double *to, size_t most)
{
    FILE *in = fopen(shell_path(file), "r");
    static char line[1 << 16], kept[1 << 16];
    size_t n = 0;
    assert_non_null(in);
    assert_non_null(fgets(line, sizeof line, in)); /* header */
    for (int k = 0; fgets(line, sizeof line, in); k++)
        if (row < 0 || k == row)
            memcpy(kept, line, sizeof kept);
    fclose(in);
    for (char *at = kept, *end; n < most; at = end + 1) {
        to[n++] = strtod(at, &end);
        if (*end != ',')
            break;
    }
    return n;
}

/* The last sample of `simulate NAME.so OPTIONS`: t, coordinates, velocities. */
static void end_of(const char *name, const char *options, double *to, size_t n)
{
    assert_int_equal(shell("$LA simulate ./%s.so %s --integrator dop853 --no-reference --samples 4 "
                           "--csv end.csv --quiet",
                           name, options),
                     0);
    assert_int_equal(row_of("end.csv", -1, to, n), n);
}

/* Newton finds the motion between its ends. */
static void assert_path_found(const char *name)
{
    assert_int_equal(shell("$LA path ./%s.so --rule gauss3 --json", name), 0);
    const char *error = strstr(shell_last_line(), "\"max_error\": ");
    assert_non_null(error);
    assert_true(strtod(error + strlen("\"max_error\": "), NULL) < 1e-10);
}

/* After a turn the charge is back; no gauge shows in the motion, nor, by a rule that integrates
   the gauge term exactly, in the path. */
static void test_magnetic(void **state)
{
    (void)state;
    double end[5];
    char options[80];
    build("magnetic", "");
    snprintf(options, sizeof options, "--time %.17g --set gauge=0.9", PI);
    end_of("magnetic", options, end, 5);
    assert_close(end[1], 1, 0, 1e-8);
    assert_close(end[2], 0, 0, 1e-8);
    assert_int_equal(
        shell("$LA path ./magnetic.so --rule midpoint --set gauge=0.2 --csv a.csv --quiet"), 0);
    assert_int_equal(
        shell("$LA path ./magnetic.so --rule midpoint --set gauge=0.9 --csv b.csv --quiet"), 0);
    for (int slice = 0; slice < 99; slice++) {
        double a[3], b[3];
        assert_int_equal(row_of("a.csv", slice, a, 3), 3);
        assert_int_equal(row_of("b.csv", slice, b, 3), 3);
        assert_close(a[1], b[1], 0, 1e-12);
        assert_close(a[2], b[2], 0, 1e-12);
    }
}

static void test_relativistic(void **state)
{
    (void)state;
    double end[3];
    build("relativistic", "");
    end_of("relativistic", "--time 50 --tol 1e-11", end, 3);
    assert_close(end[1], sqrt(1 + 50.0 * 50) - 1, 1e-9, 0);
    assert_close(end[2], 50 / sqrt(1 + 50.0 * 50), 1e-9, 0);
    assert_path_found("relativistic");
}

/* Kapitza: a w against sqrt(2 g l) = 4.43. */
static void test_driven(void **state)
{
    (void)state;
    double end[3];
    build("driven", "");
    assert_int_equal(shell("$LA simulate ./driven.so --time 10 --set w=60 --integrator dop853 "
                           "--no-reference --samples 20 --csv swing.csv --quiet"),
                     0);
    for (int k = 0; k <= 20; k++) {
        assert_int_equal(row_of("swing.csv", k, end, 3), 3);
        assert_close(end[0], 0.5 * k, 0, 1e-12);
        assert_true(fabs(end[1] - PI) < 0.3);
    }
    end_of("driven", "--time 2 --set w=30", end, 3);
    assert_true(fabs(end[1] - PI) > 0.5);
}

/* Damped and driven in closed form: tests/physics/test_forces.c has the same one. */
static void test_damped(void **state)
{
    (void)state;
    double end[3];
    build("damped", "");
    end_of("damped", "--time 20 --tol 1e-12", end, 3);
    assert_close(end[1], -0.0477178707035095, 0, 1e-10);
    shell_works("$LA simulate ./damped.so --integrator rk4 --dt 0.01 --time 20 --json");
    assert_close(shell_number("energy_balance"), 0, 0, 1e-7);
    assert_true(shell_number("energy_balance") > 10 * shell_number("work_uncertainty"));
    assert_close(shell_number("work"), -1.9317871, 0, 1e-4);
    assert_true(isnan(shell_number("energy_drift")));
    shell_works("$LA simulate pendulum --time 1 --json");
    assert_true(isnan(shell_number("work")));
    assert_int_equal(shell("$LA path ./damped.so"), 2);
    assert_int_equal(shell("$LA path ./damped.so --tol 1e-6"), 2);
    assert_int_equal(shell("$LA path ./damped.so --all"), 2);
    assert_int_equal(shell("$LA modes ./damped.so"), 2);
}

/* From rest, the rod bears m g (3 - 2 cos 1) at the lowest place; L_z is what --csv says. */
static void test_rod(void **state)
{
    (void)state;
    double row[8];
    build("rod", "");
    shell_works("$LA simulate ./rod.so --time 2 --tol 1e-9 --json --csv rod.csv --out rod.h5");
    assert_close(shell_number("constraint_residual"), 0, 0, 1e-8);
    assert_close(shell_number("energy_drift"), 0, 0, 1e-8);
    assert_non_null(strstr(shell_last_line(), "\"name\": \"L_z\""));
    for (int k = 100; k < 1000; k += 100) { /* t, x, y, velocities, reactions, L_z */
        assert_int_equal(row_of("rod.csv", k, row, 8), 8);
        const double pull = row[3] * row[3] + row[4] * row[4] - 9.81 * row[2];
        assert_close(row[5], -pull * row[1], 0, 1e-7);
        assert_close(row[6], -pull * row[2], 0, 1e-7);
        assert_close(row[7], row[1] * row[4] - row[2] * row[3], 0, 1e-12);
    }
    shell_works("$LA dump rod.h5");
    shell_works("$LA path ./rod.so --tol 1e-9 --init ode --csv rod.csv --out rod.h5 --quiet");
    for (int k = 0; k < 2; k++) { /* from rest at theta = 1: m g (3 cos - 2 cos 1) inwards */
        assert_int_equal(row_of("rod.csv", k - 1, row, 8), 5);
        const double pull = 9.81 * (-3 * row[2] - 2 * cos(1));
        assert_close(row[3], -pull * row[1], 0, 1e-7);
        assert_close(row[4], -pull * row[2], 0, 1e-7);
    }
    shell_works("$LA dump rod.h5 --dataset reaction --quiet");
    shell_works("sed 's/unit = \"[msJ]\"/unit = \"1\"/' \"$ROOT/docs/examples/rod.c\" >pure.c && "
                "$LA build pure.c --include \"$ROOT\" --quiet && $LA path ./pure.so --tol 1e-9");
    assert_non_null(strstr(shell_out(), "  constraint force at slices")); /* C10: without a unit */
    assert_null(strchr(strstr(shell_out(), "  constraint force at slices"), '/'));
    assert_int_equal(shell("$LA modes ./rod.so"), 2);
    assert_int_equal(shell("$LA simulate ./rod.so --lyapunov 1"), 2);
    assert_int_equal(shell("$LA simulate ./rod.so --sensitivity"), 2);
    assert_int_equal(shell("$LA simulate ./rod.so --horizon 1e-6"), 2);
    assert_int_equal(shell("$LA simulate ./rod.so --periodic 2"), 2);
    assert_int_equal(shell("$LA fit ./rod.so rod.csv --free l"), 2);
}

/* A small swing about the tilted rest comes back after 2 pi/(w sin theta). */
static void test_hoop(void **state)
{
    (void)state;
    const double rest = acos(9.81 / 25);
    double end[3];
    char options[80];
    build("hoop", "");
    snprintf(options, sizeof options, "--time %.17g --tol 1e-12", 2 * PI / (5 * sin(rest)));
    end_of("hoop", options, end, 3);
    assert_close(end[1] - rest, 1e-4, 1e-5, 0);
    assert_close(end[2], 0, 0, 1e-7);
}

/* The lowest mode of a thousand masses is back after its period, every mass of it. */
static void test_chain(void **state)
{
    (void)state;
    static double end[2001];
    char options[80];
    build("chain", "--set masses=50");
    snprintf(options, sizeof options, "--time %.17g", PI / sin(PI / 2002));
    end_of("chain", options, end, 2001);
    for (int k = 1; k <= 1000; k++)
        assert_close(end[k], sin(PI * k / 1001), 0, 1e-9);
}

static void test_torus(void **state)
{
    (void)state;
    double end[5];
    build("torus", "");
    end_of("torus", "--time 40 --tol 1e-11", end, 5);
    double from_axis = 2 + cos(end[2]);
    assert_close(from_axis * from_axis * end[3], 9 * 0.25, 1e-9, 0);
    assert_close(hypot(from_axis * end[3], end[4]), hypot(3 * 0.25, 0.7), 1e-9, 0);
    assert_path_found("torus");
}

/* Without gravity half a period of the spring mirrors the length about that at rest. */
static void test_elastic(void **state)
{
    (void)state;
    double end[5];
    char options[80];
    build("elastic", "");
    snprintf(options, sizeof options, "--set g=0 --set k=40 --time %.17g", PI / sqrt(40));
    end_of("elastic", options, end, 5);
    assert_close(end[1], 0.8, 1e-8, 0);
    assert_close(end[2], 0.5, 1e-12, 0);
    assert_path_found("elastic");
}

/* A turn of Kepler's ellipse; the cone's rate; the pendulum's period by the mean of Gauss. */
static void test_what_stays(void **state)
{
    (void)state;
    double end[5], a = 1, b = cos(0.15);
    char options[120];
    const double E = 0.5 * (0.01 + 0.64) - 1 / sqrt(1.04);
    build("orbit", "");
    snprintf(options, sizeof options, "--time %.17g --tol 1e-12", 2 * PI * pow(-0.5 / E, 1.5));
    end_of("orbit", options, end, 5);
    assert_close(end[1], 1, 0, 1e-9);
    assert_close(end[2], 0.2, 0, 1e-9);
    build("spherical", "");
    assert_int_equal(shell("$LA simulate ./spherical.so --mode 1 --continue energy=1"), 1);
    assert_mentions(shell_err(), "no second derivatives");
    snprintf(options, sizeof options, "--set turn0=%.17g --tol 1e-12", sqrt(9.81 / cos(1)));
    end_of("spherical", options, end, 5);
    assert_close(end[1], 1, 0, 1e-9);
    for (int k = 0; k < 6; k++) {
        const double mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
    }
    build("shaken", "");
    snprintf(options, sizeof options, "--set p=0 --set c=0 --time %.17g --tol 1e-12", 2 * PI / a);
    end_of("shaken", options, end, 3);
    assert_close(end[1], 0.3, 0, 1e-10);
}

static void test_refusals(void **state)
{
    (void)state;
    shell_clean();
    assert_int_equal(shell("$LA build nothing.c --include $ROOT"), 2);
    assert_mentions(shell_err(), "leastaction build: nothing.c");
    assert_int_equal(
        shell("echo 'int f(void) { return g; }' > wrong.c; $LA build wrong.c --include $ROOT"), 2);
    assert_mentions(shell_err(), "wrong.c:1:");
    assert_mentions(shell_err(), "leastaction build: wrong.c");
    assert_int_equal(shell("echo 'int x;' > none.c; $LA build none.c --include $ROOT"), 2);
    assert_mentions(shell_err(), "leastaction_scene");
    assert_int_equal(shell("$LA build none.c --include $ROOT --out none.c"), 2);
    assert_int_equal(shell("CC=no-such-compiler $LA build none.c --include $ROOT"), 2);
    assert_mentions(shell_err(), "no-such-compiler");
    assert_int_equal(shell_files(), 2); /* the sources: nothing half-made stays */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refusals),     cmocka_unit_test(test_magnetic),
        cmocka_unit_test(test_relativistic), cmocka_unit_test(test_driven),
        cmocka_unit_test(test_damped),       cmocka_unit_test(test_rod),
        cmocka_unit_test(test_hoop),         cmocka_unit_test(test_chain),
        cmocka_unit_test(test_torus),        cmocka_unit_test(test_elastic),
        cmocka_unit_test(test_what_stays),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
