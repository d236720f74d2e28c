/* The report of a training. */
#include "train.h"
#include "autodiff/free.h"

#include <math.h>
#include <stdlib.h>

static double ms_per_step(const struct train_run *run)
{
    size_t steps = hnn_trainer_steps_now(run->trainer);
    return steps ? 1e3 * hnn_trainer_seconds(run->trainer) / (double)steps : (double)NAN;
}

static bool lagrangian(const struct train_run *run)
{
    return hnn_model_settings(run->model)->kind == HNN_LAGRANGIAN;
}

/* Of thousands of samples some, as the range of H is of some. */
enum { MASS_SAMPLES = 4096 };

enum ad_status train_mass(struct train_run *run, struct ad_error *error)
{
    size_t n = run->train.n, few = n < MASS_SAMPLES ? n : MASS_SAMPLES, stride = n / few;
    size_t states = 2 * hnn_model_settings(run->model)->dof + run->data.inputs;
    struct ad_ranks *ranks = run->options->common.ranks;
    if (!lagrangian(run))
        return AD_OK;
    double *some = malloc(states * few * sizeof *some);
    uint32_t *picked = malloc(few * sizeof *picked);
    if (!some || !picked)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < few && picked; k++)
        picked[k] = (uint32_t)(k * stride);
    if (ad_ranks_agree(ranks, error) == AD_OK &&
        hnn_samples_take(ranks, &run->train, (size_t[]){states, 0, 0}, 0, few, picked, some,
                         error) == AD_OK)
        hnn_model_mass(run->model, few, some, &run->mass, error);
    run->mass.worst *= stride;
    run->mass_samples = few;
    AD_FREE(some, picked);
    return error->status;
}

/* Above this condition f32 keeps no digit of an acceleration. */
static const double condition_most = 1e6;

static void report_mass(const struct train_run *run, struct report *report)
{
    const struct hnn_mass *m = &run->mass;
    report_number(report, "mass_condition", "condition of L_vv", NULL, m->condition);
    report_count(report, "mass_samples", NULL, run->mass_samples);
    report_count(report, "mass_negative", NULL, m->negative_most);
    report_count(report, "mass_negative_least", NULL, m->negative_least);
    if (m->negative_least != m->negative_most)
        report_line(
            report,
            "  L_vv has %zu to %zu negative eigenvalues: between training samples it is "
            "singular, and accelerations are infinite; train longer, or with another --seed",
            m->negative_least, m->negative_most);
    else if (m->negative_most && m->negative_most < hnn_model_settings(run->model)->dof)
        report_line(report,
                    "  L_vv has %zu negative eigenvalue%s of %zu: a mechanical system's have one "
                    "sign; train with another --activation, --seed or a smaller --lr",
                    m->negative_most, m->negative_most > 1 ? "s" : "",
                    hnn_model_settings(run->model)->dof);
    else if (m->condition > condition_most)
        report_line(report,
                    "  L_vv is nearly singular at training sample %zu: its accelerations are not "
                    "known; train longer, or with another --seed",
                    m->worst + 1);
}

/* The columns used, and the rows skipped. */
static void report_columns(const struct train_run *run, struct report *report)
{
    const struct hnn_dataset *d = &run->data;
    report_text(report, "coordinates", "coordinates", d->coordinates);
    const char *second = lagrangian(run) ? "velocities" : "momenta";
    report_text(report, second, second, d->momenta);
    report_text(report, "rates", *d->rate_names ? "rates" : NULL,
                *d->rate_names ? d->rate_names : NULL);
    if (!*d->rate_names)
        report_line(report, "  %-24s %s", "rates",
                    run->settings.rollout ? "none, rollouts" : "by differences over time");
    if (d->inputs) {
        report_text(report, "inputs", "inputs", d->input_names);
        report_count(report, "controls", d->controls ? "  controls, the last" : NULL, d->controls);
    }
    report_count(report, "trajectories", d->trials_by_time ? "trajectories by time" : NULL,
                 d->trials);
    report_count(report, "gaps", d->gaps ? "gaps in time" : NULL, d->gaps);
    report_count(report, "missing", d->missing ? "rows left out" : NULL, d->missing);
    if (d->gaps)
        report_line(report, "  a time step over three times the median is a gap");
    if (d->units_line)
        report_line(report, "  the line of units is skipped");
}

