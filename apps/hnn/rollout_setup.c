/* Sets up a rollout from the options (rollout.h). */
#include "autodiff/free.h"
#include "apps/option_values.h"
#include "rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS = 401, POINTS_OF_STARTS = 100 };

static const double default_time = 20;

/* ---- compatible options ---- */

static enum ad_status check_options(const struct rollout_options *o, struct ad_error *error)
{
    const struct common *c = &o->common;
    bool many = o->starts != OPTION_NO_COUNT, adds = !isnan(o->add_energy);
    const struct conflict rows[] = {
        {adds != !isnan(o->at), "--add-energy DE and --at T: expected both or none"},
        {!isnan(o->dt) && !isnan(o->rtol),
         "--dt and --rtol: expected one of them; leave the other out"},
        {!isnan(o->dt) && !o->integrator,
         "--dt needs --integrator NAME, one with fixed steps such as rk4"},
        {many && !o->truth, "--starts needs --truth TASK"},
        {many && (o->x0 || o->reverse || adds || c->out || c->csv || c->plot),
         "--starts: expected no --x0, --reverse, --add-energy, --out, --csv or --plot"},
        {o->energy && !o->truth, "--energy needs --truth FILE"},
        {((o->time_column && !o->inputs) || o->state || o->trial || !isnan(o->from) ||
          o->skip_missing || o->skip_rows) &&
             !o->truth,
         "--state, --time-column, --trial, --from, --skip-missing and --skip-rows need --truth "
         "FILE"},
        {!isnan(o->strength) && !o->truth, "--strength needs --truth TASK"},
    };
    return options_conflicts(sizeof rows / sizeof *rows, rows, error);
}

enum ad_status rollout_steps(const struct rollout_options *o, struct hnn_rollout_settings *s,
                             struct ad_error *error)
{
    const char *name = o->integrator ? o->integrator : "dop853";
    s->size = sizeof *s;
    s->integrator = phys_integrator_find(name, error);
    if (!s->integrator)
        return error->status;
    if (!isnan(o->dt) && s->integrator->adaptive)
        return ad_fail(error, AD_E_ARGUMENT, "--dt: %s chooses its steps; give --rtol E", name);
    if (!isnan(o->rtol) && !s->integrator->adaptive)
        return ad_fail(error, AD_E_ARGUMENT, "--rtol: %s has fixed steps; give --dt DT", name);
    if (isnan(o->dt) && !s->integrator->adaptive)
        return ad_fail(error, AD_E_ARGUMENT, "--integrator %s needs --dt DT, such as --dt 0.01",
                       name);
    s->dt = option_number_or(o->dt, 0);
    s->rtol = isnan(o->rtol) ? 0 : o->rtol;
    s->add = isnan(o->add_energy) ? 0 : o->add_energy;
    s->add_at = o->at;
    s->reverse = o->reverse;
    return AD_OK;
}

/* ---- models ---- */

static void component(const void *model, size_t k, char *name, size_t size)
{
    hnn_model_component(model, k, name, size);
}

double rollout_map_step(const struct rollout_model *m)
{
    const char *note = hnn_model_noted(m->model, "step");
    if (hnn_model_settings(m->model)->kind != HNN_SYMPNET)
        return 0;
    double step = note ? strtod(note, NULL) : 0;
    return step > 0 ? step : (double)NAN;
}

/* A sympnet goes by the steps that it was trained on. */
static enum ad_status check_maps(const struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    bool own = isnan(o->rtol) && isnan(o->dt) && !o->integrator, all = true;
    for (size_t k = 0; k < run->n_models; k++)
        all = all && rollout_map_step(&run->model[k]) != 0;
    for (size_t k = 0; k < run->n_models; k++) {
        const char *file = run->model[k].file;
        double step = rollout_map_step(&run->model[k]);
        if (step != 0 && (o->starts != OPTION_NO_COUNT || !isnan(o->add_energy) || (all && !own)))
            return ad_fail(error, AD_E_ARGUMENT,
                           "%s: a sympnet goes by its own steps: expected no --starts, "
                           "--add-energy, --integrator, --dt or --rtol",
                           file);
        if (isnan(step))
            return ad_fail(error, AD_E_INPUT, "%s: a sympnet without the note 'step', its length",
                           file);
    }
    return AD_OK;
}

