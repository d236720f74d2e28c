/* SympNets in the command: a pendulum is followed better than by a baseline, in whole steps; what
   has no use for a map is refused. */
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdio.h>

#define TRAIN "$LA train p.csv --state q,p --time t --rollout 4 --normalise --lr 5e-3 --quiet "

static int setup(void **state)
{
    shell_empty(state);
    shell_works("$LA dataset pendulum --noise 0 --trials 25 --seed 1 --quiet --out p.csv");
    return 0;
}

static void better_than_a_baseline(void **state)
{
    (void)state;
    shell_works(TRAIN "--model sympnet --layers 6 --hidden 30 --steps 2000 --schedule cosine "
                      "--weight-decay 0 --batch 200 --every 1000 --out s.h5");
    shell_works(TRAIN "--model baseline --hidden 40 --steps 200 --schedule cosine "
                      "--weight-decay 0 --batch 200 --every 1000 --out b.h5");
    shell_works(
        "$LA rollout s.h5 --against b.h5 --truth pendulum --x0 2,0 --time 40 --reverse --json");
    assert_true(shell_number("energy_mse") < 0.5 * shell_number_in("against", "energy_mse"));
    assert_true(shell_number("reversal_error") < 1e-10);
    shell_works("$LA rollout s.h5 --x0 1,0 --time 3 --csv a.csv --json");
    assert_mentions(shell_out(), "\"integrator\": \"map\"");
    assert_true(shell_number("points") == 45 && shell_number("evaluations") == 44);
    shell_works("$LA convert s.h5 --out s.safetensors; $LA convert s.safetensors --out n.h5; "
                "$LA rollout n.h5 --x0 1,0 --time 3 --csv b.csv --quiet; cmp a.csv b.csv");
    shell_works(
        "PATH=/none $LA rollout s.h5 --against b.h5 --x0 1,0 --time 3 --plot a.svg --quiet; "
        "test $(grep -c arrows a.svg.dat) = 1; grep 'index 1.*vectors' a.svg.gp");
}

static void refused(const char *command, const char *says)
{
    if (shell("$LA %s", command) != 2)
        fail_msg("%s: %s%s", command, shell_out(), shell_err());
    assert_mentions(shell_err(), says);
}

static void what_is_refused(void **state)
{
    (void)state;
    shell_works(TRAIN "--model sympnet --layers 2 --hidden 4 --steps 2 --out s.h5");
    refused("rollout s.h5 --truth pendulum --starts 3", "s.h5 --starts");
    refused("rollout s.h5 --x0 1,0 --integrator rk4 --dt 0.1", "s.h5 --integrator");
    refused("rollout s.h5 --x0 1,0 --integrator rk4", "s.h5 --integrator");
    refused("rollout s.h5 --x0 1,0 --dt 0.1", "s.h5 --dt");
    refused("rollout s.h5 --against s.h5 --x0 1,0 --integrator rk4 --dt 0.1", "s.h5 --integrator");
    refused("rollout s.h5 --x0 1,0 --add-energy 1 --at 3", "s.h5 --add-energy");
    refused("rollout s.h5 --x0 1,0 --time 3 --points 40", "s.h5 whole steps");
    refused("rollout s.h5 --x0 1,0 --time 0.06", "--time 0.06 step");
    shell_works("$LA rollout s.h5 --x0 1,0 --time 0.07 --json");
    assert_true(shell_number("points") == 2);
    refused("train p.csv --model sympnet --state q,p --time t --rollout 2 --field both",
            "--field pixel-hnn");
    refused("train p.csv --model sympnet --state q,p --time t", "sympnet rollouts");
    refused("train p.csv --model sympnet --state q,p --time t --rollout 2 --stepping midpoint",
            "sympnet stepping");
    refused("train p.csv --model sympnet --state q,p --time t --rollout 2 --angles q",
            "sympnet angles");
    static const char *const other[] = {"simulate", "path", "modes", "check", "quantum --scene"};
    for (size_t k = 0; k < sizeof other / sizeof *other; k++) {
        char command[64];
        snprintf(command, sizeof command, "%s s.h5", other[k]);
        refused(command, "s.h5 sympnet");
    }
    refused("field s.h5", "sympnet field");
    refused("simulate s.h5 --scan q0=0:1:3", "s.h5 sympnet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(better_than_a_baseline, setup),
        cmocka_unit_test_setup(what_is_refused, setup),
    };
    return cmocka_run_group_tests_name("sympnet_command", tests, shell_setup, shell_teardown);
}
