/* Energy errors as in the table of arXiv 1906.01563: model and truth from the same random starts
   (rollout.h). */
#include "rollout.h"
#include "autodiff/sized.h"
#include "hnn/tasks/task.h"

#include <math.h>
#include <stdlib.h>

/* Tolerance of the true motion: its energy error is then far below any model's. */
static const double accuracy = 1e-12;

enum { STARTS = 15, POINTS = 100, TIME = 20 };

/* The motion from x0 with outputs at times longer by this factor. */
static enum ad_status follow_stretched(const struct phys_ode *model, double stretch,
                                       const struct hnn_rollout_settings *settings,
                                       const double *x0, struct hnn_path *path,
                                       struct ad_error *error)
{
    struct hnn_rollout_settings longer = *settings;
    struct hnn_rollout_info info;
    double *t = malloc(settings->n * sizeof *t);
    if (!t)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu outputs", settings->n);
    for (size_t k = 0; k < settings->n; k++)
        t[k] = stretch * settings->t[k];
    longer.t = t;
    longer.reverse = false;
    hnn_rollout(model, &longer, x0, path, &info, error);
    free(t);
    return error->status;
}

enum ad_status hnn_task_published_mse(const struct hnn_task *task, double strength,
                                      const struct phys_ode *model,
                                      const struct hnn_rollout_settings *settings,
                                      const struct hnn_path *path, const struct hnn_path *truth,
                                      double *mse, struct ad_error *error)
{
    struct hnn_path stretched = {0};
    struct phys_ode energy = {0};
    if (AD_LACKS(error, task, model, settings, path, truth, mse))
        return error->status;
    AD_OWN(hnn_rollout_settings, settings, reverse, error);
    bool stretches = task->time_stretch > 0 && task->time_stretch != 1;
    if ((task->published_energy
             ? phys_ode_hamiltonian(task->published_energy, task->dof, &strength, &energy, error)
             : hnn_task_ode(task, strength, &energy, error)) == AD_OK &&
        (!stretches || follow_stretched(model, task->time_stretch, settings, path->x, &stretched,
                                        error) == AD_OK))
        *mse = hnn_energy_mse(&energy, stretches ? &stretched : path, truth);
    hnn_path_free(&stretched);
    phys_ode_free(&energy);
    return error->status;
}

struct setting {
    const struct phys_ode *model;
    const struct hnn_task *task;
    struct phys_ode truth;
    struct hnn_sampling sampling;
    struct hnn_rollout_settings of_model, of_truth;
    double *t; /* [points] */
    struct phys_random random;
};

static enum ad_status prepare(const struct hnn_task *task, const struct hnn_trials *trials,
                              struct setting *s, struct ad_error *error)
{
    size_t points = trials->points ? trials->points : POINTS;
    double time = trials->time > 0 ? trials->time : TIME;
    if (!(trials->time >= 0 && isfinite(trials->time)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "time: expected more than 0, or 0 as published, got %g", trials->time);
    if (s->model->n != 2 * task->dof)
        return ad_fail(error, AD_E_ARGUMENT, "%s has %zu coordinates and momenta, %s has %zu",
                       s->model->name, s->model->n, task->name, 2 * task->dof);
    if (points < 2 || !(s->t = calloc(points, sizeof *s->t)))
        return ad_fail(error, points < 2 ? AD_E_ARGUMENT : AD_E_MEMORY,
                       "points: expected at least 2, got %zu", points);
    s->sampling = task->published;
    s->sampling.strength = hnn_task_strength(task, trials->strength);
    hnn_times(0, time, points, s->t);
    s->of_model = (struct hnn_rollout_settings){.size = sizeof(struct hnn_rollout_settings),
                                                .integrator = trials->integrator,
                                                .dt = trials->dt,
                                                .rtol = trials->rtol,
                                                .n = points,
                                                .t = s->t};
    s->of_truth = (struct hnn_rollout_settings){
        .size = sizeof(struct hnn_rollout_settings), .rtol = accuracy, .n = points, .t = s->t};
    phys_random_seed(&s->random, trials->seed);
    return hnn_task_ode(task, s->sampling.strength, &s->truth, error);
}

static void release(struct setting *s)
{
    phys_ode_free(&s->truth);
    free(s->t);
}

/* Adds the errors of one start. */
static enum ad_status try_start(const struct setting *s, const double *x0, struct hnn_score *sum,
                                struct ad_error *error)
{
    struct hnn_path path = {0}, truth = {0};
    struct hnn_rollout_info info, unused;
    double published;
    if (hnn_rollout(s->model, &s->of_model, x0, &path, &info, error) == AD_OK &&
        hnn_rollout(&s->truth, &s->of_truth, x0, &truth, &unused, error) == AD_OK &&
        hnn_task_published_mse(s->task, s->sampling.strength, s->model, &s->of_model, &path, &truth,
                               &published, error) == AD_OK) {
        sum->energy_mse_published += published;
        sum->energy_mse += hnn_energy_mse(&s->truth, &path, &truth);
        sum->energy_mse_model += hnn_energy_mse(s->model, &path, &truth);
        sum->coordinate_mse += hnn_path_mse(&path, &truth);
        sum->conserved_drift += hnn_energy_drift(s->model, &path, &s->of_model);
        sum->evaluations += info.evaluations;
        sum->seconds += info.seconds;
    }
    hnn_path_free(&path);
    hnn_path_free(&truth);
    return error->status;
}

enum ad_status hnn_task_trials(const struct phys_ode *model, const struct hnn_task *task,
                               const struct hnn_trials *trials, struct hnn_score *score,
                               struct ad_error *error)
{
    if (AD_LACKS(error, model, task, trials, score))
        return error->status;
    AD_OWN(hnn_trials, trials, rtol, error);
    struct setting s = {.model = model, .task = task};
    size_t starts = trials->starts ? trials->starts : STARTS;
    double x0[HNN_TASK_STATES_MOST], share = 1 / (double)starts;
    *score = (struct hnn_score){0};
    if (prepare(task, trials, &s, error) == AD_OK)
        for (size_t k = 0; k < starts && error->status == AD_OK; k++) {
            (task->published_start ? task->published_start : task->start)(&s.random, &s.sampling,
                                                                          x0);
            try_start(&s, x0, score, error);
        }
    score->energy_mse *= share;
    score->energy_mse_model *= share;
    score->energy_mse_published *= share;
    score->coordinate_mse *= share;
    score->conserved_drift *= share;
    release(&s);
    return error->status;
}
