/* leastaction path --tol and --continue where paths are steep: kinks, pulses, layers, close passes.
 */
#include "tests/close.h"
#include "tests/apps/shell.h"
#include "physics/io/csv.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Uneven slices: times in the CSV, and the motion that the path is compared with. */
static void test_uneven_slices(void **state)
{
    (void)state;
    size_t rows, columns;
    double *values;
    struct ad_error error = {0};
    shell_works("$LA path double-well --set a=1 --set height=-1250 --start x=0 --end x=1 --time 1 "
                "--rule gauss4 --tol 1e-9 --csv found.csv --json");
    assert_true(shell_number("shortest_dt") < 0.5 * shell_number("dt"));
    assert_int_equal(phys_table_read(shell_path("found.csv"), &rows, &columns, &values, &error),
                     AD_OK);
    for (size_t i = 0; i < rows; i++)
        assert_close(values[2 * i + 1], tanh(values[2 * i] / 0.02), 0, 1e-9);
    free(values);
    shell_works("$LA path kepler --set e=0.9 --tol 1e-8 --json");
    assert_true(shell_number("shortest_dt") < 0.5 * shell_number("dt"));
    assert_close(shell_number("reference_action"), 1.5 * M_PI, 0, 1e-8);
    assert_close(shell_number("max_error"), 0, 0, 1e-8);
    assert_close(shell_number("true_distance"), 0, 0, 1e-7);
    /* from a line through the centre Newton's method finds a fall into it, which is no motion */
    assert_int_equal(shell("$LA path kepler --start x=0.1,y=0 --end x=-1,y=0 --time 2 --tol 1e-4"),
                     1);
}

static void test_continuation(void **state)
{
    (void)state;
    size_t rows, columns;
    double *values;
    struct ad_error error = {0};
    shell_works("$LA path double-well --set a=1 --continue height=-0.5:-5e5 --start x=0 --end x=1 "
                "--time 1 --tol 1e-9 --csv found.csv --json");
    assert_int_equal(phys_table_read(shell_path("found.csv"), &rows, &columns, &values, &error),
                     AD_OK);
    for (size_t i = 0; i < rows; i++)
        assert_close(values[2 * i + 1], tanh(values[2 * i] / 1e-3), 0, 1e-9);
    free(values);
    assert_mentions(shell_out(), "\"continued_values\": [-0.5,");
    /* a whole kink: between distant ends nothing holds its place */
    assert_int_equal(shell("$LA path double-well --set a=1 --continue height=-0.5:-5e3 "
                           "--start x=-1 --end x=1 --time 2 --tol 1e-6"),
                     1);
    assert_mentions(shell_err(), "height = -");
    /* q'' = 4 height q near q = 0, whose index changes at height = -pi^2 / 4: that is told */
    shell_works("$LA path double-well --set a=1 --continue height=-1:-4 --start x=0 --end x=0 "
                "--time 1 --init line --tol 1e-6 --json");
    assert_non_null(strstr(shell_out(), "\"continued_indices\": [0, 0"));
    assert_non_null(strstr(shell_out(), "1, 1], "));
    /* a pendulum that hovers above, swings round and hovers again: no fold, but few elements hold
       it; what the end is known to is another matter */
    int status = shell("$LA path pendulum --continue g=9.81:17 --start theta=1.5707963267948966 "
                       "--end theta=-1.5011146643394331 --tol 1e-2 --json");
    assert_null(strstr(shell_err(), "lost"));
    if (status == 0)
        assert_close(shell_number("energy"), 2 * 180 * 17., 1e-3, 0);
}

/* Grids that place a kink alike agree with each other: no success where the motion is elsewhere. */
static void test_kinks(void **state)
{
    (void)state;
    static const char *const kinks[] = {"ad_abs(x)",
                                        "ad_sub(ad_acos(ad_cos(x)),ad_mul(0.1,ad_sin(x)))"};
    for (size_t k = 0; k < LENGTH(kinks); k++) {
        shell_works("${CC:-cc} -std=c11 -shared -fPIC -I$ROOT '-DV(x)=%s' "
                    "$ROOT/tests/apps/scenes/kink.c -o k.so",
                    kinks[k]);
        int missed = 0;
        for (int slices = 21; slices <= 36; slices += 5) {
            int status =
                shell("$LA path ./k.so --slices %d --dt 0.1 --init ode --tol 1e-6 --json", slices);
            assert_true(status == 1 || (status == 0 && shell_number("true_distance") <= 1e-6));
            missed += status == 1;
        }
        assert_true(missed > 0);
    }
}

