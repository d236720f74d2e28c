/* Test loss and energy error against seconds of training (chart_hnn.h). The data are a pendulum's
   without noise: with it all losses end at the noise, whatever the network. */
#include "chart_hnn_learning.h"
#include "timing.h"
#include "hnn/rollout/rollout.h"

#include <math.h>
#include <stdlib.h>

enum { TRIALS = 25, POINTS = PUBLISHED_BATCH / TRIALS, FIRST_STAGE = 4, STARTS = 5 };
enum { MOST_STEPS = 1 << 14, MOST_STEPS_QUICK = 32 };

static const double budget = 4;      /* seconds of training a network */
static const double accuracy = 1e-6; /* of rollouts: under any error of a model */

struct lesson {
    const struct hnn_task *task;
    struct hnn_observations train, test;
    size_t most_steps;
    double most_seconds;
    size_t stage;        /* the step to measure at */
    double began, spent; /* processor seconds, of this stage and in those before */
};

static struct hnn_samples samples(const struct hnn_observations *o)
{
    return (struct hnn_samples){
        .n = o->rows, .x = o->values, .target = o->values + 2 * o->dof * o->rows};
}

/* Stops at the next stage, or where the time is up. */
static bool go_on(void *context, hnn_trainer *trainer)
{
    const struct lesson *lesson = context;
    return hnn_trainer_step(trainer) < lesson->stage &&
           lesson->spent + processor_seconds() - lesson->began < lesson->most_seconds;
}

enum ad_status network_energy_error(hnn_model *model, const struct hnn_task *task, size_t starts,
                                    double *mse, struct ad_error *error)
{
    const struct hnn_trials trials = {.starts = starts, .rtol = accuracy};
    struct phys_ode ode = {0};
    struct hnn_score score;
    struct ad_error lost = {0};
    *mse = INFINITY;
    if (hnn_model_ode(model, &ode, error) == AD_OK &&
        hnn_task_trials(&ode, task, &trials, &score, &lost) == AD_OK)
        *mse = score.energy_mse;
    phys_ode_free(&ode);
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
        ad_fail(error, lost.status, "%s", lost.message);
    return error->status;
}

static enum ad_status one_stage(struct lesson *lesson, hnn_model *model, hnn_trainer *trainer,
                                struct learning_point *at, struct ad_error *error)
{
    enum hnn_stop stop;
    lesson->began = processor_seconds();
    if (hnn_trainer_run(trainer, &stop, error) != AD_OK)
        return error->status;
    lesson->spent += processor_seconds() - lesson->began;
    *at = (struct learning_point){.step = hnn_trainer_step(trainer),
                                  .seconds = lesson->spent,
                                  .test_loss = hnn_trainer_test_loss(trainer)};
    return network_energy_error(model, lesson->task, STARTS, &at->energy_mse, error);
}

/* Stages of 4, 8, 16 ... steps, until the time is up. */
static enum ad_status learn(struct lesson *lesson, hnn_model *model, hnn_trainer *trainer,
                            struct learning_curve *curve, struct ad_error *error)
{
    lesson->spent = 0;
    for (lesson->stage = FIRST_STAGE;
         lesson->stage <= lesson->most_steps && lesson->spent < lesson->most_seconds;
         lesson->stage *= 2)
        if (one_stage(lesson, model, trainer, &curve->point[curve->n++], error) != AD_OK)
            break;
    return error->status;
}

/* The model belongs to the caller, also on failure. */
static enum ad_status one_network(struct lesson *lesson, struct learning_curve *curve,
                                  hnn_model **model, struct ad_error *error)
{
    struct hnn_training training = hnn_training_defaults();
    const struct hnn_settings settings = network_settings(&curve->network);
    const struct hnn_samples train = samples(&lesson->train), test = samples(&lesson->test);
    hnn_trainer *trainer = NULL;
    training.steps = training.every = SIZE_MAX;
    training.weight_decay = 0; /* nothing to forget: there is no noise */
    training.threads = 1;
    training.progress = go_on;
    training.context = lesson;
    if (hnn_model_new(&settings, model, error) == AD_OK &&
        hnn_trainer_new(*model, &training, &train, &test, &trainer, error) == AD_OK)
        learn(lesson, *model, trainer, curve, error);
    hnn_trainer_free(trainer);
    return error->status;
}

