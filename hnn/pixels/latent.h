/* Frames foreseen by a model of pixels: an observation is encoded, its latent state moves along the
   model's field, and what it becomes is decoded.

       hnn_times(0, 300, 301, t);
       hnn_pixels_predict(model, pair, &(struct hnn_rollout_settings){.n = 301, .t = t}, 784, &path,
   frames, &info, &error);

   Time is counted in frames, as in the loss. */
#ifndef HNN_LATENT_H
#define HNN_LATENT_H

#include "hnn/rollout/rollout.h"
#include "pixels.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* Follows the motion from an observation [pixels of the model]. `path` is the latent one, to be
   freed by hnn_path_free, also on failure, when it is empty; frames [settings->n x frame] are the
   first `frame` pixels of what is decoded at its times; info may be NULL. Of the settings all are
   used, energy in mid-flight too. AD_E_ARGUMENT: a model of states, or a frame larger than its
   observations. */
enum ad_status hnn_pixels_predict(hnn_model *model, const float *observation,
                                  const struct hnn_rollout_settings *settings, size_t frame,
                                  struct hnn_path *path, float *frames,
                                  struct hnn_rollout_info *info, struct ad_error *error);
/* Only the latent states x0 [2n] of an observation; and frames of a path that is known. */
enum ad_status hnn_observe(const hnn_model *model, const float *observation, double *x0,
                           struct ad_error *error);
enum ad_status hnn_show(const hnn_model *model, const struct hnn_path *path, size_t frame,
                        float *frames, struct ad_error *error);

/* ---- does it move? ---- */

enum hnn_motion_kind { HNN_MOTION_AS_DATA, HNN_MOTION_STANDS, HNN_MOTION_RUNS_AWAY };
extern const char *const hnn_motion_names[]; /* NULL-terminated, in that order */

/* Sizes of a motion, root mean squares of the changes about the mean in time, beside those of what
   was observed: of the latent state, and of the pixels. */
struct hnn_latent_motion {
    double latent, latent_data, frames, frames_data;
    /* Stands: less than a fifth of the data's, latent or in pixels. Runs away: the latent motion is
       over three times the data's, or a width of the range of training outside of it. */
    enum hnn_motion_kind kind;
};
/* Of a latent path and the frames foreseen along it, beside n observed frames [n x frame] that
   begin where it does; both have an output a frame. */
enum ad_status hnn_latent_motion(const hnn_model *model, size_t n, size_t frame,
                                 const float *frames, const struct hnn_path *path,
                                 const float *foreseen, struct hnn_latent_motion *motion,
                                 struct ad_error *error);

/* How a model of pixels moves along films it was trained on: means over `films` of them, and the
   worst verdict. */
struct hnn_film_motion {
    struct hnn_latent_motion mean;
    enum hnn_motion_kind kind;
    double energy, energy_data; /* that frames show of a rod; NaN: not known */
    size_t films;
};
/* Follows the model from the beginning of up to four trajectories with pairs to train on, for as
   long as they are. A motion that explodes is one that runs away, and not in the means. */
enum ad_status hnn_film_motion(hnn_model *model, const struct hnn_frames *frames,
                               const struct hnn_split_pairs *pairs, struct hnn_film_motion *motion,
                               struct ad_error *error);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
