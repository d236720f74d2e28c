/* `leastaction rollout` of models of pixels: what they foresee from the first two frames of a film,
   beside the film itself. Time is counted in frames. */
#ifndef APPS_FILM_H
#define APPS_FILM_H

#include "apps/output/outputs.h"
#include "rollout.h"
#include "hnn/pixels/latent.h"
#include "hnn/pixels/pixel_energy.h"

/* Frames of one motion, and what they show of its energy. */
struct film_strip {
    const char *name;
    size_t n;       /* frames */
    float *pixels;  /* [n x height x width] */
    double *energy; /* [n], of the rod; NaN at both ends, and where it is not known */
};

/* A model and what it foresees. Measures are NaN where there is nothing to measure. */
struct film_model {
    const char *file;
    hnn_model *model;
    struct phys_ode ode;  /* its field, in the latent space */
    struct hnn_path path; /* likewise */
    struct film_strip strip;
    struct hnn_rollout_info info;
    double energy_mse, pixel_mse, conserved_drift;
    double energy_before, energy_after; /* means before and after energy was added */
    struct hnn_latent_motion motion;    /* of many starts: of the last, but for the worst verdict */
    size_t outside;                     /* frame beyond the training; path.n: none */
    char what[120];
};

struct film {
    const struct rollout_options *options;
    struct hnn_rollout_settings settings;
    double *t;                /* [settings.n] 0, 1, 2 ... frames */
    struct hnn_frames source; /* starts */
    size_t trajectory;        /* of the source, the first one */
    struct film_strip truth;  /* of a source without a rod it may be shorter */
    double true_energy;       /* NaN: not known */
    size_t n_models;
    struct film_model model[ROLLOUT_MODELS];
};

/* Models, starts, outputs; takes `model`. Ends with film_free, whatever it returned. */
enum ad_status film_setup(const struct rollout_options *options, hnn_model *model,
                          struct film *film, struct ad_error *error);
void film_free(struct film *film);
/* Of a struct film: from one start, or means over many; and what is written of it. The CSV has a
   row a frame: number, energies, latent states. */
enum ad_status film_run(void *film, struct ad_error *error);
extern const struct output_kind film_outputs;

/* "hnn" or "baseline". */
const char *film_model_name(const struct film_model *model);
enum ad_status film_picture(const void *film, struct plot *plot, struct ad_error *error);

#endif
