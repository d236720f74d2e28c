/* Classifies the motion of a model of pixels beside the observed one: moves, stands, runs away
   (latent.h). */
#include "latent.h"
#include "hnn/model/internal.h"

#include <math.h>
#include <stdlib.h>

const char *const hnn_motion_names[] = {"as the data", "stands still", "runs away", NULL};

/* Relative to the size of the data's motion: less is a standstill; more, or this many widths of the
   range of training beyond it, is running away. */
static const double least = 0.2, most = 3, widths = 1;

/* Root mean square of the changes about the mean, over n samples of `size` components; element k of
   sample i is at(values, i, k). */
static double spread(size_t n, size_t size, const void *values,
                     double (*at)(const void *values, size_t i, size_t k, size_t size))
{
    double sum = 0;
    for (size_t k = 0; k < size; k++) {
        double mean = 0;
        for (size_t i = 0; i < n; i++)
            mean += at(values, i, k, size) / (double)n;
        for (size_t i = 0; i < n; i++)
            sum += pow(at(values, i, k, size) - mean, 2);
    }
    return sqrt(sum / (double)(n * size));
}

static double of_frames(const void *values, size_t i, size_t k, size_t size)
{
    return (double)((const float *)values)[i * size + k];
}

static double of_states(const void *values, size_t i, size_t k, size_t size)
{
    return ((const double *)values)[i * size + k];
}

/* The latent states of all pairs of n frames, one after the other. */
static enum ad_status observe_all(const hnn_model *model, size_t samples, size_t frame,
                                  const float *frames, double *x, struct ad_error *error)
{
    size_t pixels = model->settings.pixels, states = hnn_states(model);
    double *seen = malloc(samples * (pixels + states) * sizeof *seen);
    if (!seen)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu observations", samples);
    double *columns = seen + samples * pixels;
    for (size_t i = 0; i < samples; i++)
        hnn_to_double(AD_F32, pixels, frames + i * frame, seen + i * pixels);
    if (hnn_model_encode(model, samples, seen, columns, error) == AD_OK)
        for (size_t i = 0; i < samples; i++)
            for (size_t k = 0; k < states; k++)
                x[i * states + k] = columns[k * samples + i];
    free(seen);
    return error->status;
}

/* How far the path is beyond the range of training, in widths of it. */
static double excess(const hnn_model *model, const struct hnn_path *path, size_t n)
{
    const struct hnn_range seen = hnn_model_range(model);
    double largest = 0;
    for (size_t i = 0; i < n && seen.low; i++)
        for (size_t k = 0; k < path->states; k++) {
            double x = path->x[i * path->states + k], width = seen.high[k] - seen.low[k];
            largest = fmax(largest, fmax(seen.low[k] - x, x - seen.high[k]) / width);
        }
    return largest;
}

static enum hnn_motion_kind judge(const struct hnn_latent_motion *m, double beyond)
{
    if (!isfinite(m->latent) || !isfinite(m->frames) || m->latent > most * m->latent_data ||
        beyond > widths)
        return HNN_MOTION_RUNS_AWAY;
    return m->latent < least * m->latent_data || m->frames < least * m->frames_data
               ? HNN_MOTION_STANDS
               : HNN_MOTION_AS_DATA;
}

enum ad_status hnn_latent_motion(const hnn_model *model, size_t n, size_t frame,
                                 const float *frames, const struct hnn_path *path,
                                 const float *foreseen, struct hnn_latent_motion *motion,
                                 struct ad_error *error)
{
    if (AD_LACKS(error, model, frames, path, foreseen, motion))
        return error->status;
    size_t pixels = model->settings.pixels, pair = frame ? pixels / frame : 0;
    if (!pair || path->states != hnn_states(model) || n < pair + 1 || path->n + pair < n + 1)
        return ad_fail(error, AD_E_ARGUMENT,
                       "motion beside %zu frames of %zu pixels: expected a model that sees whole "
                       "frames, fewer at once, and a path as long",
                       n, frame);
    size_t samples = n + 1 - pair;
    double *x = malloc(samples * path->states * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu states", samples);
    if (observe_all(model, samples, frame, frames, x, error) == AD_OK) {
        *motion =
            (struct hnn_latent_motion){.latent = spread(samples, path->states, path->x, of_states),
                                       .latent_data = spread(samples, path->states, x, of_states),
                                       .frames = spread(samples, frame, foreseen, of_frames),
                                       .frames_data = spread(samples, frame, frames, of_frames)};
        motion->kind = judge(motion, excess(model, path, samples));
    }
    free(x);
    return error->status;
}