enum ad_status rollout_add_model(struct rollout_model models[], size_t *n, const char *file,
                                 hnn_model *model, struct ad_error *error)
{
    struct rollout_model *m = &models[(*n)++];
    *m = (struct rollout_model){.file = file, .model = model};
    m->energy_mse = m->energy_mse_model = m->coordinate_mse = m->conserved_drift = NAN;
    m->score.energy_mse_published = m->energy_before = m->energy_after = NAN;
    m->motion = (struct hnn_latent_motion){NAN, NAN, NAN, NAN, HNN_MOTION_AS_DATA};
    if (!model && hnn_model_load(file, &m->model, error) != AD_OK)
        return error->status;
    const struct hnn_drive drive = {hnn_inputs_at, &m->inputs, false, NULL};
    if (hnn_model_settings(m->model)->inputs)
        hnn_model_drive(m->model, &drive); /* for rollout_give_inputs */
    if (hnn_model_settings(m->model)->kind == HNN_SYMPNET)
        m->ode = (struct phys_ode){.name = "the sympnet",
                                   .n = 2 * hnn_model_settings(m->model)->dof,
                                   .component = component,
                                   .context = m->model};
    else if (hnn_model_ode(m->model, &m->ode, error) != AD_OK)
        return error->status;
    size_t pixels = hnn_model_settings(m->model)->pixels;
    size_t first = hnn_model_settings(models[0].model)->pixels;
    if (m->ode.n != models[0].ode.n)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--against %s: its states have %zu components, those of %s %zu", file,
                       m->ode.n, models[0].file, models[0].ode.n);
    if (pixels && !first)
        return ad_fail(error, AD_E_ARGUMENT, "--against %s: is a model of pixels, %s of states",
                       file, models[0].file);
    if (pixels != first)
        return ad_fail(error, AD_E_ARGUMENT, "--against %s: has %zu pixels, %s has %zu", file,
                       pixels, models[0].file, first);
    return AD_OK;
}

void rollout_free_models(size_t n, struct rollout_model models[])
{
    for (struct rollout_model *m = models; m < models + n; m++) {
        AD_FREE(m->strip.pixels, m->strip.energy);
        hnn_path_free(&m->path);
        hnn_path_free(&m->table);
        phys_ode_free(&m->ode);
        hnn_model_free(m->model);
    }
}

/* ---- truth ---- */

static enum hnn_kind kind_of(const struct rollout_model *m)
{
    return hnn_model_settings(m->model)->kind;
}

/* Whether states have velocities; a baseline's are those of the model beside it. */
static bool in_velocities(const struct rollout_run *run)
{
    return kind_of(&run->model[0]) == HNN_LAGRANGIAN ||
           (run->n_models > 1 && kind_of(&run->model[1]) == HNN_LAGRANGIAN);
}

static bool in_momenta(const struct rollout_run *run)
{
    for (size_t k = 0; k < run->n_models; k++)
        if (kind_of(&run->model[k]) == HNN_HAMILTONIAN || kind_of(&run->model[k]) == HNN_SYMPNET)
            return true;
    return false;
}

static enum ad_status use_energy(struct rollout_run *run, const char *name, struct ad_error *error)
{
    const struct hnn_task *task = hnn_task_find(name, error);
    if (!task)
        return error->status;
    double strength = option_number_or(run->options->strength, 0);
    if (2 * task->dof != run->model[0].ode.n)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has a state of %zu numbers, the model one of %zu; expected as many",
                       name, 2 * task->dof, run->model[0].ode.n);
    if (!task->unit_masses && (task->H ? in_velocities(run) : in_momenta(run)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has states of %s, the model of %s; expected one kind", name,
                       task->H ? "momenta" : "velocities", task->H ? "velocities" : "momenta");
    return hnn_task_ode(task, strength, &run->energy, error);
}

