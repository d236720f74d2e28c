/* Training jobs of chart jobs (chart_jobs.h): Hamiltonian networks on the published tasks, f32, one
   thread, complete trainings; the error is that of the energy along motions from other starts. */
#include "chart_hnn.h"
#include "chart_jobs.h"
#include "apps/bench/measure/timing.h"

#include <math.h>

enum { SEED = 1, STARTS = 10, QUICK = 50 };

static const double limit = 40; /* seconds of one training */

/* The published training, and ours. */
static const struct network_job {
    const char *task;
    size_t batch, steps; /* as published */
    double weight_decay;
    size_t our_steps;
    double our_rate;
} network_jobs[] = {
    {"spring", 0, 2000, 1e-4, 500, 3e-3},
    {"pendulum", 0, 2000, 1e-4, 1000, 1e-3},
    {"twobody", 200, 10000, 0, 2500, 3e-3},
};

struct clock {
    double began, limit;
    bool cut;
};

static bool in_time(void *context, hnn_trainer *trainer)
{
    struct clock *clock = context;
    (void)trainer;
    clock->cut = processor_seconds() - clock->began > clock->limit;
    return !clock->cut;
}

static enum ad_status train(const struct hnn_task *task, const struct hnn_observations *data,
                            struct hnn_training training, struct job_side *side,
                            struct ad_error *error)
{
    const size_t n = data->rows;
    const struct hnn_samples samples = {
        .n = n, .x = data->values, .target = data->values + 2 * data->dof * n};
    struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, task->dof);
    struct clock clock = {.limit = limit};
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    enum hnn_stop stop;
    settings.precision = AD_F32;
    training.every = SIZE_MAX;
    training.threads = 1;
    training.progress = in_time;
    training.context = &clock;
    if (hnn_model_new(&settings, &model, error) == AD_OK &&
        hnn_trainer_new(model, &training, &samples, &(struct hnn_samples){0}, &trainer, error) ==
            AD_OK) {
        clock.began = processor_seconds();
        if (hnn_trainer_run(trainer, &stop, error) == AD_OK) {
            side->seconds = processor_seconds() - clock.began;
            side->cut = clock.cut;
            network_energy_error(model, task, STARTS, &side->error, error);
        }
    }
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    return error->status;
}

static enum ad_status one_task(const struct network_job *given, bool quick, struct job *job,
                               struct ad_error *error)
{
    const struct hnn_task *task = hnn_task_find(given->task, error);
    struct hnn_observations data = {0};
    struct hnn_training published = hnn_training_defaults();
    published.batch = given->batch;
    published.steps = given->steps / (quick ? QUICK : 1);
    published.weight_decay = given->weight_decay;
    struct hnn_training ours = published;
    published.average = 0;
    ours.steps = given->our_steps / (quick ? QUICK : 1);
    ours.learning_rate = given->our_rate;
    ours.schedule = hnn_schedule_find("cosine", error);
    *job = (struct job){
        .name = given->task, .group = "network", .measure = "mean square error of the energy"};
    if (hnn_task_observe(task, &task->published, SEED, &data, error) == AD_OK &&
        train(task, &data, published, &job->published, error) == AD_OK)
        train(task, &data, ours, &job->ours, error);
    job->level = job->ours.error <= job->published.error ? job->ours.seconds : INFINITY;
    hnn_observations_free(&data);
    return error->status;
}

enum ad_status jobs_networks(bool quick, struct job jobs[], size_t *n, struct ad_error *error)
{
    size_t tasks = quick ? 1 : sizeof network_jobs / sizeof *network_jobs;
    for (size_t k = 0; k < tasks && error->status == AD_OK; k++)
        if (one_task(&network_jobs[k], quick, &jobs[*n], error) == AD_OK)
            ++*n;
    return error->status;
}
