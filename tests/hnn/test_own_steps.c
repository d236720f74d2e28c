/* A training loop of the caller: steps in pieces, rates and parameters set between them. */
#include "small.h"
#include "tests/close.h"
#include "tests/mentions.h"
#include "tests/files.h"

#include <stdlib.h>
#include <string.h>

static struct hnn_settings seven(void) { return small_settings(&small_kinds[1], 1, 3); }

/* G1. In pieces as at once, to the last bit; after each piece the losses are those of the model. */
static void test_advance(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 60, 0.1), test = small_pendulum(2, 40, 0.1);
    const char *methods[] = {"adam", "adamw", "sgd", "lbfgs", "adam"};
    struct hnn_settings settings = seven();
    for (size_t k = 0; k < 5; k++) {
        struct ad_error error = {0};
        struct hnn_training training = hnn_training_defaults();
        training.optimiser = hnn_optimiser_find(methods[k], &error);
        training.schedule = hnn_schedule_find("cosine", &error);
        training.steps = 100;
        training.batch = k == 3 ? 0 : 16;
        training.average = k == 4 ? 0 : 0.3;
        training.patience = k == 4 ? 20 : 0;
        training.learning_rate = k == 4 ? 0.3 : 1e-2; /* patience ends it */
        hnn_model *a = small_model(&settings), *b = small_model(&settings);
        hnn_trainer *whole = small_trainer(a, &training, &train, &test);
        hnn_trainer *parts = small_trainer(b, &training, &train, &test);
        enum hnn_stop why = small_run(whole), stop = 0;
        for (size_t n = 1; !stop; n += 2) {
            size_t before = hnn_trainer_step(parts);
            assert_int_equal(hnn_trainer_advance(parts, n, &stop, &error), AD_OK);
            assert_true(stop || hnn_trainer_step(parts) == before + n);
            assert_close(hnn_trainer_test_loss(parts), small_loss(b, &test), 1e-11, 0);
            assert_close(hnn_trainer_train_loss(parts), small_loss(b, &train), 1e-11, 0);
        }
        assert_int_equal(stop, why);
        assert_int_equal(hnn_trainer_step(parts), hnn_trainer_step(whole));
        assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(b),
                            hnn_model_size(a) * sizeof(double));
        size_t rows, others;
        const struct hnn_row *one = hnn_trainer_history(whole, &rows),
                             *two = hnn_trainer_history(parts, &others);
        assert_int_equal(rows, others);
        for (size_t r = 0; r < rows; r++)
            assert_true(one[r].step == two[r].step && one[r].train_loss == two[r].train_loss &&
                        one[r].test_loss == two[r].test_loss);
        hnn_trainer_free(whole);
        hnn_trainer_free(parts);
        hnn_model_free(a);
        hnn_model_free(b);
    }
    small_samples_free(&train);
    small_samples_free(&test);
}

static bool again(void *context, hnn_trainer *trainer)
{
    struct ad_error error = {0};
    *(enum ad_status *)context = hnn_trainer_advance(trainer, 1, NULL, &error);
    return false;
}