static enum ad_status read_truth(struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    struct hnn_dataset_settings s = {.size = sizeof s,
                                     .file = o->truth,
                                     .state = o->state,
                                     .time = o->time_column,
                                     .trial = o->trial,
                                     .skip_missing = o->skip_missing,
                                     .skip_rows = o->skip_rows};
    double from = isnan(o->from) ? -INFINITY : o->from, time = isnan(o->time) ? INFINITY : o->time;
    if (!s.state)
        s.state = hnn_model_noted(run->model[0].model, "state");
    if (!s.time)
        return ad_fail(error, AD_E_ARGUMENT, "--truth %s: expected --time-column COLUMN with it",
                       o->truth);
    char *columns = rollout_input_columns(o, run->model[0].model);
    s.inputs = columns && *columns && !o->inputs ? columns : NULL;
    hnn_path_read(&s, from, time, &run->truth, error);
    free(columns);
    if (error->status != AD_OK)
        return error->status;
    if (run->truth.states != run->model[0].ode.n)
        return ad_fail(error, AD_E_ARGUMENT, "%s: %zu columns of state, the model has %zu",
                       o->truth, run->truth.states, run->model[0].ode.n);
    return o->energy ? use_energy(run, o->energy, error) : AD_OK;
}

/* The motion of a scene's Lagrangian in q and p, or of an lnn in q and v. */
static enum ad_status use_scene(struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    struct ad_error unknown = {0};
    if (phys_system_open(o->truth, &run->system, &unknown) != AD_OK)
        return ad_fail(error, unknown.status, "--truth: %s%s",
                       unknown.status == AD_E_ARGUMENT ? "no such file or task, and " : "",
                       unknown.message);
    if (phys_system_set_all(&run->system, o->common.set.n, o->common.set.setting, error) != AD_OK)
        return error->status;
    if (2 * run->system.dof != run->model[0].ode.n)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has a state of %zu numbers, the model one of %zu; expected as many",
                       o->truth, 2 * run->system.dof, run->model[0].ode.n);
    return in_velocities(run) ? phys_ode_lagrangian(&run->system, &run->energy, error)
                              : phys_ode_canonical(&run->system, &run->energy, error);
}

static bool is_data(const char *name)
{
    const char *end = strrchr(name, '.');
    return access(name, R_OK) == 0 && !(end && strcmp(end, ".so") == 0);
}

/* A task by its name, a file, or a scene. */
static enum ad_status find_truth(struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    struct ad_error not_one = {0};
    if (!o->truth)
        return AD_OK;
    run->task = hnn_task_find(o->truth, &not_one);
    bool data = !run->task && is_data(o->truth), scene = !run->task && !data;
    const struct unused unused[] = {
        {!data, "state trial from skip-missing skip-rows", "needs --truth FILE"},
        {!data && !o->inputs, "time-column", "needs --truth FILE"},
        {data, "points", "is not for --truth FILE, whose rows are the outputs"},
        {!run->task && !o->energy, "strength", "needs a task: --truth TASK or --energy TASK"},
    };
    const struct conflict rows[] = {
        {!run->task && o->starts != OPTION_NO_COUNT, "--starts needs --truth TASK"},
        {!scene && o->common.set.n, "--set needs --truth SCENE"},
    };
    if (options_conflicts(sizeof rows / sizeof *rows, rows, error) != AD_OK ||
        options_unused(&o->common, sizeof unused / sizeof *unused, unused, error) != AD_OK)
        return error->status;
    if (!data && o->energy)
        return ad_fail(error, AD_E_ARGUMENT, "--energy: %s has its own; leave it out", o->truth);
    return run->task ? use_energy(run, o->truth, error)
           : data    ? read_truth(run, error)
                     : use_scene(run, error);
}

/* ---- start and outputs ---- */

