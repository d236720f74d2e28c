/* leastaction train from outside: output, killed and resumed runs, bad input. */
#include "shell.h"
#include "tests/close.h"
#include "hnn/pixels/pixels.h"
#include "physics/io/hdf5_file.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A frictionless pendulum of H = p^2/2 - cos q on an irregular set of states. */
static void write_data(void)
{
    FILE *out = fopen(shell_path("pendulum.csv"), "w");
    assert_non_null(out);
    fputs("q,p,dqdt,dpdt\n", out);
    for (int k = 0; k < 60; k++) {
        double q = 1.5 * sin(2.3 * k + 0.1), p = 1.4 * cos(1.7 * k);
        fprintf(out, "%.12g,%.12g,%.12g,%.12g\n", q, p, p, -sin(q));
    }
    fclose(out);
}

/* Four short videos of the pendulum, 6 x 5 pixels. */
static void write_frames(void)
{
    struct hnn_video_settings settings = hnn_video_published();
    settings.trajectories = 4;
    settings.frames = 12;
    settings.height = 6;
    settings.width = 5;
    struct hnn_frames frames;
    struct ad_error error = {0};
    assert_int_equal(hnn_rod_video(&settings, 3, &frames, &error), AD_OK);
    assert_int_equal(hnn_frames_save(&frames, shell_path("frames.h5"), &error), AD_OK);
    hnn_frames_free(&frames);
}

static int setup(void **state)
{
    (void)state;
    shell_clean();
    write_data();
    return 0;
}

#define SMALL "--hidden 16 --lr 1e-2 --test-fraction 0.2 --split random --batch 20 "

static void test_json_and_files(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 200 --json --log log.csv"), 0);
    assert_true(shell_number("train_loss") < 0.02 && shell_number("test_loss") < 0.05);
    assert_true(shell_number("steps") == 200 && shell_number("seconds") > 0 &&
                shell_number("ms_per_step") > 0);
    assert_true(shell_number("parameters") == 2 * 16 + 16 + 16 * 16 + 16 + 16);
    assert_true(shell_number("train_samples") == 48 && shell_number("test_samples") == 12);
    assert_int_equal(shell_files(), 3); /* data, model.h5, log.csv */
    assert_int_equal(shell("head -n 1 log.csv; wc -l <log.csv"), 0);
    assert_string_equal(shell_out(), "step,train_loss,test_loss,seconds,learning_rate\n21\n");
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 40 --schedule cosine --lr 0.2 "
                           "--quiet --out c.h5 --log c.csv; sed -n '3s/.*,//p' c.csv"),
                     0);
    assert_close(atof(shell_out()), 0.1 * (1 + cos(3.14159265358979 * 19 / 40)), 1e-8, 0);
    assert_int_equal(shell("$LA dump model.h5"), 0);
    assert_non_null(strstr(shell_out(), "linear1.weight"));
    assert_non_null(strstr(shell_out(), "q,p"));
}

/* Every number in the file but the command that wrote it. */
static const char *dump(const char *file)
{
    assert_int_equal(shell("$LA dump %s | grep -v 'leastaction train'", file), 0);
    return shell_out();
}

static void test_resume(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 200 --quiet --out a.h5"), 0);
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 100 --quiet --out b.h5"), 0);
    assert_int_equal(shell("cmp a.h5 b.h5 >/dev/null"), 1);
    assert_int_equal(
        shell("$LA train pendulum.csv " SMALL "--steps 200 --quiet --out b.h5 --resume"), 0);
    assert_int_equal(shell("for f in a b; do $LA dump $f.h5 --dataset training/optimiser >$f.txt; "
                           "$LA dump $f.h5 --dataset linear2.weight >>$f.txt; done; "
                           "test -s a.txt && cmp a.txt b.txt"),
                     0);
    char *whole = strdup(dump("a.h5"));
    const char *joined = dump("b.h5");
    for (char *c = whole; (c = strstr(c, "a.h5"));)
        *c = 'b';
    assert_string_equal(whole, joined);
    free(whole);
}

