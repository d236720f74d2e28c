/* Sets up the prediction of a film from the options (pixel_rollout.h). */
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
static enum ad_status film_starts(struct film *film, struct ad_error *error)
{
    const struct rollout_options *o = film->options;
    struct hnn_filming filming = hnn_filming_published();
    const char *size = hnn_model_noted(film->model[0].model, "frame");
    const char *filter = hnn_model_noted(film->model[0].model, "filter");
    filming.trajectories = option_count_or(o->starts, 1);
    filming.frames = 3;
    if (size)
        sscanf(size, "%zu x %zu", &filming.height, &filming.width);
    if (filter && hnn_filter_find(filter, &filming.rod.filter, error) != AD_OK)
        return error->status;
    return hnn_rod_film(&filming, o->common.seed, &film->source, error);
}

/* --trial: a number from 1. */
static enum ad_status choose_trajectory(struct film *film, struct ad_error *error)
{
    const char *text = film->options->trial;
    double number = 1, last = (double)film->source.trajectories;
    if (text && !(options_number(text, &number) && number >= 1 && number <= last &&
                  number == floor(number)))
        return ad_fail(error, AD_E_ARGUMENT, "--trial: expected a trajectory, 1 to %g, got '%s'",
                       last, text);
    film->trajectory = (size_t)number - 1;
    return AD_OK;
}

static enum ad_status find_source(struct film *film, struct ad_error *error)
{
    const struct rollout_options *o = film->options;
    const struct hnn_frames *f = &film->source;
    size_t pixels = hnn_model_settings(film->model[0].model)->pixels;
    if ((strcmp(o->truth, "pixels") == 0
             ? film_starts(film, error)
             : hnn_frames_read(o->truth, &film->source, error)) != AD_OK)
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
    return choose_trajectory(film, error);
}

/* ---- outputs and steps ---- */

static enum ad_status choose_outputs(struct film *film, struct ad_error *error)
{
    const struct rollout_options *o = film->options;
    struct hnn_rollout_settings *s = &film->settings;
    size_t area = film->source.height * film->source.width;
    s->n = (isnan(o->time) ? FRAMES : (size_t)o->time) + 1;
    s->t = film->t = malloc(s->n * sizeof *film->t);
    film->truth.name = "truth";
    film->truth.pixels = malloc(s->n * area * sizeof *film->truth.pixels);
    film->truth.energy = malloc(s->n * sizeof *film->truth.energy);
    bool room = film->t && film->truth.pixels && film->truth.energy;
    for (size_t k = 0; k < film->n_models && room; k++) {
        struct rollout_model *m = &film->model[k];
        m->strip.name = rollout_name(m);
        m->strip.n = s->n;
        m->strip.pixels = malloc(s->n * area * sizeof *m->strip.pixels);
        m->strip.energy = malloc(s->n * sizeof *m->strip.energy);
        room = m->strip.pixels && m->strip.energy;
    }
    if (!room)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu frames", s->n);
    hnn_times(0, (double)(s->n - 1), s->n, film->t);
    return AD_OK;
}

enum ad_status film_setup(const struct rollout_options *options, hnn_model *model,
                          struct film *film, struct ad_error *error)
{
    *film = (struct film){.options = options, .true_energy = NAN};
    if (rollout_add_model(film->model, &film->n_models, options->common.argument[0], model,
                          error) != AD_OK ||
        check_options(options, error) != AD_OK ||
        rollout_steps(options, &film->settings, error) != AD_OK ||
        (options->against &&
         rollout_add_model(film->model, &film->n_models, options->against, NULL, error) != AD_OK) ||
        find_source(film, error) != AD_OK)
        return error->status;
    return choose_outputs(film, error);
}

void film_free(struct film *film)
{
    rollout_free_models(film->n_models, film->model);
    AD_FREE(film->truth.pixels, film->truth.energy);
    hnn_frames_free(&film->source);
    free(film->t);
}
