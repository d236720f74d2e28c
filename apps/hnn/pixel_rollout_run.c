/* Predicts videos from one start or many, and measures their errors (pixel_rollout.h). */
#include "pixel_rollout.h"

#include <math.h>

static void look_at_motion(const struct pixel_rollout *rollout, struct rollout_model *m,
                           struct ad_error *error)
{
    enum hnn_motion_kind before = m->motion.kind;
    hnn_latent_motion(m->model, rollout->truth.n, rollout->source.height * rollout->source.width,
                      rollout->truth.pixels, &m->path, m->strip.pixels, &m->motion, error);
    if (before > m->motion.kind)
        m->motion.kind = before;
}

static void measure_video(const struct pixel_rollout *rollout, struct rollout_model *m,
                          struct ad_error *error)
{
    const struct hnn_rollout_settings *s = &rollout->settings;
    m->outside = hnn_path_outside(m->model, &m->path, m->what, sizeof m->what);
    m->conserved_drift = hnn_energy_drift(&m->ode, &m->path, s);
    if (s->add != 0) { /* the speed at a frame is that between the frames before and after it */
        m->energy_before =
            hnn_video_energy_mean(s->n, m->strip.energy, 0, (size_t)fmax(s->add_at, 0), 0, 1);
        m->energy_after =
            hnn_video_energy_mean(s->n, m->strip.energy, (size_t)s->add_at + 2, s->n, 0, 1);
        return;
    }
    look_at_motion(rollout, m, error);
    m->coordinate_mse =
        hnn_video_mse(rollout->truth.n, rollout->source.height * rollout->source.width,
                      m->strip.pixels, rollout->truth.pixels);
    m->energy_mse = hnn_video_energy_mean(s->n, m->strip.energy, 0, s->n, rollout->true_energy, 2);
}

static enum ad_status foresee(const struct pixel_rollout *rollout, struct rollout_model *m,
                              size_t trajectory, struct ad_error *error)
{
    const struct hnn_frames *f = &rollout->source;
    size_t area = f->height * f->width;
    hnn_path_free(&m->path);
    hnn_pixels_predict(m->model, hnn_frames_pair(f, trajectory * f->frames), &rollout->settings,
                       area, &m->path, m->strip.pixels, &m->info, error);
    return rollout_name_cause(m->file, error);
}

static enum ad_status foresee_one_start(struct pixel_rollout *rollout, size_t trajectory,
                                        struct ad_error *error)
{
    const struct hnn_frames *f = &rollout->source;
    struct frame_strip *truth = &rollout->truth;
    truth->n =
        hnn_video_begin(f, trajectory, rollout->settings.n, truth->pixels, &rollout->true_energy);
    hnn_video_energies(f, truth->n, truth->pixels, truth->energy, error);
    for (size_t k = 0; k < rollout->n_models && error->status == AD_OK; k++) {
        struct rollout_model *m = &rollout->model[k];
        if (foresee(rollout, m, trajectory, error) == AD_OK &&
            hnn_video_energies(f, m->strip.n, m->strip.pixels, m->strip.energy, error) == AD_OK)
            measure_video(rollout, m, error);
    }
    return error->status;
}

/* Adds the errors of one start, times a weight, to the sums. */
static void accumulate(struct rollout_model *sum, const struct rollout_model *one, double weight)
{
    sum->energy_mse += weight * one->energy_mse;
    sum->coordinate_mse += weight * one->coordinate_mse;
    sum->conserved_drift += weight * one->conserved_drift;
    sum->info.evaluations += one->info.evaluations;
    sum->info.seconds += one->info.seconds;
}

enum ad_status pixel_rollout_run(void *context, struct ad_error *error)
{
    struct pixel_rollout *rollout = context;
    size_t starts = option_count_or(rollout->options->starts, 1);
    struct rollout_model mean_of[ROLLOUT_MODELS] = {0};
    for (size_t i = 0;
         i < starts && foresee_one_start(rollout, rollout->trajectory + i, error) == AD_OK; i++)
        for (size_t k = 0; k < rollout->n_models; k++)
            accumulate(&mean_of[k], &rollout->model[k], 1 / (double)starts);
    for (size_t k = 0; k < rollout->n_models && starts > 1; k++) {
        struct rollout_model *m = &rollout->model[k];
        m->energy_mse = m->coordinate_mse = m->conserved_drift = 0;
        m->info = (struct hnn_rollout_info){.reversal_error = NAN};
        accumulate(m, &mean_of[k], 1);
    }
    return error->status;
}
