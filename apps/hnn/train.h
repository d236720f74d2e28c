/* The parts of `leastaction train`: setup of samples, model and method from the options
   (train_setup), progress and checkpoints (train_watch), output
   (train_report, train_curve). */
#ifndef APPS_HNN_TRAIN_H
#define APPS_HNN_TRAIN_H

#include "apps/options.h"
#include "apps/output/progress.h"
#include "apps/output/report.h"
#include "hnn/data/data.h"
#include "hnn/pixels/latent.h"
#include "hnn/pixels/pixels.h"

struct train_options {
    struct common common;
    const char *model, *field, *activation, *angles, *lattice, *start, *hidden, *precision;
    size_t layers, coordinates;
    bool separable, dissipation, quadratic, normalise, control_network;
    const char *state, *rate, *time, *differences, *trial, *unit; /* columns */
    bool skip_missing;
    size_t skip_rows;
    const char *test, *split;
    double test_fraction;
    const char *optimiser, *schedule, *batch, *stepping, *inputs, *controls;
    bool hold, free_starts;
    size_t steps, rollout, every, patience;
    double learning_rate, weight_decay, momentum, average, dt, clip;
    const char *log, *from;
    bool resume;
    double checkpoint; /* seconds between checkpoints */
};

struct train_run {
    const struct train_options *options;
    bool pixels; /* it learns from frames, else from data */
    struct hnn_dataset data;
    struct hnn_frames frames;
    struct hnn_split_pairs pairs;
    struct hnn_samples train, test;
    hnn_model *model;
    hnn_trainer *trainer;
    struct hnn_training settings;
    struct hnn_video_motion motion; /* of pixels */
    struct hnn_mass mass;           /* of lnn, at some training samples; condition 0: of others */
    size_t mass_samples;
    double loss_of_zero; /* train_find_loss_of_zero */
    struct progress progress;
    double next_checkpoint; /* in seconds of training */
    struct ad_error failed; /* of a checkpoint on the way */
};
/* Ends with train_free, whatever it returned. */
enum ad_status train_setup(const struct train_options *options, struct train_run *run,
                           struct ad_error *error);
void train_free(struct train_run *run);

/* Model of pixels: reads the frames, splits them into training and test, and notes their source in
   the model (train_frames.c). */
enum ad_status train_read_frames(struct train_run *run, struct ad_error *error);
enum ad_status train_note_frames(struct train_run *run, struct ad_error *error);

/* Writes --out: the model, and all that --resume needs. */
enum ad_status train_save(struct train_run *run, struct ad_error *error);
/* The progress callback of the trainer; context is the run. */
bool train_after_step(void *context, hnn_trainer *trainer);

/* L_vv of a trained lnn at some of its samples. */
enum ad_status train_mass(struct train_run *run, struct ad_error *error);

/* Writes --log and --plot, whole, over what they were; --log to standard output at the end only
   (train_curve.c). */
enum ad_status train_publish(const struct train_run *run, bool last, struct ad_error *error);
/* Before anything is computed: whether --out, --log and --plot can be written. */
enum ad_status train_check_outputs(const struct train_options *options, struct ad_error *error);

/* Its kind, as --model names it. */
const char *train_model_name(const struct train_run *run);
/* The loss of a field that is 0 everywhere; NaN for pixels. */
enum ad_status train_find_loss_of_zero(struct train_run *run, struct ad_error *error);
void train_report(const struct train_run *run, struct report *report);

#endif
