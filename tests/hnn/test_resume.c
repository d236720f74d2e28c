/* End and resumption of training: resumed runs continue to the last bit; patience, losses that are
   not finite, refusals. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/train/train.h"

#include <stdlib.h>
#include <string.h>

struct half {
    size_t at; /* step after which the run is cut */
    struct path file;
};

static bool cut(void *context, hnn_trainer *trainer)
{
    const struct half *half = context;
    struct ad_error error = {0};
    if (hnn_trainer_step(trainer) < half->at)
        return true;
    assert_int_equal(hnn_trainer_save(trainer, half->file.text, "cut", &error), AD_OK);
    return false;
}

/* 100 steps, a file, and 100 more from that file by new handles, against 200 at once: parameters,
   history, and the files that either writes. */
static void check_resume(struct hnn_settings settings, struct hnn_training training)
{
    struct hnn_samples train = small_pendulum(1, 40, 0.1), test = small_pendulum(2, 30, 0.1);
    struct half half = {.at = 103, .file = files_temporary("half.h5")};
    struct path whole = files_temporary("whole.h5"), joined = files_temporary("joined.h5");
    struct ad_error error = {0};
    training.steps = 200;
    hnn_model *a = small_model(&settings), *b = small_model(&settings), *c = small_model(&settings);
    hnn_trainer *at_once = small_trainer(a, &training, &train, &test);
    small_run(at_once);
    struct hnn_training first = training;
    first.progress = cut;
    first.context = &half;
    hnn_trainer *before = small_trainer(b, &first, &train, &test);
    assert_int_equal(small_run(before), HNN_STOP_INTERRUPTED);
    hnn_trainer *after = small_trainer(c, &training, &train, &test);
    if (hnn_trainer_resume(after, half.file.text, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(hnn_trainer_step(after), 103);
    small_run(after);
    assert_int_equal(hnn_trainer_step(after), hnn_trainer_step(at_once));
    assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(c),
                        hnn_model_size(a) * hnn_type_bytes(settings.precision));
    assert_memory_not_equal(hnn_model_parameters(a), hnn_model_parameters(b),
                            hnn_model_size(a) * hnn_type_bytes(settings.precision));
    assert_int_equal(hnn_trainer_save(at_once, whole.text, "x", &error), AD_OK);
    assert_int_equal(hnn_trainer_save(after, joined.text, "x", &error), AD_OK);
    files_are_same(whole.text, joined.text);
    hnn_trainer_free(at_once);
    hnn_trainer_free(before);
    hnn_trainer_free(after);
    hnn_model_free(a);
    hnn_model_free(b);
    hnn_model_free(c);
    small_samples_free(&train);
    small_samples_free(&test);
}

static void test_resume(void **state)
{
    (void)state;
    for (int type = AD_F32; type <= AD_F64; type++)
        for (size_t m = 0; hnn_optimisers[m]; m++)
            for (int batches = 0; batches < 2; batches++) {
                struct hnn_settings s = small_settings(&small_kinds[5], 1, 3);
                struct hnn_training training = hnn_training_defaults();
                if (batches && hnn_optimisers[m]->full_batch)
                    continue;
                s.precision = (enum ad_type)type;
                training.optimiser = hnn_optimisers[m];
                training.schedule = hnn_schedules[batches];
                training.batch = batches ? 13 : 0;
                training.momentum = 0.8;
                training.seed = 17;
                check_resume(s, training);
            }
}

/* With patience a file holds the best parameters beside the present ones, with or without their
   mean. */
static void test_resume_with_patience(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    struct hnn_training training = hnn_training_defaults();
    training.batch = 5;
    training.learning_rate = 0.05; /* the test loss goes up and down */
    training.patience = 190;
    training.every = 7;
    check_resume(s, training);
    training.average = 0;
    check_resume(s, training);
}

/* A sound file whose history cannot be one. */
static void test_damaged_history(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 10, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    struct hnn_training training = hnn_training_defaults();
    struct path file = files_temporary("damaged.h5");
    struct ad_error error = {0};
    training.steps = 20;
    hnn_model *model = small_model(&s);
    hnn_trainer *trainer = small_trainer(model, &training, &train, &small_none);
    small_run(trainer);
    trainer->history[1].step = SIZE_MAX; /* no count that a double holds */
    assert_int_equal(hnn_trainer_save(trainer, file.text, "x", &error), AD_OK);
    assert_int_equal(hnn_trainer_resume(trainer, file.text, &error), AD_E_INPUT);
    assert_mentions(error.message, "'training/history' step 1.84467e+19 row 1");
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
}

/* A setting that one of them has as the last word is the one that is named. */
static void test_other_settings(void **state)
{
    (void)state;
    static const struct {
        double clip[2], rate[2]; /* saved, resumed */
        const char *says;
    } wrong[] = {
        {{0, 2}, {1e-3, 1e-3}, "nothing there, clip=2 now"},
        {{2, 0}, {1e-3, 1e-3}, "clip=2 there, nothing now"},
        {{2, 0}, {0.5, 0.25}, "learning_rate=0.5 there, learning_rate=0.25 now"},
        {{2, 3}, {0.5, 0.5}, "clip=2 there, clip=3 now"},
    };
    struct hnn_samples train = small_pendulum(1, 10, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    struct path file = files_temporary("other.h5");
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++)
        for (int now = 0; now < 2; now++) {
            struct hnn_training training = hnn_training_defaults();
            struct ad_error error = {0};
            training.steps = 1;
            training.clip = wrong[k].clip[now];
            training.learning_rate = wrong[k].rate[now];
            hnn_model *model = small_model(&s);
            hnn_trainer *trainer = small_trainer(model, &training, &train, &small_none);
            if (now) {
                assert_int_equal(hnn_trainer_resume(trainer, file.text, &error), AD_E_INPUT);
                assert_non_null(strstr(error.message, wrong[k].says));
            } else {
                assert_int_equal(hnn_trainer_save(trainer, file.text, "x", &error), AD_OK);
            }
            hnn_trainer_free(trainer);
            hnn_model_free(model);
        }
    small_samples_free(&train);
}

static void test_patience(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 6, 0), test = small_pendulum(2, 50, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    s.hidden[0] = s.hidden[1] = 40; /* too many for six samples: the test loss rises again */
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.steps = 20000;
    training.learning_rate = 0.01;
    training.weight_decay = 0;
    training.patience = 300;
    hnn_trainer *trainer = small_trainer(model, &training, &train, &test);
    assert_int_equal(small_run(trainer), HNN_STOP_PATIENCE);
    size_t rows, best = 0;
    const struct hnn_row *history = hnn_trainer_history(trainer, &rows);
    for (size_t k = 0; k < rows; k++)
        if (history[k].test_loss < history[best].test_loss)
            best = k;
    assert_int_equal(history[rows - 1].step, history[best].step + 300);
    assert_close(small_loss(model, &test), history[best].test_loss, 1e-12, 0);
    assert_true(history[rows - 1].test_loss > history[best].test_loss);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
    small_samples_free(&test);
}

static void test_not_finite(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 40, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    s.activation = "relu";
    hnn_model *model = small_model(&s), *start = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.optimiser = hnn_optimisers[2];
    training.learning_rate = 1e9;
    hnn_trainer *trainer = small_trainer(model, &training, &train, &small_none);
    struct ad_error error = {0};
    enum hnn_stop stop;
    assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_E_NONFINITE);
    assert_mentions(error.message, "step");
    assert_memory_equal(hnn_model_parameters(model), hnn_model_parameters(start),
                        hnn_model_size(model) * sizeof(double));
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    hnn_model_free(start);
    small_samples_free(&train);
}

