/* Prediction of frames by a model of pixels: an observation is encoded, its latent state follows
   the model's field, and the result is decoded.

       hnn_times(0, 300, 301, t);
       hnn_pixels_predict(model, pair, &(struct hnn_rollout_settings){.size = sizeof(struct
   hnn_rollout_settings), .n = 301, .t = t}, 784, &path, frames, &info, &error);

   Time is counted in frames, as in the loss.

   Latent states have units of their own. Errors: AD_E_ARGUMENT, AD_E_MEMORY, those of hnn.h.
   Threads: as in hnn.h. */
#ifndef HNN_PIXELS_LATENT_H
#define HNN_PIXELS_LATENT_H

#include "hnn/rollout/rollout.h"
#include "pixels.h"

AD_HEADER_BEGIN

/* Predicts the motion from an observation [pixels of the model]. `path` is the latent motion, for
   hnn_path_free, empty on failure; frames [settings->n x frame] are the first `frame` pixels of the
   decoded observations at its times; info may be NULL. All settings are used, including added
   energy. AD_E_ARGUMENT for a model of states, or a frame larger than its observations. */
enum ad_status hnn_pixels_predict(hnn_model *model, const float *observation,
                                  const struct hnn_rollout_settings *settings, size_t frame,
                                  struct hnn_path *path, float *frames,
                                  struct hnn_rollout_info *info, struct ad_error *error);
/* The latent state x0 [2n] of an observation; and the frames of a known path. */
enum ad_status hnn_observe(const hnn_model *model, const float *observation, double *x0,
                           struct ad_error *error);
enum ad_status hnn_show(const hnn_model *model, const struct hnn_path *path, size_t frame,
                        float *frames, struct ad_error *error);

/* ---- kind of motion ---- */

enum hnn_motion_kind { HNN_MOTION_AS_DATA, HNN_MOTION_STANDS, HNN_MOTION_RUNS_AWAY };
extern const char *const hnn_motion_names[]; /* NULL-terminated, in that order */

/* Sizes of a motion beside those of the observed one, latent and in pixels: root mean squares of
   the deviations from the mean over time. */
struct hnn_latent_motion {
    double latent, latent_data, frames, frames_data;
    /* Stands: below a fifth of the data's size, latent or in pixels. Runs away: the latent size is
       over three times the data's, or the latent state is a width of the training range outside of
       it. */
    enum hnn_motion_kind kind;
};
/* Classifies a latent path and its predicted frames beside n observed frames [n x frame] from the
   same start; both have one output per frame. */
enum ad_status hnn_latent_motion(const hnn_model *model, size_t n, size_t frame,
                                 const float *frames, const struct hnn_path *path,
                                 const float *foreseen, struct hnn_latent_motion *motion,
                                 struct ad_error *error);

/* Motion of a model of pixels along its training videos: means over `videos` of them, and the worst
   verdict. */
struct hnn_video_motion {
    struct hnn_latent_motion mean;
    enum hnn_motion_kind kind;
    double energy, energy_data; /* that frames show of a rod; NaN: not known */
    size_t videos;
};
/* Follows the model from the beginning of up to four trajectories with training pairs, over their
   length. A motion that diverges counts as running away, and not in the means. */
enum ad_status hnn_video_motion(hnn_model *model, const struct hnn_frames *frames,
                                const struct hnn_split_pairs *pairs,
                                struct hnn_video_motion *motion, struct ad_error *error);

AD_HEADER_END
#endif
