/* Models with inputs in the command: what gives them, what is refused, and that other commands do
   not take such models for others. */
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Two trials of some motion q, p over t with a parameter g and a force u; d.csv is the first. */
static int setup(void **state)
{
    shell_empty(state);
    shell_works("awk 'BEGIN { print \"trial,t,q,p,g,u\"; OFS = \",\"; "
                "for (k = 0; k < 2; k++) for (i = 0; i < 30; i++) { t = i / 20; "
                "print k, t, cos(t + k), -sin(t + k), k + 1, sin(3 * t) } }' >all.csv; "
                "grep -v ^1 all.csv >d.csv");
    shell_works("$LA train all.csv --state q,p --time t --inputs g,t --controls u --hidden 6 "
                "--steps 20 --normalise --out m.h5 --json");
    assert_mentions(shell_out(), "\"inputs\": \"t,g,u\"");
    assert_true(shell_number("controls") == 1);
    return 0;
}

static void refused(const char *command, const char *says)
{
    if (shell("$LA %s", command) != 2)
        fail_msg("%s: %s%s", command, shell_out(), shell_err());
    assert_mentions(shell_err(), says);
}

/* The same motion, whoever gives the inputs; another one where they are held. */
static void who_gives(void **state)
{
    (void)state;
    shell_works("$LA rollout m.h5 --truth d.csv --time-column t --json --csv a.csv");
    assert_true(isnan(shell_number("conserved_drift")));
    assert_true(shell_number("coordinate_mse") >= 0);
    shell_works("tail -1 a.csv");
    double t, from_truth[2], q, p;
    assert_int_equal(sscanf(shell_out(), "%lf,%lf,%lf", &t, from_truth, from_truth + 1), 3);
    assert_close(t, 1.45, 1e-12, 0);
    static const char *const how[] = {
        "--inputs d.csv", "--inputs d.csv --fix g=1", "--inputs d.csv --fix g=2 --fix g=1",
        "--interpolation hold --inputs d.csv", "--inputs d.csv --fix g=2"};
    for (int k = 0; k < 5; k++) {
        shell_works("$LA rollout m.h5 --x0 1,0 --time 1.45 --points 2 %s --csv b.csv --quiet",
                    how[k]);
        shell_works("tail -1 b.csv");
        assert_int_equal(sscanf(shell_out(), "%lf,%lf,%lf", &t, &q, &p), 3);
        if (k < 3)
            assert_close(p, from_truth[1], 1e-6, 0);
        else
            assert_true(fabs(p - from_truth[1]) > 1e-4);
    }
    shell_works(
        "$LA convert m.h5 --out m.safetensors; $LA convert m.safetensors --out n.h5; "
        "$LA rollout n.h5 --truth d.csv --time-column t --csv c.csv --quiet; cmp a.csv c.csv");
    /* a parameter alone leaves H as it is */
    shell_works("$LA train all.csv --state q,p --time t --inputs g --hidden 6 --steps 20 --out "
                "g.h5 --quiet; "
                "$LA rollout g.h5 --x0 1,0 --time 5 --fix g=1.5 --json");
    assert_true(shell_number("conserved_drift") < 1e-6);
}

/* The field in a picture is that of the parameters; one that changes is not drawn. */
static void pictures(void **state)
{
    (void)state;
    shell_works("$LA train all.csv --state q,p --time t --inputs g --hidden 6 --steps 20 --out "
                "g.h5 --quiet");
    static const char *const how[] = {"g.h5 --fix g=1", "g.h5 --inputs d.csv", "g.h5 --fix g=2",
                                      "m.h5 --inputs d.csv"};
    for (int k = 0; k < 4; k++)
        shell_works("PATH=/none $LA rollout %s --x0 1,0 --time 1.4 --quiet --plot %d.svg", how[k],
                    k);
    shell_works("for k in 0 1 2; do sed '1,/arrows/d' $k.svg.dat >$k; done; test -s 0; cmp 0 1; "
                "! cmp -s 0 2; ! grep arrows 3.svg.dat");
}

