/* leastaction quantum from outside: measurements, refusals and suggestions, files. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A number of the last line, the last of that name. */
static double number(const char *key)
{
    char name[64];
    snprintf(name, sizeof name, "\"%s\": ", key);
    const char *at = NULL;
    for (const char *next = shell_last_line(); (next = strstr(next, name)); next++)
        at = next;
    assert_non_null(at);
    return strtod(at + strlen(name), NULL);
}

static void test_scenes(void **state)
{
    (void)state;
    static const struct {
        const char *scene;
        double mean, error;
    } cases[] = {{"free", 2, 1e-3}, {"gravity", 1.5, 0.01}, {"harmonic", 1.5, 0.01}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        assert_int_equal(shell("$LA quantum --scene %s --json", cases[k].scene), 0);
        assert_close(number("norm"), 1, 1e-6, 0);
        assert_close(number("mean_x"), cases[k].mean, 0, 1e-4);
        assert_close(number("classical_x"), cases[k].mean, 0, 1e-9);
        assert_true(number("error") < cases[k].error);
        assert_true(number("aliasing") <= 1);
    }
    assert_int_equal(shell("$LA quantum --scene pendulum --json"), 0);
    assert_true(number("error") < 0.01);
    assert_int_equal(shell("$LA quantum --scene double-well --json"), 0);
    assert_true(number("error") < 0.01);
}

/* Three ways to the same packet; a far time in one leap. */
static void test_methods(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA quantum --method kernel --json"), 0);
    double mean = number("mean_x"), error = number("error");
    assert_int_equal(shell("$LA quantum --method fft --json"), 0);
    assert_close(number("mean_x"), mean, 1e-12, 0);
    assert_close(number("error"), error, 1e-6, 0);
    assert_int_equal(shell("$LA quantum --power 2 --json"), 0);
    assert_close(number("mean_x"), mean, 1e-12, 0);
    assert_int_equal(shell("$LA quantum --method crank-nicolson --walls reflect --points 4000 "
                           "--dt .002 --steps 1000 --no-reference --json"),
                     0);
    assert_close(number("mean_x"), mean, 0, 1e-3);
}

static void test_many_packets(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA quantum --packet=-2,.7,2 --packet=1,.5,-1 --json --csv p.csv"), 0);
    assert_non_null(strstr(shell_last_line(), "\"packets\": [{"));
    assert_close(number("mean_x"), -1, 0, 1e-3); /* the last one: from 1 by -1 times 2 */
    assert_int_equal(shell("grep -c . p.csv"), 0);
    assert_int_equal(atoi(shell_out()), 1 + 2 * 5);
}

/* What a refusal suggests is taken; without it, by force, the norm explodes. */
static void test_aliasing(void **state)
{
    (void)state;
    double dt, box;
    int points;
    assert_int_equal(shell("$LA quantum --dt .125"), 2);
    const char *at = strstr(shell_err(), "expected --dt ");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "expected --dt %lf or more, --points %d or more, or a box of %lf",
                            &dt, &points, &box),
                     3);
    assert_int_equal(shell("$LA quantum --dt %.17g --no-reference", dt), 0);
    assert_int_equal(shell("$LA quantum --dt .125 --points %d --no-reference", points), 0);
    assert_int_equal(
        shell("$LA quantum --dt .125 --box=%g,%g --points %d --packet=0,.5,0 --no-reference",
              -box / 2, box / 2, (int)(256 * box / 20)),
        0);
    assert_int_equal(shell("$LA quantum --dt .125 --steps 8 --packet=0,.5,0 --force --json"), 1);
    assert_mentions(shell_err(), "warning: phases");
    assert_true(number("norm") > 1000);
    assert_int_equal(
        shell("$LA quantum --dt .125 --steps 8 --packet=0,.5,0 --force --normalise --json"), 1);
    assert_close(number("norm"), 1, 1e-12, 0);
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *says;
    } cases[] = {
        {"--scene dblpend", "coordinates"},
        {"--box 1", "--box 1: expected positions of the walls: 2 numbers"},
        {"--packet 1,2", "--packet 1,2: expected position, width and momentum: 3 numbers"},
        {"--packet 1,-2,0", "width 0"},
        {"--walls soft", "open reflect ring"},
        {"--rule gauss2", "straight"},
        {"--method euler", "'euler'"},
        {"--method fft --walls reflect", "convolution"},
        {"--every 0", "--every"},
        {"--power 99", "--power"},
        {"--points 400000", "GB"},
        {"--preset book", "paper"},
        {"--set mass=2", "freebody"},
        {"--tol=-1", "--tol"},
        {"--preset paper --dt 3", "--dt preset"},
        {"--preset paper --set m=2", "--set preset"},
        {"--no-reference --tol 1", "--tol --no-reference"},
        {"--power 2 --steps 3", "--steps --power"},
        {"--power 2 --method fft", "--method --power"},
        {"--method crank-nicolson --rule left", "--rule crank-nicolson"},
        {"--scene double-slit --tol 1", "--tol double"},
        {"--scene pendulum --packet 0,2,0", "2 ring 1.19"},
        {"--walls ring --box=0,5.53 --packet 1,2,0", "2 ring 1.05"},
    };
    shell_clean();
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        assert_int_equal(shell("$LA quantum %s --csv a.csv", cases[k].arguments), 2);
        assert_mentions(shell_err(), cases[k].says);
    }
    assert_int_equal(shell_files(), 0);
}

