/* --sweep and --seeds: members are what separate runs are, to the bit; what fails is told; their
   rollouts together are those of each; misuse is refused. */
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"
#include "hnn/hnn.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SMALL "train p.csv --hidden 8 --steps 5 --test-fraction 0.2 --quiet "

static int setup(void **state)
{
    shell_empty(state);
    shell_works("$LA dataset pendulum --trials 4 --quiet --out p.csv");
    return 0;
}

static void assert_same_model(const char *a, const char *b)
{
    struct ad_error error = {0};
    hnn_model *one, *other;
    assert_int_equal(hnn_model_load(shell_path(a), &one, &error), AD_OK);
    assert_int_equal(hnn_model_load(shell_path(b), &other, &error), AD_OK);
    assert_int_equal(hnn_model_size(one), hnn_model_size(other));
    assert_memory_equal(hnn_model_parameters(one), hnn_model_parameters(other),
                        hnn_model_size(one) * sizeof(float));
    hnn_model_free(one);
    hnn_model_free(other);
}

static void members_are_separate_runs(void **state)
{
    double seed, loss, rate;
    int status;
    (void)state;
    shell_works("$LA " SMALL "--sweep lr=1e-2,0.05 --seeds 3:5 --log l.csv --csv - --plot m.svg");
    assert_mentions(shell_out(), "lr,seed,status,");
    shell_works("$LA " SMALL "--lr 0.05 --seed 4 --out one.h5 --log one.csv --json");
    loss = shell_number("test_loss");
    assert_same_model("one.h5", "model-lr=0.05-seed=4.h5");
    shell_works("cut -d , -f 1-3 one.csv >a; cut -d , -f 1-3 l-lr=0.05-seed=4.csv >b; cmp a b");
    shell_works("$LA " SMALL "--seeds 3:5 --sweep lr=1e-2,0.05 --csv m.csv; "
                "sed -n '1s/,test_loss.*//p' m.csv | tr -cd , | wc -c");
    char command[80];
    snprintf(command, sizeof command, "sed -n 6p m.csv | cut -d , -f 1-3,%d",
             atoi(shell_out()) + 2);
    shell_works("%s", command);
    double in_table;
    assert_int_equal(sscanf(shell_out(), "%lf,%lf,%d,%lf", &rate, &seed, &status, &in_table), 4);
    assert_true(rate == 0.05 && seed == 4 && status == 0 && in_table == loss);
    shell_works("$LA dump model.h5");
    assert_mentions(shell_out(), "/results/test_loss");
    assert_mentions(shell_out(), "members = model-lr=1e-2-seed=3.h5");
}

static void words_and_ranges_are_values(void **state)
{
    (void)state;
    shell_works("mkdir none && PATH=$PWD/none $LA train p.csv --steps 2 --quiet "
                "--sweep activation=tanh,gelu --sweep hidden=4:12:3 --csv w.csv --plot w.svg; "
                "sed -n 7p w.csv");
    assert_mentions(shell_out(), "\"gelu\",12,0,");
    shell_works(
        "ls model-activation=gelu-hidden=12.h5 && grep -c 'set xtics (\"tanh\" 0' w.svg.gp");
    shell_works("$LA simulate kepler --sweep integrator=rk4,verlet --time 1 --dt 0.01 --json");
    assert_mentions(shell_last_line(), "{\"integrator\": \"verlet\", \"status\": 0, ");
}

static void what_fails_is_told(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA " SMALL "--sweep lr=1e-2,1e38,2e-2 --csv f.csv --json"), 1);
    assert_mentions(shell_err(), "1 of 3 lr = 1e38");
    shell_works("grep '^9.9*[0-9]*e+37,1,,\\|^1e+38,1,,' f.csv && ls model-lr=2e-2.h5 && "
                "! ls model-lr=1e38.h5 2>/dev/null");
    assert_int_equal(shell("$LA rollout model.h5 --x0 1,0 --time 1 --json"), 1);
    assert_mentions(shell_err(), "1 of 3 models");
    assert_true(shell_number("members") == 2 && shell_number("missed") == 1);
    assert_int_equal(shell("$LA " SMALL
                           "--steps 1000000000 --checkpoint 0.02 --seeds 1:3 & pid=$!; "
                           "until test -e model-seed=1.h5; do :; done; kill -INT $pid; wait $pid"),
                     1);
    assert_mentions(shell_err(), "run 1 of 3 --resume");
}

