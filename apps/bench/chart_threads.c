/* leastaction chart threads: the speed-up by a second thread for gradients of large actions and a
   training step of a large batch, in wall-clock time; one and two threads alternate, and their
   results are compared bit by bit.

   Times are the minimum of several: other processes take a processor from two threads more often
   than from one. */
#include "chart.h"
#include "apps/bench/hand/hand.h"
#include "apps/bench/measure/sized_gradient.h"
#include "apps/bench/measure/timing.h"
#include "hnn/hnn.h"
#include "hnn/train/train_speed.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDES = 2, BATCH = 6000, BATCH_QUICK = 1500, STEPS = 3, ROUNDS = 21, ROUNDS_QUICK = 5 };

/* One job on one thread and on two. */
struct sides {
    struct timed time[SIDES];
    bool same;
};

/* ---- gradients, as machine code ---- */

static const struct gradient_job {
    const char *name;
    int scene; /* of hand.h */
    size_t bodies, slices;
    bool slow; /* not in a quick chart */
} gradient_jobs[] = {
    {"gradient: gas of 50 bodies", HAND_GAS, 50, HAND_SLICES, false},
    {"gradient: gas of 500 bodies", HAND_GAS, 500, HAND_SLICES, false},
    {"gradient: gas of 1000 bodies", HAND_GAS, 1000, HAND_SLICES, true},
    {"gradient: three bodies over 1e4 slices", HAND_THREEBODY, 0, 10000, false},
    {"gradient: three bodies over 1e6 slices", HAND_THREEBODY, 0, 1000000, true},
};

static enum ad_status time_gradient(const struct gradient_job *job, size_t rounds,
                                    struct sides *sides, struct ad_error *error)
{
    struct sized_gradient s;
    ad_program *program[SIDES] = {NULL};
    if (sized_gradient_open(job->scene, job->bodies, job->slices, &s, error) == AD_OK)
        for (size_t k = 0; k < SIDES && error->status == AD_OK; k++)
            sized_gradient_compile(&s, &program[k], error);
    if (error->status == AD_OK && sized_gradient_set(&s, SIDES, program, error) == AD_OK) {
        for (size_t k = 0; k < SIDES; k++) {
            ad_native(program[k], INFINITY, NULL);
            ad_set_threads(program[k], 1 + k);
            sides->time[k] = (struct timed){.run = time_program, .context = program[k]};
        }
        time_in_turn(SIDES, sides->time, rounds);
        sides->same = memcmp(ad_data(program[0], s.gradient), ad_data(program[1], s.gradient),
                             s.system.dof * s.slices * sizeof(double)) == 0;
    }
    for (size_t k = 0; k < SIDES; k++)
        ad_program_free(program[k]);
    sized_gradient_close(&s);
    return error->status;
}

/* ---- the step of a Hamiltonian network ---- */

static void take_step(void *trainer)
{
    struct ad_error error = {0};
    hnn_trainer_take_step(trainer, &error);
}

/* Trained for a few steps, and a trainer to go on. */
static enum ad_status train(const struct hnn_samples *samples, size_t threads, hnn_model **model,
                            hnn_trainer **trainer, struct ad_error *error)
{
    const struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_training training = hnn_training_defaults();
    enum hnn_stop stop;
    training.steps = STEPS;
    training.threads = threads;
    if (hnn_model_new(&settings, model, error) == AD_OK &&
        hnn_trainer_new(*model, &training, samples, &(struct hnn_samples){0}, trainer, error) ==
            AD_OK)
        hnn_trainer_run(*trainer, &stop, error);
    return error->status;
}

static enum ad_status time_training(size_t batch, size_t rounds, struct sides *sides,
                                    struct ad_error *error)
{
    hnn_model *model[SIDES] = {NULL};
    hnn_trainer *trainer[SIDES] = {NULL};
    double *values = malloc(4 * batch * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples", batch);
    for (size_t k = 0; k < 4 * batch; k++)
        values[k] = sin(0.7 * (double)k);
    const struct hnn_samples samples = {.n = batch, .x = values, .target = values + 2 * batch};
    for (size_t k = 0; k < SIDES && error->status == AD_OK; k++)
        train(&samples, 1 + k, &model[k], &trainer[k], error);
    if (error->status == AD_OK) {
        for (size_t k = 0; k < SIDES; k++)
            sides->time[k] = (struct timed){.run = take_step, .context = trainer[k]};
        sides->same = memcmp(hnn_model_parameters(model[0]), hnn_model_parameters(model[1]),
                             hnn_model_size(model[0]) * sizeof(float)) == 0;
        time_in_turn(SIDES, sides->time, rounds);
    }
    for (size_t k = 0; k < SIDES; k++) {
        hnn_trainer_free(trainer[k]);
        hnn_model_free(model[k]);
    }
    free(values);
    return error->status;
}

/* ---- all ---- */

#define MS .digits = 4, .shown = 4, .scale = 1e3
static const struct column columns[] = {
    {.key = "job", .title = "elapsed time", .width = -36},
    {.key = "one_thread_seconds", .title = "1 thread (ms)", .width = 13, MS},
    {.key = "two_threads_seconds", .title = "2 threads (ms)", .width = 14, MS},
    {.key = "speedup", .digits = 4, .title = "speedup", .width = 7, .shown = 2, .fixed = true},
    {.key = "same_bits", .title = "same bits", .width = 9},
    {.key = NULL},
};

static enum ad_status report(struct chart *chart, struct sheet *sheet, const char *job,
                             const struct sides *sides, size_t rounds, struct ad_error *error)
{
    double one = 1e-9 * time_least(&sides->time[0], rounds);
    double two = 1e-9 * time_least(&sides->time[1], rounds);
    if (!sides->same)
        chart->missed = "one thread and two differ";
    return sheet_row(sheet,
                     ROW(NAME(job), NUMBER(one), NUMBER(two), NUMBER(one / two),
                         NAME(sides->same ? "yes" : "no")),
                     error);
}

enum ad_status chart_threads(struct chart *chart, struct ad_error *error)
{
    size_t rounds = chart->quick ? ROUNDS_QUICK : ROUNDS;
    size_t batch = chart->quick ? BATCH_QUICK : BATCH;
    struct sheet *sheet = chart_sheet(chart, "threads", columns, error);
    char name[64];
    struct sides sides;
    for (size_t k = 0; k < sizeof gradient_jobs / sizeof *gradient_jobs; k++) {
        if (chart->quick && gradient_jobs[k].slow)
            continue;
        if (time_gradient(&gradient_jobs[k], rounds, &sides, error) != AD_OK ||
            report(chart, sheet, gradient_jobs[k].name, &sides, rounds, error) != AD_OK)
            return error->status;
    }
    snprintf(name, sizeof name, "training step: HNN of %zu samples", batch);
    if (time_training(batch, rounds, &sides, error) == AD_OK)
        report(chart, sheet, name, &sides, rounds, error);
    return error->status;
}