static void assert_in_doubles(double x, double least, double most, const char *of)
{
    if (!(x >= least && x <= most))
        fail_msg("%s: %g, expected %g to %g", of, x, least, most);
}

/* A19: an error is known of every set-up, and above --tol it is exit status 1. */
static void test_errors_are_known(void **state)
{
    (void)state;
    static const struct {
        const char *arguments;
        int status;
        double least, most;
    } cases[] = {
        {"--scene pendulum --method fft --dt 2 --steps 10", 1, 1, 2},
        {"--scene pendulum --method fft --dt 2 --steps 10 --tol 2", 0, 1, 2},
        {"--scene pendulum --steps 20 --walls reflect", 0, 0, 0.01},
        {"--scene double-well --dt 1 --steps 12 --points 400", 1, 1.2, 1.4},
        {"--scene double-well --dt .1 --steps 10 --walls open", 0, 0.001, 0.01},
        {"--scene double-well --steps 20 --absorb .5", 0, 0, 0.01},
        {"--scene harmonic --rule midpoint --dt 4 --steps 1 --points 128", 1, 1, 2},
        {"--scene free --box=-5,5 --points 128 --steps 8", 1, 0.8, 1.1}, /* it has left the box */
        {"--scene free --method fft --walls ring --dt 0.01 --steps 20", 0, 0, 1e-4},
        /* a quarter of the packet is beyond the cut; eigenfunctions of the ring: 0.00586 */
        {"--scene harmonic --walls ring --method fft --box=-2,2", 0, 0.0058, 0.0059},
        {"--scene free --packet=-2,.7,2 --packet=2,.7,7", 1, 0.5, 2}, /* the second one leaves */
        {"--scene double-well --power 3 --dt 0.2 --points 400", 1, 0.01, 2},
        {"--power 60 --points 128 --dt 1", 1, 1, 1}, /* C9: all of it has left */
        {"--scene harmonic --rule midpoint --set k=-1 --dt 1.9 --steps 1", 1, 0.1, 2}, /* F4 */
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        int status = shell("$LA quantum %s --json", cases[k].arguments);
        if (status != cases[k].status)
            fail_msg("%s: %d, %s %s", cases[k].arguments, status, shell_last_line(), shell_err());
        assert_in_doubles(number("error"), cases[k].least, cases[k].most, cases[k].arguments);
    }
    /* What left no slice brings back. */
    assert_int_equal(shell("$LA quantum --power 60 --points 128 --dt 1"), 1);
    assert_null(strstr(shell_err(), "--dt"));
    assert_non_null(strstr(shell_err(), "--box"));
    assert_int_equal(shell("$LA quantum --scene pendulum --method fft --dt 2 --steps 10"), 1);
    assert_null(strstr(shell_err(), "--method"));
}

/* A20: packets that are not in the box, and boxes that nobody gave. */
static void test_boxes(void **state)
{
    (void)state;
    static const char *const refused[] = {
        "--scene harmonic --packet 100,1,0",
        "--packet 0,1,0 --packet 9.9,1,0",
        "--scene cubic",
        "--scene spring --packet 1,.5,0",
    };
    double low, high;
    for (size_t k = 0; k < sizeof refused / sizeof *refused; k++) {
        assert_int_equal(shell("$LA quantum %s", refused[k]), 2);
        assert_null(strstr(shell_err(), "nan"));
        assert_non_null(strstr(shell_err(), "try --box="));
    }
    const char *at = strstr(shell_err(), "try --box="); /* taken, it will do */
    assert_int_equal(sscanf(at, "try --box=%lf,%lf", &low, &high), 2);
    shell_works("$LA quantum --scene spring --packet 1,.5,0 --box=%g,%g --points 512 --dt 0.05 "
                "--steps 20",
                low, high);
}

