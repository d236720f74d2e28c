/* `leastaction rollout` for models of pixels: prediction from the first two frames of a video,
   compared with the video. Time is counted in frames. */
#ifndef APPS_HNN_PIXEL_ROLLOUT_H
#define APPS_HNN_PIXEL_ROLLOUT_H

#include "apps/output/outputs.h"
#include "rollout.h"
#include "hnn/pixels/pixel_energy.h"

struct pixel_rollout {
    const struct rollout_options *options;
    struct hnn_rollout_settings settings;
    double *t;                /* [settings.n] 0, 1, 2 ... frames */
    struct hnn_frames source; /* starts */
    size_t trajectory;        /* of the source, the first one */
    struct frame_strip truth; /* of a source without a rod it may be shorter */
    double true_energy;       /* NaN: not known */
    size_t n_models;
    struct rollout_model model[ROLLOUT_MODELS];
};

/* Models, starts, outputs; takes `model`. Ends with pixel_rollout_free, whatever it returned. */
enum ad_status pixel_rollout_setup(const struct rollout_options *options, hnn_model *model,
                                   struct pixel_rollout *rollout, struct ad_error *error);
void pixel_rollout_free(struct pixel_rollout *rollout);
/* Of a struct pixel_rollout: from one start, or means over many; and what is written of it. The CSV
   has a row a frame: number, energies, latent states. */
enum ad_status pixel_rollout_run(void *rollout, struct ad_error *error);
extern const struct output_kind pixel_rollout_outputs;

enum ad_status pixel_rollout_picture(const void *rollout, struct plot *plot,
                                     struct ad_error *error);

#endif
