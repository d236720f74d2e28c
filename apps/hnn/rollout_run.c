/* Rollouts from one start or many, and their errors (rollout.h). */
#include "rollout.h"

#include <math.h>

static const double truth_tolerance = 1e-12;

const char *rollout_name(const struct rollout_model *model)
{
    return hnn_kinds[hnn_model_settings(model->model)->kind];
}

const char *rollout_method(const struct rollout_run *run)
{
    for (size_t k = 0; k < run->n_models; k++)
        if (rollout_map_step(&run->model[k]) == 0)
            return run->settings.integrator->name;
    return "map";
}

size_t rollout_curves(const struct rollout_run *run, struct rollout_curve curve[ROLLOUT_MODELS + 1])
{
    static const char *const prefix[ROLLOUT_MODELS] = {"", "against_"};
    size_t n = 0;
    for (; n < run->n_models; n++)
        curve[n] = (struct rollout_curve){prefix[n], &run->model[n].path, &run->model[n]};
    if (run->truth.n)
        curve[n++] = (struct rollout_curve){"truth_", &run->truth, NULL};
    return n;
}

enum ad_status rollout_name_cause(const char *what, struct ad_error *error)
{
    struct ad_error cause = *error;
    if (cause.status == AD_OK)
        return AD_OK;
    *error = (struct ad_error){0};
    return ad_fail(error, cause.status, "%s: %.300s", what, cause.message);
}

/* The true motion is given the energy that the model is given. */
static enum ad_status follow_truth(struct rollout_run *run, struct ad_error *error)
{
    struct hnn_rollout_settings s = run->settings;
    struct hnn_rollout_info info;
    s.integrator = NULL;
    s.rtol = truth_tolerance;
    s.reverse = false;
    hnn_rollout(&run->energy, &s, run->x0, &run->truth, &info, error);
    return rollout_name_cause(run->options->truth, error);
}

/* Of a measured motion it was computed from the true energy. */
static enum ad_status measure_as_published(const struct rollout_run *run, struct rollout_model *m,
                                           struct ad_error *error)
{
    m->score.energy_mse_published =
        run->task || run->system.scene || rollout_map_step(m) > 0 ? NAN : m->energy_mse;
    if (run->task && run->settings.add == 0 && rollout_map_step(m) == 0)
        hnn_task_published_mse(run->task, option_number_or(run->options->strength, 0), &m->ode,
                               &run->settings, &m->path, &run->truth,
                               &m->score.energy_mse_published, error);
    return rollout_name_cause(m->file, error);
}

static void measure_path(const struct rollout_run *run, struct rollout_model *m)
{
    if (hnn_model_conserves(m->model))
        m->conserved_drift = hnn_energy_drift(&m->ode, &m->path, &run->settings);
    if (run->truth.n) {
        m->coordinate_mse = hnn_path_mse(&m->path, &run->truth);
        m->energy_mse_model = hnn_energy_mse(&m->ode, &m->path, &run->truth);
    }
    if (run->truth.n && run->energy.n)
        m->energy_mse = hnn_energy_mse(&run->energy, &m->path, &run->truth);
    m->outside = hnn_path_outside(m->model, &m->path, m->what, sizeof m->what);
}

/* Accelerations are infinite where L_vv is singular; a step that leaps over such a place is none of
   its motion. */
static enum ad_status check_mass(const struct rollout_model *m, struct ad_error *error)
{
    struct hnn_mass mass;
    if (hnn_model_settings(m->model)->kind != HNN_LAGRANGIAN ||
        hnn_path_mass(m->model, &m->path, &mass, error) != AD_OK)
        return error->status;
    if (mass.negative_least != mass.negative_most)
        ad_fail(error, AD_E_ACCURACY,
                "%s: L_vv is singular on the way: it has %zu to %zu negative eigenvalues", m->file,
                mass.negative_least, mass.negative_most);
    return error->status;
}

static enum ad_status follow_one_start(struct rollout_run *run, struct ad_error *error)
{
    bool measured = run->truth.n > 0;
    if (!measured && run->energy.n && follow_truth(run, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < run->n_models; k++) {
        struct rollout_model *m = &run->model[k];
        struct hnn_rollout_settings s = run->settings;
        s.dt = rollout_map_step(m) > 0 ? rollout_map_step(m) : s.dt;
        if (rollout_map_step(m) > 0)
            hnn_map_rollout(m->model, &s, run->x0, &m->path, &m->info, error);
        else
            hnn_rollout(&m->ode, &s, run->x0, &m->path, &m->info, error);
        if (rollout_name_cause(m->file, error) != AD_OK)
            return error->status;
        measure_path(run, m);
        if (check_mass(m, error) != AD_OK || measure_as_published(run, m, error) != AD_OK)
            return error->status;
    }
    return AD_OK;
}

static enum ad_status average_starts(struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    const struct hnn_rollout_settings *s = &run->settings;
    struct hnn_trials trials = {.size = sizeof trials,
                                .starts = o->starts,
                                .points = s->n,
                                .time = s->t[s->n - 1],
                                .strength = option_number_or(o->strength, 0),
                                .seed = o->common.seed,
                                .integrator = s->integrator,
                                .dt = s->dt,
                                .rtol = s->rtol};
    for (size_t k = 0; k < run->n_models; k++) {
        struct rollout_model *m = &run->model[k];
        hnn_task_trials(&m->ode, run->task, &trials, &m->score, error);
        if (rollout_name_cause(m->file, error) != AD_OK)
            return error->status;
        m->energy_mse = m->score.energy_mse;
        m->energy_mse_model = m->score.energy_mse_model;
        m->coordinate_mse = m->score.coordinate_mse;
        if (hnn_model_conserves(m->model))
            m->conserved_drift = m->score.conserved_drift;
        m->info = (struct hnn_rollout_info){.evaluations = m->score.evaluations,
                                            .seconds = m->score.seconds,
                                            .reversal_error = NAN};
    }
    return AD_OK;
}

enum ad_status rollout_run(void *context, struct ad_error *error)
{
    struct rollout_run *run = context;
    return run->options->starts == OPTION_NO_COUNT ? follow_one_start(run, error)
                                                   : average_starts(run, error);
}
