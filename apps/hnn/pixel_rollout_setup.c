/* Sets up the prediction of a video from the options (pixel_rollout.h). */
#include "autodiff/free.h"
#include "pixel_rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FRAMES = 300 };

static enum ad_status check_options(const struct rollout_options *o, struct ad_error *error)
{
    bool many = o->starts != OPTION_NO_COUNT, adds = !isnan(o->add_energy);
    const struct conflict rows[] = {
        {o->x0 || o->state || o->time_column || o->energy || !isnan(o->strength) ||
             !isnan(o->from) || o->skip_missing || o->skip_rows,
         "--x0, --state, --time-column, --from, --energy, --strength, --skip-missing and "
         "--skip-rows "
         "are not for models of pixels"},
        {!o->truth, "missing --truth: pixels, or frames to start from (HDF5 or a folder)"},
        {o->inputs || o->interpolation || o->fix.n,
         "--inputs, --fix and --interpolation: a model of pixels has no inputs"},
        {o->points != OPTION_NO_COUNT, "--points: a model of pixels gives every frame; --time N"},
        {!isnan(o->time) && !(o->time >= 2 && o->time <= 1e6 && o->time == floor(o->time)),
         "--time: expected a number of frames, 2 to 1e6"},
        {adds != !isnan(o->at), "--add-energy DE and --at T: expected both or none"},
        {many &&
             (adds || o->reverse || o->trial || o->common.out || o->common.csv || o->common.plot),
         "--starts: expected no --trial, --reverse, --add-energy, --out, --csv or --plot"},
    };
    return options_conflicts(sizeof rows / sizeof *rows, rows, error);
}

/* ---- starts ---- */

/* Three frames a trajectory, of which two are seen: the rest of the motion follows from the start
   (pixel_rollout_run.c). Size and filter are those which the model was trained on. */
static enum ad_status render_starts(struct pixel_rollout *rollout, struct ad_error *error)
{
    const struct rollout_options *o = rollout->options;
    struct hnn_video_settings settings = hnn_video_published();
    const char *size = hnn_model_noted(rollout->model[0].model, "frame");
    const char *filter = hnn_model_noted(rollout->model[0].model, "filter");
    settings.trajectories = option_count_or(o->starts, 1);
    settings.frames = 3;
    if (size)
        sscanf(size, "%zu x %zu", &settings.height, &settings.width);
    if (filter && hnn_filter_find(filter, &settings.rod.filter, error) != AD_OK)
        return error->status;
    return hnn_rod_video(&settings, o->common.seed, &rollout->source, error);
}

/* --trial: a number from 1. */
static enum ad_status choose_trajectory(struct pixel_rollout *rollout, struct ad_error *error)
{
    const char *text = rollout->options->trial;
    double number = 1, last = (double)rollout->source.trajectories;
    if (text && !(options_number(text, &number) && number >= 1 && number <= last &&
                  number == floor(number)))
        return ad_fail(error, AD_E_ARGUMENT, "--trial: expected a trajectory, 1 to %g, got '%s'",
                       last, text);
    rollout->trajectory = (size_t)number - 1;
    return AD_OK;
}

static enum ad_status find_source(struct pixel_rollout *rollout, struct ad_error *error)
{
    const struct rollout_options *o = rollout->options;
    const struct hnn_frames *f = &rollout->source;
    size_t pixels = hnn_model_settings(rollout->model[0].model)->pixels;
    if ((strcmp(o->truth, "pixels") == 0
             ? render_starts(rollout, error)
             : hnn_frames_read(o->truth, &rollout->source, error)) != AD_OK)
        return error->status;
    if (2 * f->height * f->width != pixels)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--truth %s: two frames of %zu x %zu are %zu pixels, the model has %zu",
                       o->truth, f->height, f->width, 2 * f->height * f->width, pixels);
    if (o->starts != OPTION_NO_COUNT && o->starts > f->trajectories)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--starts: expected at most the %zu trajectories of %s, got %zu",
                       f->trajectories, o->truth, o->starts);
    if (o->starts != OPTION_NO_COUNT && !(f->has_rod && f->angle))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--starts: nothing to measure in %s: the rod, its "
                       "angle and its speed are not known",
                       o->truth);
    return choose_trajectory(rollout, error);
}

/* ---- outputs and steps ---- */

static enum ad_status choose_outputs(struct pixel_rollout *rollout, struct ad_error *error)
{
    const struct rollout_options *o = rollout->options;
    struct hnn_rollout_settings *s = &rollout->settings;
    size_t area = rollout->source.height * rollout->source.width;
    s->n = (isnan(o->time) ? FRAMES : (size_t)o->time) + 1;
    s->t = rollout->t = malloc(s->n * sizeof *rollout->t);
    rollout->truth.name = "truth";
    rollout->truth.pixels = malloc(s->n * area * sizeof *rollout->truth.pixels);
    rollout->truth.energy = malloc(s->n * sizeof *rollout->truth.energy);
    bool room = rollout->t && rollout->truth.pixels && rollout->truth.energy;
    for (size_t k = 0; k < rollout->n_models && room; k++) {
        struct rollout_model *m = &rollout->model[k];
        m->strip.name = rollout_name(m);
        m->strip.n = s->n;
        m->strip.pixels = malloc(s->n * area * sizeof *m->strip.pixels);
        m->strip.energy = malloc(s->n * sizeof *m->strip.energy);
        room = m->strip.pixels && m->strip.energy;
    }
    if (!room)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu frames", s->n);
    hnn_times(0, (double)(s->n - 1), s->n, rollout->t);
    return AD_OK;
}

enum ad_status pixel_rollout_setup(const struct rollout_options *options, hnn_model *model,
                                   struct pixel_rollout *rollout, struct ad_error *error)
{
    *rollout = (struct pixel_rollout){.options = options, .true_energy = NAN};
    if (rollout_add_model(rollout->model, &rollout->n_models, options->common.argument[0], model,
                          error) != AD_OK ||
        check_options(options, error) != AD_OK ||
        rollout_steps(options, &rollout->settings, error) != AD_OK ||
        (options->against && rollout_add_model(rollout->model, &rollout->n_models, options->against,
                                               NULL, error) != AD_OK) ||
        find_source(rollout, error) != AD_OK)
        return error->status;
    return choose_outputs(rollout, error);
}

void pixel_rollout_free(struct pixel_rollout *rollout)
{
    rollout_free_models(rollout->n_models, rollout->model);
    AD_FREE(rollout->truth.pixels, rollout->truth.energy);
    hnn_frames_free(&rollout->source);
    free(rollout->t);
}
