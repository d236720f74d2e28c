/* Internals of training, for this folder: samples and their order (train_data), losses and their
   gradients (train_loss, train_step), optimisers, schedules and averages,
   checkpoints and resumption (train_state). Other folders use the trainer of hnn/hnn.h, and for
   measurements of speed hnn/train/train_speed.h. */
#ifndef HNN_TRAIN_TRAIN_H
#define HNN_TRAIN_TRAIN_H

#include "hnn/model/internal.h"

/* Pixels of a frame that some frame of the training lights; NULL: all. */
struct hnn_lit {
    size_t n, *pixel;
};

/* ---- samples (train_data.c) ---- */

/* Samples, by reference, and the order in which batches take them; they become elements of the
   type of training where they are copied to a program. Those of columns are columns there, windows
   of frames are rows. */
struct hnn_data {
    enum ad_type type;
    size_t n, held, x_rows, target_rows, rollout; /* held: of n, by this rank */
    double dt;                                    /* of rollouts without steps of their own */
    struct hnn_samples samples;
    struct ad_ranks *ranks; /* that hold them all together */
    double *taken;          /* [x_rows + target_rows][n_taken] by hnn_data_take: the batch */
    size_t n_taken;
    float *windows;            /* the same of frames: each an observation and the next one */
    const struct hnn_lit *lit; /* of frames */
    uint64_t hash;             /* of all of it */
    uint32_t *order;           /* [n], the present permutation; NULL: batches are not drawn */
    size_t position;           /* taken from it */
    struct phys_random random, epoch; /* now, and before the present permutation was drawn */
};
/* Of rollouts, training->rollout, the last rows of the target are the lengths of their steps. */
enum ad_status hnn_data_new(struct hnn_data *data, enum ad_type type,
                            const struct hnn_training *training, const struct hnn_samples *samples,
                            const struct hnn_lit *lit, size_t x_rows, size_t target_rows,
                            struct ad_error *error);
void hnn_data_free(struct hnn_data *data);
/* Draws batches from now on, by permutations from `seed`. */
enum ad_status hnn_data_shuffle(struct hnn_data *data, uint64_t seed, struct ad_error *error);
/* The permutation that begins with `epoch`, `position` numbers of it taken. */
void hnn_data_return(struct hnn_data *data, const struct phys_random *epoch, size_t position);
/* The next `count` samples of the order; permutations follow each other, so that every sample is
   taken equally often. */
void hnn_data_draw(struct hnn_data *data, size_t count, uint32_t *drawn);
/* Of samples of which ranks hold parts: picked[n] from all of them to data->taken, for
   hnn_data_copy. */
enum ad_status hnn_data_take(struct hnn_data *data, size_t n, const uint32_t *picked,
                             struct ad_error *error);
/* Of frames: sample picked[k], taken where ranks hold parts. */
const float *hnn_data_window(const struct hnn_data *data, const uint32_t *picked, size_t k);
/* Copies samples picked[first] ..., or, where that is NULL, first ..., beyond the last one that
   again, to x [x_rows x cols] and target [target_rows x cols]; frames: [cols x x_rows] ... */
void hnn_data_copy(const struct hnn_data *data, const uint32_t *picked, size_t first, size_t count,
                   size_t cols, void *x, void *target);

/* ---- the loss (train_loss.c) ---- */

/* What is learned: one const struct, one line in the choice of train_loss.c. */
struct hnn_objective {
    bool by_rows; /* x and target are [samples x x_rows], [samples x target_rows] */
    size_t (*x_rows)(const hnn_model *model, const struct hnn_training *training);
    size_t (*target_rows)(const hnn_model *model, const struct hnn_training *training);
    /* The loss of every sample, [1 x samples]; that of a set is their mean. */
    ad_var (*record)(const hnn_model *model, const struct hnn_training *training, ad_var parameters,
                     ad_var x, ad_var target);
};
extern const struct hnn_objective hnn_learn_pixels;   /* train_pixels.c */
extern const struct hnn_objective hnn_learn_rollouts; /* train_rollouts.c */
/* Rows of x: the state, its inputs, and those of the states that a rollout leads to. */
size_t hnn_state_rows(const hnn_model *model, const struct hnn_training *training);

