/* Training on ranks ends in the same file, to the last bit, whatever their number and that before a
   resume: full batches, batches drawn, both types, lbfgs, frames. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "tests/ranks.h"

#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 5 * 1024 + 77, FRAMES = 420, PIXELS = 12, MOST = 4 };

struct job {
    const char *name;
    struct hnn_settings model;
    struct hnn_training training;
    struct hnn_samples train[MOST], test; /* of each rank */
    size_t from, to;                      /* steps; from > 0: resumes */
    struct path file;
    struct ad_error error[MOST];
    double loss[MOST];
};

static void work(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct ad_error *error = &j->error[rank];
    struct hnn_training training = j->training;
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    training.ranks = ranks;
    if (hnn_model_new(&j->model, &model, error) == AD_OK)
        hnn_trainer_new(model, &training, &j->train[rank], &j->test, &trainer, error);
    ad_ranks_agree(ranks, error);
    if (j->from)
        hnn_trainer_resume(trainer, j->file.text, error);
    hnn_trainer_advance(trainer, j->to - j->from, NULL, error);
    hnn_trainer_save(trainer, j->file.text, "x", error);
    j->loss[rank] = error->status == AD_OK ? hnn_trainer_train_loss(trainer) : NAN;
    hnn_trainer_free(trainer);
    hnn_model_free(model);
}

static void check_part(struct job *job, size_t count, size_t from, size_t to)
{
    job->from = from;
    job->to = to;
    with_ranks(count, work, job);
    for (size_t k = 0; k < count + !count; k++) {
        if (job->error[k].status != AD_OK)
            fail_msg("%s, %zu ranks: %s", job->name, count, job->error[k].message);
        assert_true(job->loss[k] == job->loss[0]);
    }
}

static void check(struct job *job)
{
    size_t whole_bytes, bytes;
    job->file = files_temporary("model.h5");
    for (size_t k = 1; k < MOST; k++)
        job->train[k] = job->train[0];
    check_part(job, 0, 0, job->training.steps);
    char *whole = files_read(job->file.text, &whole_bytes);
    double loss = job->loss[0];
    for (size_t count = 1; count <= MOST; count++) {
        job->training.threads = count % 2 + 1;
        check_part(job, count, 0, 7);
        check_part(job, MOST - count, 7, job->training.steps);
        char *parts = files_read(job->file.text, &bytes);
        assert_int_equal(bytes, whole_bytes);
        assert_memory_equal(parts, whole, bytes);
        assert_true(job->loss[0] == loss);
        free(parts);
    }
    free(whole);
}

static struct job job_of(const char *name, enum ad_type type, size_t batch)
{
    struct job job = {.name = name,
                      .model = small_settings(&small_kinds[1], 1, 3),
                      .training = hnn_training_defaults()};
    job.model.precision = type;
    job.training.steps = 15;
    job.training.every = 5;
    job.training.batch = batch;
    job.train[0] = small_pendulum(1, SAMPLES, 0.1);
    job.test = small_pendulum(2, 4096 + 5, 0.1);
    return job;
}

static void job_free(struct job *job)
{
    small_samples_free(&job->train[0]);
    small_samples_free(&job->test);
}

static void test_states(void **state)
{
    (void)state;
    struct job full = job_of("full", AD_F32, 0), drawn = job_of("drawn", AD_F64, 3111),
               lbfgs = job_of("lbfgs", AD_F64, 0);
    struct ad_error error = {0};
    drawn.training.clip = 0.1;
    lbfgs.training.optimiser = hnn_optimiser_find("lbfgs", &error);
    check(&full);
    check(&drawn);
    check(&lbfgs);
    job_free(&full);
    job_free(&drawn);
    job_free(&lbfgs);
}

/* Rollouts by midpoint steps with a time and a control. */
static void test_inputs(void **state)
{
    (void)state;
    enum { N = 2100, K = 1, INPUTS = 2 };
    double *x = small_values(1, 2 + INPUTS * (K + 1), N), *target = small_values(2, 2 * K, N);
    struct job job = {.name = "inputs",
                      .model = small_settings(&small_kinds[1], 1, 2),
                      .training = hnn_training_defaults()};
    job.model.inputs = INPUTS;
    job.model.controls = 1;
    job.model.time = true;
    job.training.steps = 15;
    job.training.rollout = K;
    job.training.dt = 0.1;
    job.training.stepping = HNN_MIDPOINT;
    job.train[0] = (struct hnn_samples){.n = N, .x = x, .target = target};
    check(&job);
    free(x);
    free(target);
}

static void test_frames(void **state)
{
    (void)state;
    float *frames = malloc(FRAMES * PIXELS * sizeof *frames);
    size_t first[FRAMES - 2];
    double *values = small_values(5, FRAMES, PIXELS);
    for (size_t k = 0; k < FRAMES * PIXELS; k++)
        frames[k] = k % PIXELS ? (float)values[k] : 0; /* one pixel is dark */
    for (size_t k = 0; k < FRAMES - 2; k++)
        first[k] = k;
    struct job job = {.name = "frames",
                      .model = hnn_pixel_defaults(HNN_HAMILTONIAN, 2 * PIXELS),
                      .training = hnn_pixel_training_defaults()};
    job.model.hidden[0] = job.model.hidden[1] = job.model.autoencoder = 8;
    job.training.steps = 15;
    job.training.batch = 350;
    job.train[0] =
        (struct hnn_samples){.n = FRAMES - 2, .frames = frames, .frame = PIXELS, .first = first};
    check(&job);
    free(values);
    free(frames);
}

/* A rank that reads other data is named. */
static void test_other_data(void **state)
{
    (void)state;
    struct job job = job_of("other", AD_F64, 0);
    job.file = files_temporary("other.h5");
    struct hnn_samples other = small_pendulum(3, SAMPLES, 0.1);
    job.train[1] = job.train[0];
    job.train[2] = other;
    job.to = 3;
    with_ranks(3, work, &job);
    for (size_t k = 0; k < 3; k++) {
        assert_int_equal(job.error[k].status, AD_E_INPUT);
        assert_mentions(job.error[k].message, "training rank 2");
    }
    small_samples_free(&other);
    job_free(&job);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_states),
        cmocka_unit_test(test_inputs),
        cmocka_unit_test(test_frames),
        cmocka_unit_test(test_other_data),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