/* Killed without a chance to tidy up, once a checkpoint is there; the rest by --resume. */
static void test_killed(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 20000 --quiet --out a.h5"), 0);
    assert_int_equal(shell("$LA train pendulum.csv " SMALL
                           "--steps 20000 --quiet --out b.h5 --checkpoint 0.02 & "
                           "until test -e b.h5; do :; done; kill -9 $!; wait $!; true"),
                     0);
    assert_int_equal(shell("$LA dump b.h5 | grep -w step"), 0);
    assert_int_equal(
        shell("$LA train pendulum.csv " SMALL "--steps 20000 --json --out b.h5 --resume"), 0);
    assert_true(shell_number("steps") == 20000);
    assert_int_equal(shell("for f in a b; do $LA dump $f.h5 --dataset training/optimiser >$f.txt; "
                           "$LA dump $f.h5 --dataset linear2.weight >>$f.txt; done; "
                           "test -s a.txt && cmp a.txt b.txt"),
                     0);
}

#define PIXELS "--hidden 8 --lr 3e-3 --test-fraction 0.25 --batch 10 --every 10 "

static void test_pixels(void **state)
{
    (void)state;
    write_frames();
    assert_int_equal(shell("$LA train frames.h5 --model pixel-baseline " PIXELS
                           "--steps 1 --json --out other.h5"),
                     0);
    double before = shell_number("train_loss");
    double encoder = 488 + 2 * 72 + 18, decoder = 24 + 2 * 72 + 540, field = 24 + 72 + 16;
    assert_true(shell_number("parameters") == encoder + decoder + field);
    assert_true(shell_number("train_samples") == 30 && shell_number("test_samples") == 10);
    for (int k = 0; k < 2; k++)
        assert_int_equal(shell("$LA train frames.h5 --model pixel-hnn " PIXELS
                               "--steps 300 --json --out a%d.h5",
                               k),
                         0);
    assert_true(shell_number("train_loss") < 0.5 * before && shell_number("test_loss") < before);
    assert_int_equal(shell("$LA train frames.h5 --model pixel-hnn " PIXELS
                           "--steps 100 --quiet --out a1.h5 && "
                           "$LA train frames.h5 --model pixel-hnn " PIXELS
                           "--steps 300 --quiet --out a1.h5 --resume && "
                           "for k in 0 1; do $LA dump a$k.h5 --dataset training/optimiser >$k.txt; "
                           "done; test -s 0.txt && cmp 0.txt 1.txt"),
                     0);
    assert_int_equal(shell("$LA dump a0.h5"), 0);
    assert_non_null(strstr(shell_out(), "autoencoder.linear8.bias"));
    assert_non_null(strstr(shell_out(), "hnn.linear3.weight"));
    assert_non_null(strstr(shell_out(), "6 x 5"));
}

static void test_interrupted(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA train pendulum.csv " SMALL
                           "--steps 10000000 --quiet --log log.csv --checkpoint 0.02 & pid=$!; "
                           "until test -e model.h5; do :; done; kill -INT $pid; wait $pid"),
                     1);
    assert_mentions(shell_err(), "interrupted step");
    assert_int_equal(shell("$LA dump model.h5 >/dev/null && test -s log.csv"), 0);
}

/* Log and picture are there, whole, before the training ends. A gnuplot that takes longer than a
   run may after a signal ends no run: a checkpoint is finished, and what follows is written. */
static void test_live_curves(void **state)
{
    (void)state;
    if (shell("command -v gnuplot") != 0)
        skip();
    shell_works("mkdir bin early && cat >bin/gnuplot <<END && chmod +x bin/gnuplot\n"
                "#!/bin/sh\n"
                "if test -e loss.svg && ! test -e early/loss.svg; then\n"
                "cp loss.svg log.csv early; kill -INT \\$PPID; mkfifo never; "
                "timeout 0.9 cat never\nfi\n"
                "exec $(command -v gnuplot) \"\\$@\"\nEND\ntrue");
    assert_int_equal(shell("PATH=$PWD/bin:$PATH $LA train pendulum.csv " SMALL
                           "--steps 10000000 --quiet --log log.csv --plot loss.svg "
                           "--checkpoint 0.02"),
                     1);
    assert_mentions(shell_err(), "interrupted step");
    shell_works("grep -q '</svg>' early/loss.svg && test $(wc -l <early/log.csv) -gt 1 && "
                "test $(wc -l <early/log.csv) -le $(wc -l <log.csv) && "
                "head -n $(wc -l <early/log.csv) log.csv | cmp - early/log.csv");
}