/* Mean square of every column, each row in its unit; NULL: none. */
ad_var hnn_mean_squares(ad_var residual, const double *units);

/* A loss of the caller's own (train_own.c); AD_E_ARGUMENT where that of a sample depends on
   others. */
extern const struct hnn_objective hnn_learn_own;
enum ad_status hnn_own_loss_check(const hnn_model *model, const struct hnn_training *training,
                                  struct hnn_data *data, struct ad_error *error);

/* These of the model's objective. */
size_t hnn_x_rows(const hnn_model *model, const struct hnn_training *training);
size_t hnn_target_rows(const hnn_model *model, const struct hnn_training *training);
bool hnn_by_rows(const hnn_model *model, const struct hnn_training *training);
/* An input for a number of samples, of `components` each. */
ad_var hnn_record_samples(ad_tape *tape, bool by_rows, size_t components, size_t samples,
                          const char *label);
ad_var hnn_record_losses(const hnn_model *model, const struct hnn_training *training,
                         ad_var parameters, ad_var x, ad_var target);

/* ---- steps in time (train_stepping.c) ---- */

enum { HNN_MIDPOINT_MOST = 16, HNN_STARTS_MOST = 16 }; /* coordinates */

/* A step of length dt [1 x samples]; inputs before and after it [m x samples], where the model has
   some, and whether they hold until the end (not the time). */
struct hnn_step {
    const hnn_model *model;
    ad_var parameters, dt, before, after;
    bool hold;
};
/* The states x [2n x samples] after a step. */
ad_var hnn_record_step(const struct hnn_step *step, enum hnn_stepping stepping, ad_var x);
/* AD_E_ARGUMENT where the method does not suit the model. */
enum ad_status hnn_stepping_check(const hnn_model *model, const struct hnn_training *training,
                                  struct ad_error *error);

/* AD_E_ARGUMENT says what is out of range, or does not fit the model or the samples
   (train_settings.c). */
enum ad_status hnn_training_check(const hnn_model *model, const struct hnn_training *training,
                                  const struct hnn_samples *train, const struct hnn_samples *test,
                                  struct ad_error *error);
/* AD_E_ARGUMENT where a Lagrangian model's states are not (q, v) (train_velocities.c). */
enum ad_status hnn_velocities_check(const hnn_model *model, const struct hnn_training *training,
                                    const struct hnn_samples *samples, struct ad_error *error);

/* ---- one step (train_step.c) ---- */

/* Loss and gradient of one batch. */
struct hnn_problem {
    enum ad_type type;
    size_t n; /* parameters */
    /* Samples: of a batch, and of each of its blocks but the last, on which the program runs. */
    size_t batch, block, blocks;
    double clip; /* of hnn_training */
    struct ad_ranks *ranks;
    double *sum; /* [n + 1] the gradient and the loss over blocks */
    struct ad_error *failed;
    const struct hnn_data *data;
    uint32_t *drawn; /* [batch] samples of the batch, set before an evaluation; NULL: all of them */
    ad_tape *tape;
    ad_var parameters, x, target, weights, loss, gradient;
    ad_program *program;
};
/* For batches of training->batch, 0: all samples. Evaluations leave their errors in *failed. */
enum ad_status hnn_problem_new(struct hnn_problem *problem, const hnn_model *model,
                               const struct hnn_training *training, const struct hnn_data *data,
                               struct ad_error *failed, struct ad_error *error);
void hnn_problem_free(struct hnn_problem *problem);
/* The present point and the gradient there, [n] of the type. */
void *hnn_problem_point(const struct hnn_problem *problem);
const void *hnn_problem_gradient(const struct hnn_problem *problem);
/* Runs the program; returns the loss. The gradient is clipped. An error, such as AD_E_NONFINITE
   for a sample that has no accelerations, its L_vv being singular: NaN. */
double hnn_problem_evaluate(const struct hnn_problem *problem);
/* The first block on one thread; returns the seconds spent in matrix products. */
double hnn_problem_products(const struct hnn_problem *problem);

/* The loss over many samples, in pieces of one program, shared among ranks. */
struct hnn_loss_evaluator {
    struct ad_ranks *ranks;
    struct ad_error *failed;
    ad_tape *tape;
    ad_var parameters, x, target, losses;
    ad_program *program;
    size_t piece;
    const struct hnn_data *data;
};
enum ad_status hnn_loss_evaluator_new(struct hnn_loss_evaluator *evaluator, const hnn_model *model,
                                      const struct hnn_training *training,
                                      const struct hnn_data *data, struct ad_error *failed,
                                      struct ad_error *error);