/* Parameters of an lnn are constant, its controls need not be. */
static void lagrangian(void **state)
{
    (void)state;
    shell_works("$LA train all.csv --model lnn --quadratic --state q,p --time t --inputs g,t "
                "--controls u --hidden 6 --steps 20 --out l.h5 --quiet; "
                "$LA rollout l.h5 --truth d.csv --time-column t --quiet");
    shell_works("awk -F, -v OFS=, 'NR == 9 { $5 = 2 } { print }' d.csv >g.csv");
    refused("rollout l.h5 --truth g.csv --time-column t", "l.h5 --fix");
}

static void what_is_refused(void **state)
{
    (void)state;
    refused("rollout m.h5 --x0 1,0 --time 1", "g,u --inputs --fix");
    refused("rollout m.h5 --x0 1,0 --time 1 --fix g=1", "u --inputs");
    refused("rollout m.h5 --x0 1,0 --time 2 --inputs d.csv", "inputs 1.45");
    refused("rollout m.h5 --x0 1,0 --time 1 --inputs all.csv", "increase");
    refused("rollout m.h5 --x0 1,0 --time 1 --inputs d.csv --fix h=1", "h");
    refused("rollout m.h5 --x0 1,0 --time 1 --inputs d.csv --fix t=1", "t");
    refused("rollout m.h5 --x0 1,0 --time 1 --fix g=nan", "--fix g=nan");
    refused("rollout m.h5 --x0 1,0 --time 1 --fix g=1 --fix u=0 --inputs d.csv", "--inputs --fix");
    refused("rollout m.h5 --x0 1,0 --time 1 --fix g=1 --fix u=0 --interpolation hold",
            "--interpolation --fix");
    refused("rollout m.h5 --x0 1,0 --time 1 --inputs d.csv --interpolation cubic", "linear hold");
    refused("rollout m.h5 --x0 1,0 --time 1 --inputs d.csv --add-energy 1 --at 0.5",
            "--add-energy");
    shell_works("cut -d, -f1-5 d.csv >no_u.csv");
    refused("rollout m.h5 --truth no_u.csv --time-column t", "no_u.csv 'u'");
    refused("train all.csv --model lnn --state q,p --time t --inputs u", "u --controls");
    refused("train all.csv --model baseline --state q,p --time t --controls u", "baseline");
    refused("train all.csv --from m.h5 --state q,p --time t --inputs g,t", "m.h5 t,g,u");
    refused("train all.csv --state q,p --time t --hold --rollout 2", "--hold --inputs");
    refused("field m.h5", "m.h5 inputs");
    refused("modes m.h5", "m.h5 time");
    refused("quantum --scene m.h5", "m.h5 time");
    refused("simulate m.h5 --set t=1", "t");
}

/* Inputs are parameters of a scene, and the time is the scene's. */
static void scene(void **state)
{
    (void)state;
    double drift[2];
    shell_works("$LA check m.h5 --set g=1.5");
    for (int k = 0; k < 2; k++) {
        shell_works("$LA simulate m.h5 --set g=1.5 --set u=%d --time 0.2 --no-reference --csv - "
                    "--samples 1 --quiet | tail -1 | cut -d, -f2",
                    k);
        drift[k] = strtod(shell_out(), NULL);
    }
    assert_true(fabs(drift[1] - drift[0]) > 1e-6);
    shell_works("$LA simulate m.h5 --set g=1.5 --inputs d.csv --time 0.2 --no-reference --csv - "
                "--samples 1 --quiet | tail -1 | cut -d, -f2");
    double by_table = strtod(shell_out(), NULL);
    assert_true(by_table != drift[0] && fabs(by_table - drift[0]) < fabs(drift[1] - drift[0]));
    refused("simulate m.h5 --set g=1 --set u=0 --inputs d.csv", "--inputs --set");
    refused("simulate spring --inputs d.csv", "--inputs model");
    refused("simulate m.h5 --inputs no.csv", "no.csv");
    shell_works("$LA simulate m.h5 --scan u=-1:1:3 --time 0.1 --no-reference");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(who_gives, setup),       cmocka_unit_test_setup(pictures, setup),
        cmocka_unit_test_setup(scene, setup),           cmocka_unit_test_setup(lagrangian, setup),
        cmocka_unit_test_setup(what_is_refused, setup),
    };
    return cmocka_run_group_tests_name("inputs_command", tests, shell_setup, shell_teardown);
}