/* ---- what is told ---- */

static void report(const struct chart_settings *settings, const struct learning_curve *c, FILE *csv,
                   struct json *json)
{
    const char *kind = hnn_kinds[c->network.kind], *type = hnn_precisions[c->network.type];
    const struct learning_point *last = &c->point[c->n - 1];
    for (const struct learning_point *p = c->point; p <= last; p++)
        fprintf(csv, "%s,%s,%zu,%zu,%.4g,%.6g,%.6g\n", kind, type, c->network.width, p->step,
                p->seconds, p->test_loss, p->energy_mse);
    json_object(json, NULL);
    json_text(json, "model", kind);
    json_text(json, "precision", type);
    json_count(json, "width", c->network.width);
    json_count(json, "steps", last->step);
    json_number(json, "seconds", last->seconds);
    json_number(json, "test_loss", last->test_loss);
    json_number(json, "energy_mse", last->energy_mse);
    json_end_object(json);
    if (settings->quiet)
        return;
    printf("%-9s %5zu  %s %8zu %9.2f %11.2e %11.2e\n", kind, c->network.width, type, last->step,
           last->seconds, last->test_loss, last->energy_mse);
    fflush(stdout);
}

/* ---- all ---- */

static enum ad_status all_networks(const struct chart_settings *settings, struct lesson *lesson,
                                   size_t n, struct learning_curve curves[n], FILE *csv,
                                   struct json *json, hnn_model **kept, struct ad_error *error)
{
    for (size_t k = 0; k < n; k++) {
        const struct network *w = &curves[k].network;
        hnn_model *model = NULL;
        one_network(lesson, &curves[k], &model, error);
        if (w->kind == HNN_HAMILTONIAN && w->type == AD_F32 && w->width == PUBLISHED_WIDTH)
            *kept = model;
        else
            hnn_model_free(model);
        if (error->status != AD_OK)
            break;
        report(settings, &curves[k], csv, json);
    }
    return error->status;
}

static enum ad_status open_lesson(struct lesson *lesson, struct ad_error *error)
{
    lesson->task = hnn_task_find("pendulum", error);
    struct hnn_sampling sampling = lesson->task->published;
    sampling.trials = TRIALS;
    sampling.points = POINTS;
    sampling.noise = 0;
    if (hnn_task_observe(lesson->task, &sampling, 1, &lesson->train, error) == AD_OK)
        hnn_task_observe(lesson->task, &sampling, 2, &lesson->test, error);
    return error->status;
}

enum ad_status chart_learning(const struct chart_settings *settings, struct json *json,
                              hnn_model **model, struct ad_error *error)
{
    struct network networks[NETWORKS_MOST];
    struct learning_curve curves[NETWORKS_MOST];
    struct lesson lesson = {.most_steps = settings->quick ? MOST_STEPS_QUICK : MOST_STEPS,
                            .most_seconds = settings->quick ? INFINITY : budget};
    struct result csv = {0};
    struct plot plot = {0};
    size_t n = networks_of_chart(settings->quick, networks);
    for (size_t k = 0; k < n; k++)
        curves[k] = (struct learning_curve){.network = networks[k]};
    if (chart_csv(settings, "hnn-learning", &csv, error) == AD_OK &&
        chart_picture(settings, "hnn-learning", &plot, error) == AD_OK &&
        open_lesson(&lesson, error) == AD_OK) {
        fputs("model,precision,width,step,seconds,test_loss,energy_mse\n", csv.out);
        if (!settings->quiet)
            printf("%-9s %5s  %s %8s %9s %11s %11s\n", "", "width", "   ", "steps", "seconds",
                   "test loss", "energy MSE");
        json_array(json, "learning");
        all_networks(settings, &lesson, n, curves, csv.out, json, model, error);
        json_end_array(json);
    }
    if (error->status == AD_OK) {
        if (!settings->quiet)
            printf("a pendulum, %d samples without noise; energy: %d motions to t = 20\n\n",
                   PUBLISHED_BATCH, STARTS);
        learning_draw(n, curves, &plot);
    }
    hnn_observations_free(&lesson.train);
    hnn_observations_free(&lesson.test);
    return chart_end(&plot, &csv, error);
}
