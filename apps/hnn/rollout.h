/* The parts of `leastaction rollout`: setup from the options (rollout_setup), computation and
   errors (rollout_run), output (rollout_report, rollout_picture). */
#ifndef APPS_HNN_ROLLOUT_H
#define APPS_HNN_ROLLOUT_H

#include "apps/options.h"
#include "apps/output/outputs.h"
#include "apps/output/report.h"
#include "hnn/pixels/latent.h"
#include "hnn/rollout/rollout.h"

struct rollout_options {
    struct common common;
    const char *x0, *truth, *state, *time_column, *trial, *energy, *against, *integrator;
    double time, from, strength, dt, rtol, add_energy, at;
    size_t points, starts;
    const char *inputs, *interpolation;
    struct settings fix;
    bool reverse, skip_missing;
    size_t skip_rows;
};

/* Frames of one motion, and what they show of its energy. */
struct frame_strip {
    const char *name;
    size_t n;       /* frames */
    float *pixels;  /* [n x height x width] */
    double *energy; /* [n], of the rod; NaN at both ends, and where it is not known */
};

/* One model, where it went, and how far that is from the truth; NaN where there is none. */
struct rollout_model {
    const char *file;
    hnn_model *model;
    struct phys_ode ode;
    struct hnn_path path;
    struct hnn_inputs inputs;
    struct hnn_path table; /* of --inputs */
    struct hnn_rollout_info info;
    double energy_mse, energy_mse_model, coordinate_mse, conserved_drift;
    struct hnn_score score; /* of --starts */
    size_t outside;         /* sample beyond the training; path.n: none */
    char what[120];
    /* of pixels, whose state is the latent one and coordinate_mse that of pixels: */
    struct frame_strip strip;
    double energy_before, energy_after; /* means before and after energy was added */
    struct hnn_latent_motion motion;    /* of many starts: of the last, but for the worst verdict */
};

enum { ROLLOUT_MODELS = 2 }; /* MODEL, and that of --against */

struct rollout_run {
    const struct rollout_options *options;
    size_t n_models;
    struct rollout_model model[ROLLOUT_MODELS];
    const struct hnn_task *task; /* of --truth, or NULL */
    struct phys_system system;   /* of --truth, where that is a scene */
    struct phys_ode energy;      /* the true energy; of a task or a scene, its motion, too; n 0: not
                                    known */
    struct hnn_path truth;       /* n 0: none */
    struct hnn_rollout_settings settings;
    double *t;  /* outputs */
    double *x0; /* [states] */
};

/* Models, truth, start, outputs; takes `model`. Ends with rollout_free, whatever it returned. */
enum ad_status rollout_setup(const struct rollout_options *options, hnn_model *model,
                             struct rollout_run *run, struct ad_error *error);
void rollout_free(struct rollout_run *run);
/* Integrator, steps and added energy of the options, for any model. */
enum ad_status rollout_steps(const struct rollout_options *options,
                             struct hnn_rollout_settings *settings, struct ad_error *error);

/* Of a struct rollout_run: from one start, or from many; and what is written of it. The CSV has a
   row an output: t, and of every curve the state, the model's H, and the true energy. */
enum ad_status rollout_run(void *run, struct ad_error *error);
extern const struct output_kind rollout_outputs;

/* A number of every model: a row of the report, its value at this offset of struct rollout_model.
 */
struct rollout_row {
    const char *key, *label;
    size_t offset;
};

/* A table of `train --seeds` or `--sweep`, whose models are followed together
   (rollout_ensemble.c). */
bool rollout_is_ensemble(const char *file);
enum ad_status rollout_ensemble(const struct rollout_options *options, struct ad_error *error);

/* The numbers of a model that are reported. */
size_t rollout_numbers(const struct rollout_row **rows);

/* Of a network the name says little: "hnn", "baseline". */
const char *rollout_name(const struct rollout_model *model);

/* Curves of a run: every path there is, the truth last. */
struct rollout_curve {
    const char *prefix; /* of its columns in files: "", "against_", "truth_" */
    const struct hnn_path *path;
    const struct rollout_model *model; /* NULL: the truth */
};
size_t rollout_curves(const struct rollout_run *run,
                      struct rollout_curve curve[ROLLOUT_MODELS + 1]);

enum ad_status rollout_picture(const void *run, struct plot *plot, struct ad_error *error);

/* ---- shared with rollouts of pixels ---- */

/* The first model's rows belong to the run, the second's to the object "against". */
void rollout_report_models(struct report *report, size_t n_rows, const struct rollout_row rows[],
                           size_t n, const struct rollout_model models[]);

/* Appends a model that fits the first one; `model`: that of the file, where it is loaded already.
 */
enum ad_status rollout_add_model(struct rollout_model models[], size_t *n, const char *file,
                                 hnn_model *model, struct ad_error *error);
void rollout_free_models(size_t n, struct rollout_model models[]);
/* The columns that a model's inputs are, in a file, but for the time and what --fix gives; NULL:
   none. To be freed. */
char *rollout_input_columns(const struct rollout_options *options, const hnn_model *model);
/* What gives the model its inputs, from --fix, --inputs or the truth's file (rollout_inputs.c). */
enum ad_status rollout_give_inputs(struct rollout_run *run, struct rollout_model *model,
                                   struct ad_error *error);
/* Names of --fix that are an input of no model. */
enum ad_status rollout_check_fixed(const struct rollout_run *run, struct ad_error *error);
/* The integrator; "map" where all models are sympnets. */
const char *rollout_method(const struct rollout_run *run);
/* The step of a sympnet; 0: another model, NaN: not known. */
double rollout_map_step(const struct rollout_model *model);
/* Says which of several failed. */
enum ad_status rollout_name_cause(const char *what, struct ad_error *error);

#endif
