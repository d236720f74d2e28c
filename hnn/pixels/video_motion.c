/* Compares the motion of a model of pixels with the videos it was trained on (latent.h). */
#include "autodiff/free.h"
#include "frames.h"
#include "latent.h"
#include "hnn/model/internal.h"
#include "pixel_energy.h"

#include <math.h>
#include <stdlib.h>

enum { VIDEOS = 4 };

/* Mean energy of the rod in n frames; NaN if unknown. */
static double mean_energy(const struct hnn_frames *f, size_t n, const float *pixels, double *energy,
                          struct ad_error *error)
{
    hnn_video_energies(f, n, pixels, energy, error);
    return hnn_video_energy_mean(n, energy, 0, n, 0, 1);
}

/* A field that explodes on the way is one that runs away. */
static enum ad_status follow_video(hnn_model *model, const struct hnn_frames *f, size_t first,
                                   float *foreseen, double *work, struct hnn_video_motion *m,
                                   struct ad_error *error)
{
    size_t n = f->frames - 1, frame = f->height * f->width;
    const float *frames = hnn_frames_pair(f, first);
    struct hnn_path path = {0};
    struct hnn_latent_motion motion;
    struct ad_error exploded = {0};
    hnn_times(0, (double)(n - 1), n, work);
    enum ad_status status =
        hnn_pixels_predict(model, frames,
                           &(struct hnn_rollout_settings){
                               .size = sizeof(struct hnn_rollout_settings), .n = n, .t = work},
                           frame, &path, foreseen, NULL, &exploded);
    if (status == AD_E_NONFINITE || status == AD_E_ACCURACY) {
        m->kind = HNN_MOTION_RUNS_AWAY;
    } else if (status != AD_OK) {
        ad_fail(error, status, "%s", exploded.message);
    } else if (hnn_latent_motion(model, f->frames, frame, frames, &path, foreseen, &motion,
                                 error) == AD_OK) {
        m->kind = motion.kind > m->kind ? motion.kind : m->kind;
        m->mean.latent += motion.latent;
        m->mean.latent_data += motion.latent_data;
        m->mean.frames += motion.frames;
        m->mean.frames_data += motion.frames_data;
        m->energy += mean_energy(f, n, foreseen, work, error);
        m->energy_data += mean_energy(f, n, frames, work, error);
        m->videos++;
    }
    hnn_path_free(&path);
    return error->status;
}

static void sums_to_means(struct hnn_video_motion *m)
{
    double *sum[] = {&m->mean.latent,      &m->mean.latent_data, &m->mean.frames,
                     &m->mean.frames_data, &m->energy,           &m->energy_data};
    for (size_t k = 0; k < sizeof sum / sizeof *sum; k++)
        *sum[k] = m->videos ? *sum[k] / (double)m->videos : (double)NAN;
}

size_t hnn_video_followed(const struct hnn_frames *f, const struct hnn_split_pairs *pairs, size_t k)
{
    size_t each = f->frames - 2, videos = pairs->n_train / each;
    size_t stride = videos > VIDEOS ? videos / VIDEOS : 1;
    return k < VIDEOS && k * stride < videos ? pairs->train[k * stride * each] : SIZE_MAX;
}

enum ad_status hnn_video_motion(hnn_model *model, const struct hnn_frames *f,
                                const struct hnn_split_pairs *pairs,
                                struct hnn_video_motion *motion, struct ad_error *error)
{
    if (AD_LACKS(error, model, f, pairs, motion))
        return error->status;
    if (f->frames < 3)
        return ad_fail(error, AD_E_ARGUMENT, "%s: %zu frames; expected 3 or more", __func__,
                       f->frames);
    const size_t n = f->frames - 1;
    *motion = (struct hnn_video_motion){0};
    float *foreseen = malloc(n * f->height * f->width * sizeof *foreseen);
    double *work = malloc(n * sizeof *work);
    if (!foreseen || !work)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu frames", n);
    for (size_t k = 0, pair;
         error->status == AD_OK && (pair = hnn_video_followed(f, pairs, k)) != SIZE_MAX; k++)
        follow_video(model, f, pair, foreseen, work, motion, error);
    sums_to_means(motion);
    AD_FREE(foreseen, work);
    return error->status;
}
