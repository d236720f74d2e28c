/* A trained model wherever a scene is: simulate, path, modes, check, scans. */
#include "shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <string.h>

#define FREQUENCY 1.2403473 /* sqrt(2 / 1.3) */

/* A spring, H = p^2/2.6 + q^2, and models of it. */
static int setup(void **state)
{
    (void)state;
    shell_clean();
    FILE *out = fopen(shell_path("spring.csv"), "w");
    assert_non_null(out);
    fputs("q,p,v,dqdt,dpdt,dvdt\n", out);
    for (int k = 0; k < 200; k++) {
        double q = 1.5 * sin(2.3 * k + 0.1), p = 1.4 * cos(1.7 * k);
        fprintf(out, "%.12g,%.12g,%.12g,%.12g,%.12g,%.12g\n", q, p, p / 1.3, p / 1.3, -2 * q,
                -2 * q / 1.3);
    }
    fclose(out);
#define TRAIN "$LA train spring.csv --hidden 12 --lr 1e-2 --steps 600 --normalise --quiet "
    shell_works(TRAIN "--state q,p --rate dqdt,dpdt --out hnn.h5");
    shell_works(TRAIN "--state q,v --rate dqdt,dvdt --model lnn --out lnn.h5");
    return 0;
}

static void test_motions_and_modes(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        const char *name = k ? "lnn" : "hnn";
        shell_works("$LA modes %s.h5 --within q=-1:1 --json", name);
        assert_close(shell_number_in("modes", "frequency"), FREQUENCY, 0.05, 0);
        assert_mentions(shell_last_line(), "\"learnt\": true");
        assert_int_equal(shell("$LA check %s.h5 --json --slices 20", name), 0);
        assert_mentions(shell_last_line(), "\"learnt\": true");
        shell_works("$LA simulate %s.h5 --time 1 --no-reference --json", name);
        assert_true(isnan(shell_number("outside_from")));
        shell_works("$LA simulate %s.h5 --time 1 --no-reference --set q0=4 --json", name);
        assert_true(shell_number("outside_from") == 0);
        assert_mentions(shell_last_line(), "\"outside\"");
    }
    assert_int_equal(shell("$LA simulate lnn.h5 --set x0=4"), 2);
    assert_mentions(shell_err(), "lnn.h5 x0 q0");
    assert_int_equal(shell("$LA simulate none.h5"), 2);
    assert_mentions(shell_err(), "none.h5");
    shell_works("$LA simulate spring --time 1 --no-reference --json");
    assert_null(strstr(shell_last_line(), "learnt"));
}

/* The last row of a table: t and q. */
static void last_row(const char *file, double *t, double *q)
{
    char line[256];
    FILE *in = fopen(shell_path(file), "r");
    assert_non_null(in);
    while (fgets(line, sizeof line, in))
        sscanf(line, "%lf,%lf", t, q);
    fclose(in);
}

/* The path between two points of a rollout, halfway, against another rollout. */
static void test_path_is_the_motion(void **state)
{
    double t, q, t_end, q_end;
    char line[256];
    (void)state;
    shell_works("$LA rollout lnn.h5 --x0 .5,.3 --time .7 --rtol 1e-12 --csv half.csv --quiet");
    shell_works("$LA rollout lnn.h5 --x0 .5,.3 --time 1.4 --rtol 1e-12 --csv all.csv --quiet");
    last_row("half.csv", &t, &q);
    last_row("all.csv", &t_end, &q_end);
    shell_works("$LA path lnn.h5 --start q=.5 --end q=%.15g --time 1.4 --rule gauss6 --slices 21 "
                "--solver newton --csv path.csv --json",
                q_end);
    assert_mentions(shell_last_line(), "\"learnt\": true");
    FILE *in = fopen(shell_path("path.csv"), "r");
    assert_non_null(in);
    double at = -1, there = 0, found = 1e9;
    while (fgets(line, sizeof line, in))
        if (sscanf(line, "%lf,%lf", &at, &there) == 2 && fabs(at - t) < 1e-9)
            found = there;
    fclose(in);
    assert_close(found, q, 1e-8, 0);
}

static void test_scan(void **state)
{
    (void)state;
    shell_works("$LA simulate lnn.h5 --time 1 --no-reference --scan q0=.2:.4:2 --json");
    assert_int_equal(shell("$LA simulate lnn.h5 --scan m=1:2:2"), 2);
    assert_mentions(shell_err(), "lnn.h5 m");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_motions_and_modes, setup),
        cmocka_unit_test(test_path_is_the_motion),
        cmocka_unit_test(test_scan),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
