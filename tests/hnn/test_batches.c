/* Samples in pieces: batches by permutation, large sets, blocks of columns. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/train/train.h"

#include <stdlib.h>
#include <string.h>

/* Surveys in pieces, the last one not full, give the loss of the whole. */
static void test_large_sets(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(3, 4096 + 777, 0);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.batch = 10;
    hnn_trainer *trainer = small_trainer(model, &training, &train, &small_none);
    assert_close(hnn_trainer_train_loss(trainer), small_loss(model, &train), 1e-12, 0);
    assert_true(isnan(hnn_trainer_test_loss(trainer)));
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
}

/* Seven batches of 3 from 7 samples take each three times. */
static void test_batches(void **state)
{
    (void)state;
    enum { N = 7, BATCH = 3 };
    double x[N], target[N], drawn[BATCH], with[BATCH];
    uint32_t picked[BATCH];
    int times[N] = {0};
    for (int k = 0; k < N; k++) {
        x[k] = k;
        target[k] = 10 * k;
    }
    struct hnn_data data;
    struct ad_error error = {0};
    hnn_data_new(&data, AD_F64, &(struct hnn_training){.size = sizeof(struct hnn_training)},
                 &(struct hnn_samples){.n = N, .x = x, .target = target}, NULL, 1, 1, &error);
    assert_int_equal(hnn_data_shuffle(&data, 3, &error), AD_OK);
    for (int k = 0; k < N; k++) {
        hnn_data_draw(&data, BATCH, picked);
        hnn_data_copy(&data, picked, 0, BATCH, BATCH, drawn, with);
        for (int j = 0; j < BATCH; j++) {
            times[(int)drawn[j]]++;
            assert_true(with[j] == 10 * drawn[j]);
        }
    }
    for (int k = 0; k < N; k++)
        assert_int_equal(times[k], 3);
    hnn_data_free(&data);
}

/* A batch in blocks of samples, and of columns, gives the loss and gradient of the whole; to the
   last bit whatever the number of threads. */
static void check_blocks(enum ad_type type, size_t samples, double tolerance)
{
    struct hnn_samples train = small_pendulum(3, samples, 0.3);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    s.precision = type;
    hnn_model *model = small_model(&s);
    struct ad_error error = {0}, failed = {0};
    size_t n = hnn_model_size(model), bytes = n * hnn_type_bytes(type);
    double *whole = malloc(n * sizeof *whole), *found = malloc(n * sizeof *found), loss[3];
    void *first = malloc(bytes);

    setenv("LEASTACTION_COLUMNS", "0", 1);
    ad_tape *tape = ad_tape_new(type);
    ad_var p = ad_input(tape, 1, n, "parameters"), g;
    ad_var x = ad_const(tape, 2, samples, train.x),
           target = ad_const(tape, 2, samples, train.target);
    struct hnn_training training = hnn_training_defaults();
    ad_var mean = ad_mean(hnn_record_losses(model, &training, p, x, target));
    ad_program *program;
    ad_grad(mean, 1, &p, &g);
    assert_int_equal(ad_compile(tape, 2, (ad_var[]){mean, g}, &program), AD_OK);
    memcpy(ad_data(program, p), hnn_model_parameters(model), bytes);
    ad_run(program);
    ad_get(program, mean, &loss[0]);
    ad_get(program, g, whole);

    setenv("LEASTACTION_COLUMNS", "150", 1);
    for (size_t threads = 1; threads <= 3; threads++) {
        struct hnn_problem problem;
        struct hnn_data data;
        training.threads = threads;
        training.batch = 0;
        hnn_data_new(&data, type, &training, &train, NULL, 2, 2, &error);
        assert_int_equal(hnn_problem_new(&problem, model, &training, &data, &failed, &error),
                         AD_OK);
        memcpy(hnn_problem_point(&problem), hnn_model_parameters(model), bytes);
        loss[1] = hnn_problem_evaluate(&problem);
        assert_close(loss[1], loss[0], tolerance, 0);
        if (threads == 1) {
            memcpy(first, hnn_problem_gradient(&problem), bytes);
            loss[2] = loss[1];
        }
        assert_memory_equal(hnn_problem_gradient(&problem), first, bytes);
        assert_true(loss[1] == loss[2]);
        hnn_problem_free(&problem);
    }
    unsetenv("LEASTACTION_COLUMNS");
    hnn_to_double(type, n, first, found);
    for (size_t k = 0; k < n; k++)
        assert_close(found[k], whole[k], tolerance, tolerance);
    free(whole);
    free(found);
    free(first);
    ad_program_free(program);
    ad_tape_free(tape);
    hnn_model_free(model);
    small_samples_free(&train);
}

static void test_blocks(void **state)
{
    (void)state;
    for (size_t n = 601; n < 6000; n += 4600) { /* of one block, and of five, the last not full */
        check_blocks(AD_F32, n, 2e-6);
        check_blocks(AD_F64, n, 1e-14);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_large_sets),
        cmocka_unit_test(test_batches),
        cmocka_unit_test(test_blocks),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