/* As `simulate` starts the scene. */
static enum ad_status start_of_scene(struct rollout_run *run, struct ad_error *error)
{
    const struct phys_system *s = &run->system;
    double *q = malloc(2 * s->dof * sizeof *q); /* and v behind it */
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (!s->scene->start)
        ad_fail(error, AD_E_ARGUMENT, "missing --x0: %s is no initial-value problem",
                s->scene->name);
    else if (s->scene->start(s->params, run->options->common.seed, q, q + s->dof, error) == AD_OK)
        phys_ode_enter(&run->energy, 0, q, q + s->dof, run->x0, error);
    free(q);
    return error->status;
}

static enum ad_status choose_start(struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    size_t states = run->model[0].ode.n;
    if (!(run->x0 = malloc(states * sizeof *run->x0)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (o->x0)
        return numbers_read("x0", o->x0, states,
                            in_velocities(run) ? "coordinates, then as many velocities"
                                               : "coordinates, then as many momenta",
                            run->x0, error);
    if (run->truth.n)
        memcpy(run->x0, run->truth.x, states * sizeof *run->x0);
    else if (run->task)
        hnn_task_start(run->task, option_number_or(o->strength, 0), o->common.seed, run->x0);
    else if (run->system.scene)
        return start_of_scene(run, error);
    else
        return ad_fail(
            error, AD_E_ARGUMENT,
            "missing --x0, %zu numbers with commas between; or --truth, which gives a start",
            states);
    return AD_OK;
}

static enum ad_status choose_outputs(struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    struct hnn_rollout_settings *s = &run->settings;
    bool many = o->starts != OPTION_NO_COUNT;
    s->n = run->truth.n                   ? run->truth.n
           : o->points != OPTION_NO_COUNT ? o->points
           : many                         ? POINTS_OF_STARTS
                                          : POINTS;
    double step = 0, time = isnan(o->time) ? default_time : o->time;
    for (size_t k = 0; k < run->n_models && step == 0; k++)
        step = rollout_map_step(&run->model[k]);
    const bool by_steps = step > 0 && !run->truth.n && o->points == OPTION_NO_COUNT;
    if (by_steps && !(time / step < 1e7))
        return ad_fail(error, AD_E_ARGUMENT, "--time %g: over 1e7 steps of %g", time, step);
    if (by_steps && time < step * (1 - 1e-12))
        return ad_fail(error, AD_E_ARGUMENT, "--time %g: expected at least a sympnet's step, %g",
                       time, step);
    if (by_steps)
        s->n = (size_t)(time / step * (1 + 1e-12)) + 1;
    s->t = run->t = malloc(s->n * sizeof *run->t);
    if (!run->t)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu outputs", s->n);
    if (run->truth.n)
        memcpy(run->t, run->truth.t, s->n * sizeof *run->t);
    else
        hnn_times(0, by_steps ? step * (double)(s->n - 1) : time, s->n, run->t);
    return AD_OK;
}

enum ad_status rollout_setup(const struct rollout_options *options, hnn_model *model,
                             struct rollout_run *run, struct ad_error *error)
{
    *run = (struct rollout_run){.options = options};
    if (rollout_add_model(run->model, &run->n_models, options->common.argument[0], model, error) !=
            AD_OK ||
        (options->against &&
         rollout_add_model(run->model, &run->n_models, options->against, NULL, error) != AD_OK) ||
        check_maps(run, error) != AD_OK || check_options(options, error) != AD_OK ||
        rollout_steps(options, &run->settings, error) != AD_OK || find_truth(run, error) != AD_OK ||
        choose_outputs(run, error) != AD_OK)
        return error->status;
    if (in_velocities(run) && in_momenta(run))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--against %s: one model has states of momenta, the other of velocities",
                       options->against);
    for (size_t k = 0; k < run->n_models; k++)
        if (rollout_give_inputs(run, &run->model[k], error) != AD_OK)
            return error->status;
    if (rollout_check_fixed(run, error) != AD_OK)
        return error->status;
    return options->starts == OPTION_NO_COUNT ? choose_start(run, error) : AD_OK;
}

void rollout_free(struct rollout_run *run)
{
    rollout_free_models(run->n_models, run->model);
    phys_ode_free(&run->energy);
    phys_system_close(&run->system);
    hnn_path_free(&run->truth);
    AD_FREE(run->t, run->x0);
}