static void add_still(void *context, size_t k, double *sum)
{
    const struct train_run *run = context;
    const struct hnn_samples *s = &run->train;
    const struct hnn_dataset *d = &run->data;
    const size_t n = hnn_samples_held(s), states = 2 * d->dof, rollout = run->settings.rollout;
    const double *unit = rollout ? d->scale : d->rate;
    const bool moves = lagrangian(run) && !rollout;
    for (size_t r = 0; r < states * (rollout ? rollout : 1); r++) {
        double still = rollout               ? s->x[r % states * n + k]
                       : moves && r < d->dof ? s->x[(d->dof + r) * n + k]
                                             : 0;
        double away = s->target[r * n + k] - still;
        *sum += pow(run->options->normalise ? away / unit[r % states] : away, 2);
    }
}

/* The loss of a field that is 0 everywhere, of a Lagrangian model but for dq/dt = v: of samples
   whose targets are rates, or the states that follow. Units are those of the loss (train_loss.c).
   NaN for pixels. */
enum ad_status train_find_loss_of_zero(struct train_run *run, struct ad_error *error)
{
    size_t rows = 2 * run->data.dof * (run->settings.rollout ? run->settings.rollout : 1);
    run->loss_of_zero = (double)NAN;
    if (!run->pixels)
        hnn_samples_sum(run->options->common.ranks, &run->train, 1, add_still, run,
                        &run->loss_of_zero, error);
    run->loss_of_zero /= (double)(rows * run->train.n);
    return error->status;
}

static void report_loss(const struct train_run *run, struct report *report)
{
    double loss = hnn_trainer_train_loss(run->trainer), zero = run->loss_of_zero;
    report_number(report, "train_loss", "train loss", NULL, loss);
    if (!run->pixels)
        report_number(report, "zero_loss", "  of a field of 0", NULL, zero);
    report_number(report, "test_loss", "test loss", NULL, hnn_trainer_test_loss(run->trainer));
    if (loss >= 0.99 * zero)
        report_line(report, "  the model is no better than a field that is 0: try --normalise, "
                            "another --lr, or more --steps");
}

static void report_motion(const struct hnn_video_motion *m, struct report *report)
{
    report_text(report, "motion", "motion", hnn_motion_names[m->kind]);
    report_number(report, "latent_spread", "latent spread", NULL, m->mean.latent);
    report_number(report, "latent_spread_data", "  of the data", NULL, m->mean.latent_data);
    report_number(report, "frame_spread", "spread of frames", NULL, m->mean.frames);
    report_number(report, "frame_spread_data", "  of the data", NULL, m->mean.frames_data);
    report_number(report, "frame_energy", "energy of frames", NULL, m->energy);
    report_number(report, "frame_energy_data", "  of the data", NULL, m->energy_data);
    if (m->kind != HNN_MOTION_AS_DATA)
        report_line(report, "  the predicted frames do not move as the data do: train longer, on "
                            "more videos, or with another --seed");
}

void train_report(const struct train_run *run, struct report *report)
{
    hnn_trainer *trainer = run->trainer;
    report_line(report, "%s: %zu parameters, %zu step%s in %.3g s", train_model_name(run),
                hnn_model_size(run->model), hnn_trainer_step(trainer),
                hnn_trainer_step(trainer) == 1 ? "" : "s", hnn_trainer_seconds(trainer));
    if (hnn_trainer_steps_now(trainer))
        report_line(report, "  a step in %.3g ms", ms_per_step(run));
    report_text(report, "model", NULL, train_model_name(run));
    if (!run->pixels)
        report_columns(run, report);
    report_loss(run, report);
    report_count(report, "steps", NULL, hnn_trainer_step(trainer));
    report->passing = true;
    report_number(report, "seconds", NULL, "s", hnn_trainer_seconds(trainer));
    report_number(report, "ms_per_step", NULL, "ms", ms_per_step(run));
    report->passing = false;
    report_count(report, "parameters", NULL, hnn_model_size(run->model));
    report_count(report, "train_samples", "training samples", run->train.n);
    report_count(report, "test_samples", run->test.n ? "test samples" : NULL, run->test.n);
    if (lagrangian(run))
        report_mass(run, report);
    if (run->pixels)
        report_motion(&run->motion, report);
    report_text(report, "out", "model file", run->options->common.out);
}