static void test_outputs(void **state)
{
    (void)state;
    shell_clean();
    assert_int_equal(shell("$LA quantum --out a.h5 --csv a.csv && $LA dump a.h5"), 0);
    assert_non_null(strstr(shell_out(), "density"));
    assert_int_equal(shell_files(), 2);
    if (shell("command -v gnuplot") != 0) {
        print_message("skipped: no gnuplot\n");
        skip();
    }
    assert_int_equal(shell("$LA quantum --plot a.png && $LA quantum --plot a.gif"), 0);
    assert_int_equal(shell_files(), 4);
}

/* A scene of the user's own. */
static void test_shared_object(void **state)
{
    (void)state;
    assert_int_equal(shell("cc -shared -fPIC -I$ROOT $ROOT/tests/apps/scenes/good.c -o good.so"),
                     0);
    assert_int_equal(shell("$LA quantum --scene ./good.so"), 2);
    assert_mentions(shell_err(), "time");
    assert_int_equal(
        shell("sed 's/ad_sin(t)/ad_sin(x)/' $ROOT/tests/apps/scenes/good.c >still.c && cc -shared "
              "-fPIC -I$ROOT -I$ROOT/tests/apps/scenes still.c -o still.so"),
        0);
    assert_int_equal(shell("$LA quantum --scene ./still.so --box=-4,4 --walls reflect --points 400 "
                           "--dt .1 --steps 10 --json"),
                     0);
    assert_true(number("error") < 0.1);
}

/* The fringe at the screen is that of two Gaussian slits, but for the barrier's thickness and the
   packet's length. */
static void test_double_slit(void **state)
{
    (void)state;
    shell_clean();
    assert_int_equal(
        shell("$LA quantum --scene double-slit --points 172 --json --csv s.csv --out s.h5"), 0);
    assert_close(number("fringe_expected"), 4.72935358, 1e-8, 0);
    assert_close(number("fringe"), 4.72935358, 0.04, 0);
    assert_int_equal(shell_files(), 2);
    assert_int_equal(shell("$LA quantum --scene double-slit --set apart=6 --points 170 --json"), 0);
    assert_close(number("fringe"), 4.72935358 * 4 / 6, 0.04, 0);
    assert_int_equal(shell("$LA quantum --scene double-slit --set gap=1"), 2);
    assert_int_equal(shell("$LA quantum --scene double-slit --walls ring"), 2);
    assert_int_equal(shell("$LA quantum --scene double-slit --points 60"), 2);
    assert_mentions(shell_err(), "points");
    assert_int_equal(shell("$LA quantum --scene double-slit --steps 20"), 2);
    assert_mentions(shell_err(), "steps");
}

/* The published variant has the defects it is known for; done right the packet nears the particle
   as hbar falls. */
static void test_paper(void **state)
{
    (void)state;
    double before = 1;
    for (int k = 0; k < 3; k++) {
        double scale = k == 0 ? 0.25 : k == 1 ? 0.5 : 1;
        assert_int_equal(shell("$LA quantum --preset paper --scale %g --json", scale), 0);
        assert_close(number("phases"), 64.0 / 3 * scale, 0.03, 0);
        assert_close(number("ghost"), 2.35619449 / scale, 1e-8, 0);
        /* F8: one kick V' dt of the packet */
        assert_in_doubles(number("effect_of_a_potential"), 1e-3, 0.05, "--preset paper");
        assert_close(number("norm"), 1, 1e-11, 0);
        assert_true(number("error") < 0.8 * before);
        before = number("error");
    }
    assert_true(before < 0.2);
    assert_int_equal(shell("$LA quantum --preset paper --scale 3"), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_errors_are_known),
        cmocka_unit_test(test_boxes),
        cmocka_unit_test(test_scenes),
        cmocka_unit_test(test_methods),
        cmocka_unit_test(test_many_packets),
        cmocka_unit_test(test_aliasing),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_outputs),
        cmocka_unit_test(test_shared_object),
        cmocka_unit_test(test_double_slit),
        cmocka_unit_test(test_paper),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
