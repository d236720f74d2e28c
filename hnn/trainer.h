/* Training: samples, settings, and a trainer that takes steps and keeps their history.

   Units are the data's. Errors: as in hnn/hnn.h, and those named. Threads: as there. */
#ifndef HNN_TRAINER_H
#define HNN_TRAINER_H

#include "autodiff/ranks.h"
#include "hnn/model.h"

AD_HEADER_BEGIN

/* Training samples: states x [2n x n] and rates [2n x n]; or, for the loss on rollouts of K steps,
   targets [K*2n x n], rows (k-1)*2n ... being the state k steps after x, with step lengths `steps`
   [K x n]; NULL: hnn_training.dt. Behind the states x has m rows of the model's inputs there;
   of rollouts then K times m, after each step. Of rates by forward differences `steps` [n] are
   their lengths, for the check that velocities are the rates of coordinates. Models of pixels learn
   from contiguous frames of `frame` pixels: sample k is the observation that begins with frame
   first[k], its target the one a frame later.

   Each of many ranks (hnn_training.ranks) may hold a part of the states and rates, no less than
   hnn_samples_share: samples begin to end - 1, in arrays of as many columns. end 0: all. */
struct hnn_samples {
    size_t n;
    const double *x, *target, *steps;
    const float *frames;
    const size_t *first; /* [n] */
    size_t frame;
    size_t begin, end;
    void *reserved[2]; /* NULL: room for what later releases add */
};
static inline size_t hnn_samples_held(const struct hnn_samples *s)
{
    return s->end ? s->end - s->begin : s->n;
}
/* The part of n samples that a rank needs: its even part, and 8192 more to either side; alone, and
   of at most 16384, all: *end is 0. */
void hnn_samples_share(const struct ad_ranks *ranks, size_t n, size_t *begin, size_t *end);

struct hnn_optimiser;
struct hnn_schedule;

/* Schedule of the learning rate: factor(step of steps) times learning_rate. */
struct hnn_schedule {
    const char *name, *what;
    double (*factor)(size_t step, size_t steps);
};
extern const struct hnn_schedule *const hnn_schedules[];   /* NULL-terminated */
extern const struct hnn_optimiser *const hnn_optimisers[]; /* NULL-terminated */
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct hnn_schedule *hnn_schedule_find(const char *name, struct ad_error *error);
const struct hnn_optimiser *hnn_optimiser_find(const char *name, struct ad_error *error);
const char *hnn_optimiser_name(const struct hnn_optimiser *optimiser);

/* The steps in time of a loss on rollouts. */
enum hnn_stepping {
    HNN_RUNGE_KUTTA, /* of order 4 */
    HNN_LEAPFROG,    /* symplectic, of order 2: of a separable H without dissipation */
    HNN_MIDPOINT     /* the implicit midpoint rule, likewise, of any model of 16 coordinates at
                        most; a loss that is not finite where its steps have no solution */
};
extern const char *const hnn_steppings[]; /* NULL-terminated, in the order of the enum */

struct hnn_trainer;
typedef struct hnn_trainer hnn_trainer;

struct hnn_training {
    size_t size; /* sizeof(struct hnn_training) */
    const struct hnn_optimiser *optimiser;
    const struct hnn_schedule *schedule;
    size_t steps;
    size_t batch; /* samples per step, by seeded permutations; 0: all of them */
    double learning_rate, weight_decay;
    double momentum; /* sgd */
    double
        average; /* the model gets the mean of the parameters over about this last fraction of the
                    steps, 0 ... 1; 0, and always with lbfgs: the parameters of the last step */
    size_t rollout;  /* K, up to HNN_ROLLOUT_MOST: loss on K steps in time; 0: on the rates */
    double dt;       /* their length, where the samples have no `steps` */
    size_t every;    /* steps between losses on the test set, and rows of the history; 0: 10 */
    size_t patience; /* stop when the test loss has not decreased for this many steps, and return to
                        its minimum; 0: never */
    uint64_t seed;   /* of the permutations */
    size_t threads;
    /* Called after every step; false stops the training. May call the functions of a trainer, but
       neither run, advance, resume nor free it. */
    bool (*progress)(void *context, hnn_trainer *trainer);
    void *context; /* of progress */
    /* A loss of the caller's own, for models of states; NULL: the mean square. Records the loss of
       every sample [1 x samples], of x and target as in hnn_samples (of rollouts, K rows with the
       steps' lengths follow), from hnn_model_record(model, parameters, x). Column k depends on
       columns k alone. The loss of a set is the mean. */
    ad_var (*loss)(void *context, const hnn_model *model, ad_var parameters, ad_var x,
                   ad_var target);
    void *loss_context;
    double clip; /* a gradient of a larger Euclidean norm is scaled to this one, before weight
                    decay; 0: never; not for lbfgs */
    /* Ranks that train together, each on its share of every batch, in blocks of 1024 to 4096
       samples (100 of frames); NULL: alone. On every rank the same functions are called with the
       same arguments, `progress` answers alike, and what they return is the same to the last bit;
       one rank's error is that of all, but files are written by rank 0 alone. Outlives the trainer.
     */
    struct ad_ranks *ranks;
    enum hnn_stepping stepping; /* of `rollout` */
    /* Of `rollout`: samples are observations, not starts. The loss of a sample is the mean square
       over itself and the K states that follow it, of the motion nearest to all of these; up to 16
       coordinates. */
    bool free_starts;
    bool hold; /* of `rollout`: inputs of the model but the time hold from state to state; false:
                  they are linear between */
};
/* As published: adam, constant, 2000 steps, full batch, rate 1e-3, weight decay 1e-4; except for
   the average over the last tenth of the steps, where published models have their last weights. */
