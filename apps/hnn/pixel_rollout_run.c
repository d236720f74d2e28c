/* Films foreseen from one start or many, and their errors (pixel_rollout.h). */
#include "pixel_rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *film_model_name(const struct film_model *model)
{
    return hnn_kinds[hnn_model_settings(model->model)->kind];
}

/* ---- energy ---- */

static enum ad_status measure_energy(const struct film *film, struct film_strip *strip,
                                     double *angle, struct ad_error *error)
{
    const struct hnn_frames *f = &film->source;
    for (size_t k = 0; k < strip->n; k++)
        strip->energy[k] = NAN;
    if (!f->has_rod || strip->n < 3)
        return AD_OK;
    if (hnn_rod_angles(&f->rod, f->height, f->width, strip->n, strip->pixels, angle, error) ==
        AD_OK)
        hnn_rod_energies(&f->rod, strip->n, angle, strip->energy + 1);
    return error->status;
}

/* Mean of (E - less)^power over frames first ... end-1 that have an energy, both ends of the film
   having none. */
static double mean_energy(const struct film_strip *strip, size_t first, size_t end, double less,
                          int power)
{
    double sum = 0;
    size_t n = 0;
    first = first > 1 ? first : 1;
    end = end < strip->n ? end : strip->n - 1;
    for (size_t k = first; k < end; k++, n++)
        sum += pow(strip->energy[k] - less, power);
    return n ? sum / (double)n : NAN;
}

/* ---- truth ---- */

/* The frames of the film; where the start is known, as many as are foreseen. */
static void draw_truth(struct film *film, size_t trajectory)
{
    const struct hnn_frames *f = &film->source;
    size_t area = f->height * f->width, first = trajectory * f->frames;
    struct film_strip *truth = &film->truth;
    bool known = f->has_rod && f->angle;
    truth->n = known || film->settings.n < f->frames ? film->settings.n : f->frames;
    if (!known) {
        memcpy(truth->pixels, f->pixels + first * area, truth->n * area * sizeof *truth->pixels);
        return;
    }
    double angle = f->angle[first], speed = f->speed[first];
    film->true_energy = hnn_rod_energy(&f->rod, angle, speed);
    for (size_t k = 0; k < truth->n; k++, hnn_rod_step(&f->rod, &angle, &speed))
        hnn_rod_draw(&f->rod, angle, f->height, f->width, truth->pixels + k * area);
}

/* ---- models ---- */

static double pixel_mse(const struct film *film, const struct film_strip *strip)
{
    size_t area = film->source.height * film->source.width, n = film->truth.n * area;
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += pow((double)strip->pixels[k] - film->truth.pixels[k], 2);
    return sum / (double)n;
}

static void look_at_motion(const struct film *film, struct film_model *m, struct ad_error *error)
{
    enum hnn_motion_kind before = m->motion.kind;
    hnn_latent_motion(m->model, film->truth.n, film->source.height * film->source.width,
                      film->truth.pixels, &m->path, m->strip.pixels, &m->motion, error);
    if (before > m->motion.kind)
        m->motion.kind = before;
}

static void measure_film(const struct film *film, struct film_model *m, struct ad_error *error)
{
    const struct hnn_rollout_settings *s = &film->settings;
    m->outside = hnn_path_outside(m->model, &m->path, m->what, sizeof m->what);
    m->conserved_drift = hnn_energy_drift(&m->ode, &m->path, s);
    if (s->add != 0) { /* the speed at a frame is that between the frames before and after it */
        m->energy_before = mean_energy(&m->strip, 0, (size_t)fmax(s->add_at, 0), 0, 1);
        m->energy_after = mean_energy(&m->strip, (size_t)s->add_at + 2, s->n, 0, 1);
        return;
    }
    look_at_motion(film, m, error);
    m->pixel_mse = pixel_mse(film, &m->strip);
    m->energy_mse = mean_energy(&m->strip, 0, s->n, film->true_energy, 2);
}

static enum ad_status foresee(const struct film *film, struct film_model *m, size_t trajectory,
                              struct ad_error *error)
{
    const struct hnn_frames *f = &film->source;
    size_t area = f->height * f->width;
    hnn_path_free(&m->path);
    hnn_foresee(m->model, hnn_frames_pair(f, trajectory * f->frames), &film->settings, area,
                &m->path, m->strip.pixels, &m->info, error);
    if (error->status != AD_OK) {
        struct ad_error cause = *error;
        *error = (struct ad_error){0};
        return ad_fail(error, cause.status, "%s: %.300s", m->file, cause.message);
    }
    return AD_OK;
}

static enum ad_status foresee_one_start(struct film *film, size_t trajectory, double *angle,
                                        struct ad_error *error)
{
    draw_truth(film, trajectory);
    measure_energy(film, &film->truth, angle, error);
    for (size_t k = 0; k < film->n_models && error->status == AD_OK; k++) {
        struct film_model *m = &film->model[k];
        if (foresee(film, m, trajectory, error) == AD_OK &&
            measure_energy(film, &m->strip, angle, error) == AD_OK)
            measure_film(film, m, error);
    }
    return error->status;
}

/* Sums of one start to means of them all, and back. */
static void accumulate(struct film_model *sum, const struct film_model *one, double weight)
{
    sum->energy_mse += weight * one->energy_mse;
    sum->pixel_mse += weight * one->pixel_mse;
    sum->conserved_drift += weight * one->conserved_drift;
    sum->info.evaluations += one->info.evaluations;
    sum->info.seconds += one->info.seconds;
}

enum ad_status film_run(void *context, struct ad_error *error)
{
    struct film *film = context;
    size_t starts = option_count_or(film->options->starts, 1);
    struct film_model mean_of[ROLLOUT_MODELS] = {0};
    double *angle = malloc(film->settings.n * sizeof *angle);
    if (!angle)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0;
         i < starts && foresee_one_start(film, film->trajectory + i, angle, error) == AD_OK; i++)
        for (size_t k = 0; k < film->n_models; k++)
            accumulate(&mean_of[k], &film->model[k], 1 / (double)starts);
    for (size_t k = 0; k < film->n_models && starts > 1; k++) {
        struct film_model *m = &film->model[k];
        m->energy_mse = m->pixel_mse = m->conserved_drift = 0;
        m->info = (struct hnn_rollout_info){.reversal_error = NAN};
        accumulate(m, &mean_of[k], 1);
    }
    free(angle);
    return error->status;
}
