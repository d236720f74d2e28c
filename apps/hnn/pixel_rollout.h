/* `leastaction rollout` for models of pixels: prediction from the first two frames of a film,
   compared with the film. Time is counted in frames. */
#ifndef APPS_HNN_PIXEL_ROLLOUT_H
#define APPS_HNN_PIXEL_ROLLOUT_H

#include "apps/output/outputs.h"
#include "rollout.h"
#include "hnn/pixels/pixel_energy.h"

struct film {
    const struct rollout_options *options;
    struct hnn_rollout_settings settings;
    double *t;                /* [settings.n] 0, 1, 2 ... frames */
    struct hnn_frames source; /* starts */
    size_t trajectory;        /* of the source, the first one */
    struct film_strip truth;  /* of a source without a rod it may be shorter */
    double true_energy;       /* NaN: not known */
    size_t n_models;
    struct rollout_model model[ROLLOUT_MODELS];
};

/* Models, starts, outputs; takes `model`. Ends with film_free, whatever it returned. */
enum ad_status film_setup(const struct rollout_options *options, hnn_model *model,
                          struct film *film, struct ad_error *error);
void film_free(struct film *film);
/* Of a struct film: from one start, or means over many; and what is written of it. The CSV has a
   row a frame: number, energies, latent states. */
enum ad_status film_run(void *film, struct ad_error *error);
extern const struct output_kind film_outputs;

enum ad_status film_picture(const void *film, struct plot *plot, struct ad_error *error);

#endif