static void spread_is_that_of_the_members(void **state)
{
    double q[3], sum = 0, squares = 0, mean, deviation, least, most, mse = 0;
    (void)state;
    shell_works("mkdir there && $LA " SMALL "--lr 1e-2 --seeds 1:3 --out there/m.h5");
    for (int k = 0; k < 3; k++) {
        shell_works(
            "$LA rollout there/m-seed=%d.h5 --truth pendulum --time 3 --points 4 --csv r%d.csv "
            "--json",
            k + 1, k);
        mse += shell_number("energy_mse") / 3;
        shell_works("tail -n 1 r%d.csv", k);
        assert_int_equal(sscanf(shell_out(), "3,%lf", &q[k]), 1);
        sum += q[k];
    }
    for (int k = 0; k < 3; k++)
        squares += (q[k] - sum / 3) * (q[k] - sum / 3);
    shell_works("$LA rollout there/m.h5 --truth pendulum --time 3 --points 4 --csv r.csv --json "
                "--out r.h5 --plot r.svg");
    assert_true(shell_number("members") == 3);
    const char *row = strstr(shell_last_line(), "{\"number\": \"energy_mse\", \"models\": 3, ");
    assert_non_null(row);
    assert_int_equal(sscanf(strstr(row, "\"mean\": "), "\"mean\": %lf", &mean), 1);
    assert_close(mean, mse, 1e-13, 0);
    shell_works("tail -n 1 r.csv");
    assert_int_equal(sscanf(shell_out(), "3,%lf,%lf,%lf,%lf", &mean, &deviation, &least, &most), 4);
    assert_close(mean, sum / 3, 1e-14, 0);
    assert_close(deviation, sqrt(squares / 2), 1e-12, 0);
    assert_true(least == fmin(q[0], fmin(q[1], q[2])) && most == fmax(q[0], fmax(q[1], q[2])));
    /* its models are inputs */
    shell_works("cp there/m-seed=2.h5 kept.h5");
    assert_int_equal(
        shell("$LA rollout there/m.h5 --x0 1,0 --time 1 --quiet --out there/m-seed=2.h5"), 2);
    assert_mentions(shell_err(), "m-seed=2.h5");
    assert_int_equal(
        shell("$LA rollout there/m.h5 --x0 1,0 --time 1 --quiet --csv there/m-seed=1.h5"), 2);
    shell_works("cmp there/m-seed=2.h5 kept.h5 && cp there/m-seed=1.h5 there/m-seed=2.h5");
    assert_int_equal(shell("$LA rollout there/m.h5 --x0 1,0 --time 1 --quiet"), 2);
    assert_mentions(shell_err(), "there/m-seed=2.h5");
    shell_works("cp kept.h5 there/m-seed=2.h5 && $LA rollout there/m.h5 --x0 1,0 --time 1");
}

/* A result of the name of what is swept has another; what cannot be shown loses no table. */
static void tables_are_whole(void **state)
{
    double asked, reached;
    (void)state;
    shell_works("$LA simulate pendulum --time 2 --sweep tol=1e-4,1e-6 --json --csv tol.csv");
    const char *row = strstr(shell_last_line(), "\"scan\": [{\"tol\": ");
    assert_non_null(row);
    assert_int_equal(sscanf(row, "\"scan\": [{\"tol\": %lf", &asked), 1);
    assert_int_equal(sscanf(strstr(row, "result.tol"), "result.tol\": %lf", &reached), 1);
    assert_true(asked == 1e-4 && reached != asked);
    shell_works("head -n 1 tol.csv | tr , '\\n' | sort | uniq -d | wc -l");
    assert_int_equal(atoi(shell_out()), 0);
    assert_int_equal(shell("$LA simulate pendulum --time 1 --scan theta0=1:2:3 --curves dt,energy "
                           "--csv kept.csv --out kept.h5 --plot lost.svg --quiet"),
                     2);
    assert_mentions(shell_err(), "--curves 'dt'");
    shell_works("wc -l <kept.csv && $LA dump kept.h5 >/dev/null && ! ls lost.svg 2>/dev/null");
    assert_int_equal(atoi(shell_out()), 4);
}

static void misuse_is_refused(void **state)
{
    static const char *const wrong[][2] = {
        {"--sweep lr=1e-2", "--sweep: expected NAME=FROM:TO:N"},
        {"--sweep lr=1e-2,", "--sweep: expected NAME=FROM:TO:N"},
        {"--sweep lr=,1", "--sweep: expected NAME=FROM:TO:N"},
        {"--sweep lr", "--sweep: expected NAME=FROM:TO:N"},
        {"--sweep lrr=1,2", "lr"},
        {"--sweep log=a,b", "log"},
        {"--sweep lr=1,1", "--sweep: lr = 1 twice"},
        {"--sweep lr=1,2 --lr 3", "--sweep does not go with --lr"},
        {"--sweep lr=1,2 --sweep lr=3,4", "--sweep: lr twice"},
        {"--sweep seed=1,2 --seeds 0:3", "--seeds: seed twice"},
        {"--seeds 0:3 --seed 4", "--seeds does not go with --seed"},
        {"--seeds 3", "--seeds: expected FROM:TO"},
        {"--seeds 3:3", "--seeds: expected FROM:TO"},
        {"--seeds -1:3", "--seeds: expected FROM:TO"},
        {"--sweep lr=1,2 --sweep hidden=1,2 --seeds 0:3", "--seeds: at most 2"},
        {"--sweep unit=m/s,m", "m/s cannot be part of a file name"},
        {"--sweep lr=1,x", "--lr: expected a number such as 0.5, got 'x'"},
        {"--sweep hidden=4,x --steps 1", "--hidden x"},
        {"--sweep steps=1:4:3", "--steps: expected a whole number"},
        {"--seeds 0:3 --from model-seed=2.h5", "model-seed=2.h5"},
        {"--seeds 0:3 --csv model-seed=2.h5", "model-seed=2.h5"},
    };
    (void)state;
    shell_works("$LA train p.csv --hidden 4 --steps 1 --quiet --out model-seed=2.h5; cp "
                "model-seed=2.h5 kept.h5");
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const int status = shell("$LA train p.csv --quiet %s", wrong[k][0]);
        if (status != (strstr(wrong[k][0], "hidden=4,x") ? 1 : 2))
            fail_msg("%s: status %d, %s", wrong[k][0], status, shell_err());
        assert_mentions(shell_err(), wrong[k][1]);
    }
    shell_works("cmp model-seed=2.h5 kept.h5");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(members_are_separate_runs, setup),
        cmocka_unit_test_setup(words_and_ranges_are_values, setup),
        cmocka_unit_test_setup(what_fails_is_told, setup),
        cmocka_unit_test_setup(spread_is_that_of_the_members, setup),
        cmocka_unit_test_setup(tables_are_whole, setup),
        cmocka_unit_test_setup(misuse_is_refused, setup),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