static void refused(const char *options, const char *why)
{
    assert_int_equal(shell("$LA train %s", options), 2);
    assert_mentions(shell_err(), why);
    assert_int_equal(shell("test -e model.h5"), 1);
}

static void test_refusals(void **state)
{
    (void)state;
    refused("absent.csv", "absent.csv");
    refused("pendulum.csv --model hmm", "--model baseline hnn");
    refused("pendulum.csv --activation tanj", "'tanh'");
    refused("pendulum.csv --optimiser adm", "'adam'");
    refused("pendulum.csv --precision f16", "f32 f64");
    refused("pendulum.csv --hidden 20,x", "--hidden 20,x");
    refused("pendulum.csv --hidden 20,30,40", "expected 2 numbers");
    refused("pendulum.csv --stepping leapfrog", "--stepping --rollout");
    refused("pendulum.csv --batch some", "expected 'full'");
    refused("pendulum.csv --batch 61", "60 samples");
    refused("pendulum.csv --state q,r", "r");
    refused("pendulum.csv --patience 5", "test samples");
    refused("pendulum.csv --out /nonexistent/model.h5", "/nonexistent/model.h5");
    refused("frames.h5 --model pixel-hnn --state q,p", "--state");
    refused("pendulum.csv --model pixel-hnn", "pendulum.csv");
    refused("pendulum.csv --log /nonexistent/log.csv", "/nonexistent/log.csv");
    refused("pendulum.csv --plot loss.html", "--plot loss.html");
    refused("pendulum.csv --plot /nonexistent/loss.svg", "/nonexistent/loss.svg");
    refused("pendulum.csv --skip-rows 1000000000000", "61 1000000000000");
    /* options that the training would not look at */
    refused("pendulum.csv --model baseline --field both", "--field hnn");
    refused("pendulum.csv --split random", "--split --test-fraction");
    refused("pendulum.csv --dt 1", "--dt --rollout");
    refused("pendulum.csv --rollout 2 --dt -1", "--dt -1");
    refused("pendulum.csv --differences central", "--differences");
    refused("pendulum.csv --momentum 0.5", "--momentum sgd");
    refused("pendulum.csv --optimiser lbfgs --lr 0.1", "--lr lbfgs");
    refused("frames.h5 --model pixel-hnn --split trial", "--split pixel-hnn");
}

/* A26: a training that has learnt nothing says so: its loss is that of a field of 0, which for
   rates is their mean square, in units of itself with --normalise. */
static void test_nothing_learnt(void **state)
{
    (void)state;
    double sum = 0;
    for (int k = 0; k < 60; k++)
        sum += pow(1.4 * cos(1.7 * k), 2) + pow(sin(1.5 * sin(2.3 * k + 0.1)), 2);
    static const struct {
        const char *options;
        bool learns;
    } cases[] = {{"--lr 1e3", false},
                 {"--lr 1e3 --rollout 2 --dt 0.1", false},
                 {"--lr 1e3 --rollout 2 --dt 0.1 --normalise", false},
                 {"--lr 1e-2 --normalise", true}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        shell_works("$LA train pendulum.csv --hidden 8 --seed 2 --steps 100 --json %s",
                    cases[k].options);
        double loss = shell_number("train_loss"), zero = shell_number("zero_loss");
        if (cases[k].learns)
            assert_true(loss < 0.5 * zero);
        else
            assert_close(loss, zero, 5e-3, 0);
        if (k == 0)
            assert_close(zero, sum / 120, 1e-9, 0);
        if (k == 3)
            assert_close(zero, 1, 1e-12, 0);
        shell_works("$LA train pendulum.csv --hidden 8 --seed 2 --steps 100 %s", cases[k].options);
        assert_int_equal(!strstr(shell_out(), "--normalise"), cases[k].learns);
    }
}