static void refused(struct hnn_training training, const char *why)
{
    struct hnn_samples train = small_pendulum(1, 10, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    hnn_model *model = small_model(&s);
    struct ad_error error = {0};
    hnn_trainer *trainer;
    assert_int_equal(hnn_trainer_new(model, &training, &train, &small_none, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_null(trainer);
    assert_mentions(error.message, why);
    hnn_model_free(model);
    small_samples_free(&train);
}

static void test_refusals(void **state)
{
    (void)state;
    struct hnn_training good = hnn_training_defaults(), t;
    refused((t = good, t.batch = 11, t), "got 11");
    refused((t = good, t.learning_rate = 0, t), "learning rate");
    refused((t = good, t.learning_rate = NAN, t), "learning rate");
    refused((t = good, t.weight_decay = -1, t), "weight decay");
    refused((t = good, t.momentum = 1, t), "momentum");
    refused((t = good, t.average = 1.1, t), "average");
    refused((t = good, t.rollout = 2, t), "rollouts time");
    refused((t = good, t.patience = 2, t), "test samples");
    refused((t = good, t.optimiser = hnn_optimisers[3], t.batch = 5, t), "all samples");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_resume),          cmocka_unit_test(test_resume_with_patience),
        cmocka_unit_test(test_other_settings),  cmocka_unit_test(test_patience),
        cmocka_unit_test(test_not_finite),      cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_damaged_history),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
