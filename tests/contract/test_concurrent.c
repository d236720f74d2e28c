/* Threads that share no handle: each trains, writes a model, reads it, and computes with it, at the
   same time as the others, and gets what one thread alone gets. HDF5 calls wait for each other. */
#include "hnn/data/data.h"
#include "quantum/quantum.h"
#include "tests/close.h"
#include "tests/files.h"

#include <pthread.h>
#include <stdio.h>

enum { THREADS = 4, N = 64, ROUNDS = 3 };

struct job {
    struct path file;
    double rate[2], kernel;
    struct ad_error error;
};

static void train(struct job *job)
{
    double q[N], p[N], dq[N], dp[N];
    for (int i = 0; i < N; i++)
        q[i] = 2 * sin(i), p[i] = cos(1.7 * i), dq[i] = p[i], dp[i] = -sin(q[i]);
    struct hnn_columns columns = {4, N, (const double *[]){q, p, dq, dp}, NULL};
    struct hnn_dataset_settings from = {
        .size = sizeof from, .columns = &columns, .state = "1,2", .rate = "3,4"};
    struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_training how = hnn_training_defaults();
    struct hnn_dataset data;
    hnn_model *model = NULL, *read = NULL;
    hnn_trainer *trainer = NULL;
    settings.hidden[0] = settings.hidden[1] = 12;
    how.batch = 16;
    how.threads = 2;
    hnn_dataset_read(&from, &data, &job->error);
    hnn_model_new(&settings, &model, &job->error);
    hnn_trainer_new(model, &how, &data.train, NULL, &trainer, &job->error);
    for (int k = 0; k < ROUNDS; k++) {
        hnn_trainer_advance(trainer, 5, NULL, &job->error);
        hnn_trainer_save(trainer, job->file.text, NULL, &job->error);
        hnn_model_free(read);
        hnn_model_load(job->file.text, &read, &job->error);
    }
    if (job->error.status == AD_OK)
        hnn_model_field(read, (double[]){0.3, 0.4}, job->rate);
    hnn_model_free(read);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    hnn_dataset_free(&data);
}

static void propagate(struct job *job)
{
    static const struct qm_grid grid = {-5, 5, 32};
    struct phys_system system;
    qm_complex K[32 * 32];
    double V[32];
    for (size_t a = 0; a < 32; a++)
        V[a] = 0.5 * qm_x(&grid, a) * qm_x(&grid, a);
    qm_sampled(&grid, V, 1, &system, &job->error);
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = grid, .dt = 0.5, .hbar = 1};
    qm_kernel(&slice, K, &job->error);
    job->kernel = ((double *)K)[17];
    phys_system_close(&system);
}

static void *run(void *job)
{
    train(job);
    propagate(job);
    return NULL;
}

static void test_concurrent(void **state)
{
    (void)state;
    static struct job alone, job[THREADS];
    pthread_t thread[THREADS];
    char name[20];
    alone.file = files_temporary("alone.h5");
    run(&alone);
    for (int k = 0; k < THREADS; k++) {
        snprintf(name, sizeof name, "%d.h5", k);
        job[k].file = files_temporary(name);
        assert_int_equal(pthread_create(&thread[k], NULL, run, &job[k]), 0);
    }
    for (int k = 0; k < THREADS; k++)
        pthread_join(thread[k], NULL);
    for (int k = 0; k < THREADS; k++) {
        if (job[k].error.status != AD_OK)
            fail_msg("%s", job[k].error.message);
        assert_true(job[k].rate[0] == alone.rate[0] && job[k].rate[1] == alone.rate[1] &&
                    job[k].kernel == alone.kernel && alone.kernel != 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_concurrent)};
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