/* Rates, and parameters from outside, between the steps. */
static void test_between_steps(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 60, 0.1);
    struct hnn_settings settings = seven();
    struct hnn_training training = hnn_training_defaults();
    struct path file = files_temporary("rate.h5");
    struct ad_error error = {0};
    training.optimiser = hnn_optimiser_find("sgd", &error);
    training.weight_decay = training.average = 0;
    hnn_model *a = small_model(&settings), *b = small_model(&settings);
    hnn_trainer *t = small_trainer(a, &training, &train, NULL), *u;
    size_t n = hnn_model_size(a), bytes = n * sizeof(double);
    double *before = malloc(bytes), *moved = malloc(bytes);
    const double *now = hnn_model_parameters(a);
    memcpy(before, now, bytes);
    assert_int_equal(hnn_trainer_advance(t, 1, NULL, &error), AD_OK);
    memcpy(moved, now, bytes);
    /* from the first parameters again, at a tenth of the rate: a tenth of the way */
    hnn_model_set_parameters(a, before);
    assert_int_equal(hnn_trainer_set_rate(t, 1e-4, &error), AD_OK);
    assert_close(hnn_trainer_rate(t), 1e-4, 0, 0);
    assert_int_equal(hnn_trainer_advance(t, 1, NULL, &error), AD_OK);
    for (size_t k = 0; k < n; k++)
        assert_close(now[k] - before[k], 0.1 * (moved[k] - before[k]), 1e-6, 1e-15);
    /* two steps from there, at once and one by one */
    hnn_model_set_parameters(a, before);
    assert_int_equal(hnn_trainer_advance(t, 2, NULL, &error), AD_OK);
    memcpy(moved, now, bytes);
    hnn_model_set_parameters(a, before);
    assert_int_equal(hnn_trainer_advance(t, 1, NULL, &error), AD_OK);
    assert_int_equal(hnn_trainer_advance(t, 1, NULL, &error), AD_OK);
    assert_memory_equal(now, moved, bytes);
    /* a trainer made with the same arguments goes on at that rate */
    assert_int_equal(hnn_trainer_save(t, file.text, NULL, &error), AD_OK);
    u = small_trainer(b, &training, &train, NULL);
    assert_int_equal(hnn_trainer_resume(u, file.text, &error), AD_OK);
    assert_close(hnn_trainer_rate(u), 1e-4, 0, 0);
    assert_int_equal(hnn_trainer_advance(t, 5, NULL, &error), AD_OK);
    assert_int_equal(hnn_trainer_advance(u, 5, NULL, &error), AD_OK);
    assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(b), bytes);
    const double rates[] = {0, -1, NAN, INFINITY};
    for (size_t k = 0; k < 4; k++) {
        struct ad_error why = {0};
        assert_int_equal(hnn_trainer_set_rate(t, rates[k], &why), AD_E_ARGUMENT);
    }
    hnn_trainer_free(u);
    training.optimiser = hnn_optimiser_find("lbfgs", &error);
    u = small_trainer(b, &training, &train, NULL);
    struct ad_error searches = {0};
    assert_int_equal(hnn_trainer_set_rate(u, 1e-2, &searches), AD_E_ARGUMENT);
    hnn_trainer_free(u);

    enum ad_status inside = AD_OK;
    training.progress = again;
    training.context = &inside;
    u = small_trainer(b, &training, &train, NULL);
    assert_int_equal(small_run(u), HNN_STOP_INTERRUPTED);
    assert_int_equal(inside, AD_E_ARGUMENT);
    hnn_trainer_free(u);
    /* weights that became too large for the next number: said, and the model stays */
    training.progress = NULL;
    training.optimiser = hnn_optimiser_find("sgd", &error);
    training.learning_rate = 1e308;
    memcpy(before, hnn_model_parameters(b), bytes);
    double far[120];
    for (size_t k = 0; k < 120; k++)
        far[k] = 1e4 * train.target[k];
    struct hnn_samples steep = {.n = 60, .x = train.x, .target = far};
    u = small_trainer(b, &training, &steep, NULL);
    struct ad_error lost = {0};
    assert_int_equal(hnn_trainer_advance(u, 1, NULL, &lost), AD_E_NONFINITE);
    assert_memory_equal(before, hnn_model_parameters(b), bytes);
    hnn_trainer_free(u);
    hnn_trainer_free(t);
    free(before);
    free(moved);
    hnn_model_free(a);
    hnn_model_free(b);
    small_samples_free(&train);
}

/* A normalisation is part of programs that were recorded before it. */
static void test_normalised_later(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 20, 0);
    struct hnn_settings settings = seven();
    struct hnn_training training = hnn_training_defaults();
    const double x[2] = {0.4, 0.5}, centre[2] = {0.1, -0.2}, size[2] = {2, 3};
    double early[2], late[2];
    struct ad_error error = {0};
    hnn_model *a = small_model(&settings), *b = small_model(&settings);
    assert_int_equal(hnn_model_field(a, x, early), AD_OK);
    hnn_trainer *t = small_trainer(a, &training, &train, NULL);
    assert_int_equal(hnn_model_normalise(a, centre, size, size, &error), AD_OK);
    assert_int_equal(hnn_model_normalise(b, centre, size, size, &error), AD_OK);
    assert_int_equal(hnn_model_field(a, x, early), AD_OK);
    assert_int_equal(hnn_model_field(b, x, late), AD_OK);
    assert_true(early[0] == late[0] && early[1] == late[1]);
    assert_int_equal(hnn_trainer_run(t, NULL, &error), AD_E_ARGUMENT);
    hnn_trainer_free(t);
    hnn_model_free(a);
    hnn_model_free(b);
    small_samples_free(&train);
}

/* The order of samples has numbers of 32 bits. */
static void test_too_many_samples(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 20, 0), many = train;
    struct hnn_settings settings = seven();
    struct hnn_training training = hnn_training_defaults();
    struct ad_error error = {0};
    hnn_model *model = small_model(&settings);
    hnn_trainer *trainer;
    many.n = (size_t)1 << 32;
    assert_int_equal(hnn_trainer_new(model, &training, &many, NULL, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "4294967296");
    assert_null(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_advance),
        cmocka_unit_test(test_between_steps),
        cmocka_unit_test(test_normalised_later),
        cmocka_unit_test(test_too_many_samples),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