/* Of a Lagrangian model dq/dt = v needs no learning: the loss to beat is that of no acceleration.
 */
static void test_no_acceleration_learnt(void **state)
{
    (void)state;
    shell_works("awk 'BEGIN { print \"q,v,dqdt,dvdt\"; for (k = 1; k < 60; k++) { q = 1e6 * "
                "sin(k); v = 1e6 * cos(3 * k); print q \",\" v \",\" v \",\" (-q) } }' >large.csv");
    shell_works("$LA train large.csv --model lnn --hidden 8 --steps 20");
    assert_non_null(strstr(shell_out(), "--normalise"));
}

static void test_resume_refusals(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 20 --quiet"), 0);
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 30 --resume --hidden 17"), 2);
    assert_mentions(shell_err(), "model.h5 settings");
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--steps 30 --resume --lr 0.5"), 2);
    assert_mentions(shell_err(), "model.h5 learning_rate=0.01 learning_rate=0.5");
    assert_int_equal(
        shell("head -n 50 pendulum.csv >less.csv; $LA train less.csv " SMALL "--steps 30 --resume"),
        2);
    assert_mentions(shell_err(), "model.h5 data");
    assert_int_equal(shell("head -c 3000 model.h5 >cut.h5; $LA train pendulum.csv " SMALL
                           "--steps 30 --resume --out cut.h5"),
                     2);
    assert_mentions(shell_err(), "cut.h5 damaged");
    assert_int_equal(shell("$LA train pendulum.csv " SMALL "--resume --out less.csv"), 2);
    assert_mentions(shell_err(), "less.csv HDF5");
}

/* --from: the weights and normalisation of the other model; its states in their order. */
static void test_from(void **state)
{
    (void)state;
    shell_works("$LA train pendulum.csv " SMALL "--steps 300 --normalise --json --out a.h5");
    double loss = shell_number("train_loss");
    shell_works("$LA train pendulum.csv --test-fraction 0.2 --split random --steps 1 --lr 1e-12 "
                "--from a.h5 --json --out b.h5");
    assert_close(shell_number("train_loss"), loss, 1e-5, 0);
    shell_works("$LA train pendulum.csv --test-fraction 0.2 --split random --steps 200 --lr 1e-3 "
                "--clip 1 --schedule onecycle --from a.h5 --json --out b.h5");
    assert_true(shell_number("train_loss") < 0.9 * loss);
    assert_mentions(shell_last_line(), "\"model\": \"hnn\"");
    static const char *const wrong[][2] = {
        {"--from a.h5 --hidden 16", "--hidden --from"},
        {"--from a.h5 --normalise", "--normalise --from"},
        {"--from a.h5 --model lnn", "--model --from"},
        {"--from a.h5 --state p,q --rate dpdt,dqdt", "--from a.h5 q,p p,q"},
        {"--from pendulum.csv", "pendulum.csv"},
        {"--from none.h5", "none.h5"},
        {"--clip 1 --optimiser lbfgs", "--clip lbfgs"},
        {"--clip 0", "--clip"}};
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        assert_int_equal(shell("$LA train pendulum.csv --steps 1 --out c.h5 %s", wrong[k][0]), 2);
        assert_mentions(shell_err(), wrong[k][1]);
    }
    assert_int_equal(shell("$LA train pendulum.csv --steps 1 --from a.h5 --out a.h5"), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_json_and_files, setup),
        cmocka_unit_test_setup(test_from, setup),
        cmocka_unit_test_setup(test_resume, setup),
        cmocka_unit_test_setup(test_killed, setup),
        cmocka_unit_test_setup(test_pixels, setup),
        cmocka_unit_test_setup(test_interrupted, setup),
        cmocka_unit_test_setup(test_live_curves, setup),
        cmocka_unit_test_setup(test_nothing_learnt, setup),
        cmocka_unit_test_setup(test_no_acceleration_learnt, setup),
        cmocka_unit_test_setup(test_refusals, setup),
        cmocka_unit_test_setup(test_resume_refusals, setup),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
