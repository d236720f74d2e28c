/* Losses of a trainer during training. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/train/train_speed.h"

/* ---- G1: losses at the present parameters ---- */

struct watch {
    const struct hnn_samples *test;
    struct hnn_settings settings;
    double goal, least;
    size_t calls;
};

/* The rule of a user: stop once the test loss is under the goal. It is the loss of what would be
   the model: a second one with the parameters of a checkpoint has it. */
static bool under_goal(void *context, hnn_trainer *trainer)
{
    struct watch *w = context;
    w->least = hnn_trainer_test_loss(trainer);
    w->calls++;
    if (w->calls == 20) {
        struct path file = files_temporary("there.h5");
        struct ad_error error = {0};
        hnn_model *model;
        assert_int_equal(hnn_trainer_save(trainer, file.text, NULL, &error), AD_OK);
        assert_int_equal(hnn_model_load(file.text, &model, &error), AD_OK);
        assert_close(small_loss(model, w->test), w->least, 1e-9, 0);
        assert_close(hnn_trainer_test_loss(trainer), w->least, 1e-12, 0);
        hnn_model_free(model);
    }
    return !(w->least < w->goal);
}

static void test_losses_while_training(void **state)
{
    (void)state;
    for (int average = 0; average < 2; average++) {
        struct hnn_samples train = small_pendulum(1, 40, 0), test = small_pendulum(2, 30, 0);
        struct hnn_settings settings = small_settings(&small_kinds[1], 1, 3);
        hnn_model *model = small_model(&settings);
        double start = small_loss(model, &test);
        struct watch watch = {.test = &test, .settings = settings, .goal = start / 4};
        struct hnn_training training = hnn_training_defaults();
        training.learning_rate = 1e-2;
        training.average = average ? 0.1 : 0;
        training.progress = under_goal;
        training.context = &watch;
        struct ad_error error = {0};
        hnn_trainer *trainer = small_trainer(model, &training, &train, &test);
        assert_close(hnn_trainer_test_loss(trainer), start, 1e-9, 0);
        for (int k = 0; k < 20; k++)
            assert_int_equal(hnn_trainer_take_step(trainer, &error), AD_OK);
        assert_true(hnn_trainer_test_loss(trainer) < start);
        assert_close(small_loss(model, &test), start, 1e-12, 0); /* the model has not learnt */
        enum hnn_stop stop;
        assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_OK);
        assert_int_equal(stop, HNN_STOP_INTERRUPTED);
        assert_true(watch.calls > 20 && watch.least < start / 4);
        assert_close(small_loss(model, &test), watch.least, 1e-9, 0);
        assert_close(hnn_trainer_test_loss(trainer), watch.least, 1e-12, 0);
        hnn_trainer_free(trainer);
        small_samples_free(&train);
        small_samples_free(&test);
        hnn_model_free(model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_losses_while_training),
    };
    return cmocka_run_group_tests_name("losses", tests, files_setup, files_teardown);
}