/* A14: kicks of 1 at t0 on the way from 0 to 1 in 10, which elements may be blind to: no success
   unless the motion from the path's start, which begins at 1/10 - (10 - t0)/10, takes them. */
static void test_pulses(void **state)
{
    (void)state;
    static const double places[] = {5, 7.35}, widths[] = {1, 0.01, 1e-3, 1e-5};
    int missed = 0;
    shell_works(
        "${CC:-cc} -std=c11 -shared -fPIC -I$ROOT $ROOT/tests/apps/scenes/narrow.c -o narrow.so");
    for (size_t i = 0; i < LENGTH(places); i++)
        for (size_t k = 0; k < LENGTH(widths); k++) {
            int status =
                shell("$LA path ./narrow.so --set pulse=1 --set t0=%g --set w=%g --time 10 "
                      "--start x1=0 --end x1=1 --tol 1e-6 --json --csv pulse.csv",
                      places[i], widths[k]);
            assert_true(status == 1 || (status == 0 && shell_number("true_distance") <= 1e-6));
            if (status == 0 && widths[k] < 1)
                shell_works("awk -F, 'NR == 3 { d = $2 - $1 * (%g - 9) / 10; exit d > 1e-6 || d < "
                            "-1e-6 }' pulse.csv",
                            places[i]);
            missed += status == 1;
        }
    assert_in_range(missed, 1, 7);
}

/* A14: fronts that travel, of speed 10, meet the path where its start is not. */
static void test_fronts(void **state)
{
    (void)state;
    static const char *const steep[] = {"1e2", "1e4", "1e7"};
    for (size_t k = 0; k < LENGTH(steep); k++) {
        shell_works("${CC:-cc} -std=c11 -shared -fPIC -I$ROOT "
                    "'-DV(x)=ad_mul(-0.1,ad_tanh(ad_mul(%s,ad_sub(ad_add(x,20.0),"
                    "ad_mul(10.0,t)))))' $ROOT/tests/apps/scenes/kink.c -o k.so",
                    steep[k]);
        assert_int_equal(
            shell("$LA path ./k.so --start x1=1 --end x1=3 --time 6 --tol 1e-6 --json"), 1);
        assert_true(shell_number("true_distance") > 1e-3);
    }
}

/* Layers exp(-t/eps) at both ends, thinner than the elements there: the slices next to the ends err
   most, and count. */
static void test_layers_at_the_ends(void **state)
{
    (void)state;
    static const double widths[] = {1e-4, 2e-4, 1e-3};
    for (size_t k = 0; k < LENGTH(widths); k++) {
        shell_works("${CC:-cc} -std=c11 -shared -fPIC -I$ROOT "
                    "'-DV(x)=ad_mul(%.17g,ad_square(x))' $ROOT/tests/apps/scenes/kink.c -o k.so",
                    -1 / (widths[k] * widths[k])); /* the mass is 2 */
        int status = shell("$LA path ./k.so --start x1=1 --end x1=2 --time 1 --tol 1e-3 --quiet "
                           "--csv layer.csv");
        if (status == 0)
            shell_works("awk -F, -v e=%g 'NR > 1 { d = $2 - exp(-$1 / e) - 2 * exp(($1 - 1) / e); "
                        "wrong += d > 1e-3 || d < -1e-3; n++ } END { exit !(n > 10 && wrong == 0) "
                        "}' layer.csv",
                        widths[k]);
        assert_true(status == 0 || (status == 1 && widths[k] < 2e-4));
    }
}

/* H7: a kink tanh(t/eps), eps .02, between distant ends may lie anywhere, for all that double
   precision can tell. */
static void test_a_path_that_nothing_holds(void **state)
{
    (void)state;
    shell_works("${CC:-cc} -std=c11 -shared -fPIC -I$ROOT "
                "'-DV(x)=ad_mul(-2500.0,ad_square(ad_sub(1.0,ad_square(x))))' "
                "$ROOT/tests/apps/scenes/kink.c -o k.so");
    shell_works("awk 'BEGIN { for (i = -32; i <= 32; i++) print i / 32 }' >line.csv");
    assert_int_equal(shell("$LA path ./k.so --init line.csv --slices 65 --dt 0.03125 --tol 1e-6"),
                     1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_uneven_slices, shell_empty),
        cmocka_unit_test_setup(test_continuation, shell_empty),
        cmocka_unit_test_setup(test_kinks, shell_empty),
        cmocka_unit_test_setup(test_pulses, shell_empty),
        cmocka_unit_test_setup(test_fronts, shell_empty),
        cmocka_unit_test_setup(test_layers_at_the_ends, shell_empty),
        cmocka_unit_test_setup(test_a_path_that_nothing_holds, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