void hnn_training_defaults_to(struct hnn_training *settings);
static inline struct hnn_training hnn_training_defaults(void)
{
    struct hnn_training settings;
    settings.size = sizeof settings;
    hnn_training_defaults_to(&settings);
    return settings;
}
/* The same for models of pixels: 10000 steps of batches of 200, weight decay 1e-5, no average,
   losses every 200 steps. */
static inline struct hnn_training hnn_pixel_training_defaults(void)
{
    struct hnn_training s = hnn_training_defaults();
    s.steps = 10000;
    s.batch = 200;
    s.weight_decay = 1e-5;
    s.average = 0;
    s.every = 200;
    return s;
}

enum hnn_stop {
    HNN_STOP_STEPS = 1,   /* all steps taken */
    HNN_STOP_PATIENCE,    /* the test loss no longer decreases */
    HNN_STOP_INTERRUPTED, /* progress returned false */
    HNN_STOP_STALLED      /* no step reduces the loss (lbfgs) */
};

/* A row of the history: the mean loss of the steps since the previous row, the test loss (NaN
   without test samples), and the seconds of training so far (NaN: before a resume). */
struct hnn_row {
    size_t step;
    double train_loss, test_loss, seconds;
};

/* A trainer: a model, its samples, and the state of the method. The loss is the mean square of
   (field - rate) over components and samples, or of the states along rollouts; for models of
   pixels, where x is the latent state and rates are per frame, see train_pixels.c. Weights of
   pixels that are dark in every training frame are 0 after training. Model and the arrays of
   samples are referenced and must outlive the trainer; settings are copied. `test` may be NULL or
   have n 0. The model may get other parameters between steps, which go on from there; normalised
   anew, it is refused. */
enum ad_status hnn_trainer_new(hnn_model *model, const struct hnn_training *training,
                               const struct hnn_samples *train, const struct hnn_samples *test,
                               hnn_trainer **trainer, struct ad_error *error);
void hnn_trainer_free(hnn_trainer *trainer); /* takes NULL */
/* Trains up to settings.steps. `stop` may be NULL. The model gets the result, also after an
   interruption. AD_E_NONFINITE, naming the step, if the loss is not finite; the model is then
   unchanged; so for parameters that are not finite. */
enum ad_status hnn_trainer_run(hnn_trainer *trainer, enum hnn_stop *stop, struct ad_error *error);
/* The next n steps of the same training, to the last bit, for loops of the caller's own: the model
   then has the result, which costs an evaluation of H at some thousands of samples. *stop (may be
   NULL) is why no step can follow, as after settings.steps; 0: one can. */
enum ad_status hnn_trainer_advance(hnn_trainer *trainer, size_t n, enum hnn_stop *stop,
                                   struct ad_error *error);
/* Sets the learning rate from the next step on, in place of settings.learning_rate; the schedule
   still multiplies it. Saved and resumed with the trainer. AD_E_ARGUMENT unless above 0 and
   finite, and for lbfgs, which searches for its own. */
enum ad_status hnn_trainer_set_rate(hnn_trainer *trainer, double rate, struct ad_error *error);
/* The learning rate of the next step, schedule included. */
double hnn_trainer_rate(const hnn_trainer *trainer);

size_t hnn_trainer_step(const hnn_trainer *trainer);    /* steps taken */
double hnn_trainer_seconds(const hnn_trainer *trainer); /* seconds of training since trainer_new */
size_t hnn_trainer_steps_now(const hnn_trainer *trainer); /* taken since trainer_new */
/* Valid until the next step. */
const struct hnn_row *hnn_trainer_history(const hnn_trainer *trainer, size_t *rows);
/* Losses over all samples. Inside `progress` they are those after the last step (of the mean, with
   `average`), which the model does not have yet; elsewhere those of the model. */
double hnn_trainer_train_loss(hnn_trainer *trainer);
double hnn_trainer_test_loss(hnn_trainer *trainer);

/* Saves the model with the state of its training; a trainer made with the same arguments and
   resumed from that file continues to the last bit. */
enum ad_status hnn_trainer_save(hnn_trainer *trainer, const char *file, const char *command,
                                struct ad_error *error);
/* AD_E_INPUT if the file is damaged, or of another model, data, or settings. */
enum ad_status hnn_trainer_resume(hnn_trainer *trainer, const char *file, struct ad_error *error);

AD_HEADER_END
#endif