void hnn_loss_evaluator_free(struct hnn_loss_evaluator *evaluator);
/* Mean loss at a point [n]; NaN without samples. */
double hnn_evaluate_loss(const struct hnn_loss_evaluator *evaluator, const void *point,
                         size_t bytes);

/* ---- methods (train_optimiser.c, train_lbfgs.c) ---- */

/* A method: one const struct, one line in the table. */
struct hnn_optimiser {
    const char *name, *what;
    bool full_batch; /* the loss must be the same function at every step */
    void *(*create)(const struct hnn_training *training, enum ad_type type, size_t n);
    void (*destroy)(void *method);
    /* One step from the problem's point; *loss is that before it. False: the loss falls no more. */
    bool (*step)(void *method, const struct hnn_problem *problem, double rate, double *loss);
    /* For checkpoints: steps counted, and *n elements of *type, owned by the method. */
    uint64_t *(*count)(void *method);
    void *(*state)(void *method, size_t *n, enum ad_type *type);
};

extern const struct hnn_optimiser hnn_lbfgs;

/* ---- the trainer (train.c, train_state.c) ---- */

struct hnn_trainer {
    hnn_model *model;
    hnn_model *learner; /* what is trained: the model, or it without weights of dark pixels */
    struct hnn_lit lit;
    void *selected; /* [size of the learner] */
    struct hnn_training settings;
    struct hnn_data train, test;
    struct hnn_problem problem;
    struct hnn_loss_evaluator train_loss, test_loss;
    struct ad_error failed; /* of an evaluation; the step or the call that made it takes it */
    void *method;
    bool delivered;      /* no step was taken since the model had the result */
    bool running;        /* inside hnn_trainer_run or _advance */
    bool stalled;        /* no step reduces the loss */
    double rate;         /* settings.learning_rate, or as it was set */
    uint64_t version;    /* of the model's parameters that the trainer knows */
    uint64_t normalised; /* of the model when its loss was recorded */
    size_t step, steps_now, size_bytes;
    double seconds;
    double loss_sum; /* of the steps since the last row ... */
    size_t loss_count;
    struct hnn_row *history;
    size_t rows;
    double best_loss; /* least test loss, the step it was at, and the parameters there */
    size_t best_step;
    void *best;      /* NULL without patience */
    double *average; /* [n]; NULL where the last parameters are the model's */
    void *rounded;   /* the same in their type */
};

/* Makes the learner for these samples; its point from the model's parameters, owned by the trainer;
   and the model's parameters from a point (active_pixels.c). */
enum ad_status hnn_learner_new(hnn_trainer *trainer, const struct hnn_samples *samples,
                               struct ad_error *error);
void hnn_learner_free(hnn_trainer *trainer);
const void *hnn_learner_point(hnn_trainer *trainer);
void hnn_learner_deliver(hnn_trainer *trainer, const void *point);

/* The mean of the parameters (train_average.c): memory for it, false where there is none; begun
   anew at the present parameters; these, after a step, taken into it. */
bool hnn_average_new(hnn_trainer *trainer);
void hnn_average_restart(hnn_trainer *trainer);
void hnn_average_step(hnn_trainer *trainer);
/* What the model would be if training ended here, [n]: that mean, or the present parameters. */
const void *hnn_trainer_outcome(const hnn_trainer *trainer);

/* AD_E_ARGUMENT inside `progress`, and where the model was normalised since. */
enum ad_status hnn_trainer_idle(const hnn_trainer *trainer, struct ad_error *error);

/* Appends a row to the history; AD_E_MEMORY. */
enum ad_status hnn_history_add(hnn_trainer *trainer, const struct hnn_row *row,
                               struct ad_error *error);
/* The model has seen the latent states of its training frames (train_range.c). */
enum ad_status hnn_range_latents(hnn_trainer *trainer, struct ad_error *error);
/* Hands the parameters found so far to the model, and what it has seen. */
enum ad_status hnn_trainer_deliver(hnn_trainer *trainer, struct ad_error *error);

#endif
