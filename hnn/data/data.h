/* Data sets: states and their rates from columns of a file, or from a published system.

       struct hnn_dataset data;
       struct hnn_dataset_settings s = {.size = sizeof s, .file = "motion.csv", .state = "q,p",
   .rate = "dqdt,dpdt", .split = HNN_SPLIT_RANDOM, .test_fraction = 0.2}; if (hnn_dataset_read(&s,
   &data, &error) == AD_OK) hnn_trainer_new(model, &training, &data.train, &data.test, &trainer,
   &error); hnn_dataset_free(&data);

   A file is CSV or text in columns of blanks (with or without a line of names, comments from # or
   %, quoted names, CRLF, a byte order mark, commas, semicolons, blanks), plain or compressed by
   gzip, or HDF5. Columns are
   chosen by name or by number from 1. In HDF5 a column is a one-dimensional array of numbers,
   named by its path, or NAME.1, NAME.2 ... of a two-dimensional one; the attribute "columns" of
   the file, names with commas between, gives them an order.

   Units are the data's; nothing is converted. Errors: those named, and AD_E_MEMORY. Threads: as in
   hnn.h. */
#ifndef HNN_DATA_DATA_H
#define HNN_DATA_DATA_H

#include "hnn/hnn.h"

AD_HEADER_BEGIN

/* ---- from a file ---- */

/* Rates from states x_i at times t_i. */
enum hnn_differences {
    HNN_FORWARD, /* (x_{i+1} - x_i)/(t_{i+1} - t_i), as in the published code */
    HNN_CENTRAL  /* slope at t_i of the parabola through three states, second order */
};

/* Which samples are reserved for the test. */
enum hnn_split {
    HNN_SPLIT_TAIL,   /* the last ones of the file */
    HNN_SPLIT_RANDOM, /* random ones, by the seed */
    HNN_SPLIT_TRIAL   /* all of some random trajectories, by the seed */
};

/* Names as on the command line; NULL-terminated, in the order of the enums. */
extern const char *const hnn_differences_names[], *const hnn_split_names[];

/* Columns of numbers in memory, in the place of a file, and read as one: a row is an observation.
 */
struct hnn_columns {
    size_t n, rows;
    const double *const *column; /* [n], each [rows] */
    const char *const *names;    /* [n], or NULL: columns are chosen by number */
};

/* Zero means the default. All is read during a call only. */
struct hnn_dataset_settings {
    size_t size;                       /* sizeof(struct hnn_dataset_settings) */
    const char *file;                  /* one of these two */
    const struct hnn_columns *columns; /* ... */
    /* Coordinates, then as many momenta: "q,p". NULL: every column X that has a column dXdt; or, if
       there is none, all but time and trial. Names then distinguish momenta from coordinates (q1
       and p1, x and px, theta and p_theta); two columns alone are in the order of the file. */
    const char *state;
    /* Their rates in that order, or in any order if all are named dXdt: "dqdt,dpdt". NULL: by
       differences if there is a `time`, else the columns dXdt. */
    const char *rate;
    const char *time;
    enum hnn_differences differences;
    /* Rows of one trajectory are consecutive and have the same number in this column. NULL: the
       column named trial, if there is one, else a time that decreases begins the next; "": all rows
       are one trajectory. Differences and rollouts cross neither its ends nor gaps: time steps over
       three times the median. */
    const char *trial;
    /* K, up to HNN_ROLLOUT_MOST; not 0: targets are the next K states instead of rates, in the
       steps of `time`, or of `dt` where there is no such column. */
    size_t rollout;
    double dt;
    bool skip_missing; /* skip rows in which a chosen column lacks a value, instead of refusing them
                        */
    size_t skip_rows;  /* lines of text skipped at the beginning of every file */
    /* Another file, or other columns, with these names, used for the test; or ... */
    const char *test_file;
    const struct hnn_columns *test_columns;
    double test_fraction; /* ... this fraction of the samples (or trajectories), 0 <= f < 1 */
    enum hnn_split split;
    uint64_t seed;
    /* Columns of a model's inputs, and of those that are controls, which come last; up to
       HNN_INPUTS_MOST in all. An input that is the column `time` is the time, and comes first. They
       need `state`. */
    const char *inputs, *controls;
    /* Not NULL: all ranks read together. Of a file each holds its share of the samples
       (hnn_samples_share), 1 byte a row besides, and until it has read 8 for the time and 8 for the
       trial; of columns and pipes, all. */
    struct ad_ranks *ranks;
};

struct hnn_dataset {
    size_t dof;                     /* n: states have 2n components */
    struct hnn_samples train, test; /* x [2n + m (rollout + 1) x train.n]; test.n may be 0 */
    double *centre, *scale;         /* [2n + m] of train.x: means and standard deviations */
    double *rate;        /* [2n]: root mean squares of the rates; of rollouts in the first step */
    double apart[2];     /* root mean squares of q_next - q: of a ring, between walls */
    double dt;           /* of a rollout's steps, the median */
    size_t trials;       /* trajectories in the file */
    bool trials_by_time; /* distinguished by a time that decreases */
    size_t gaps;         /* time steps skipped, over `longest`; of all files */
    double longest;
    size_t missing;    /* rows skipped, of all files */
    size_t units_line; /* line skipped below the names; 0: none */
    /* Names of the columns, else numbers from 1, separated by commas. Coordinates and momenta are
       the halves of the state; rate_names is "" for differences and rollouts. */
    char *state_names, *coordinates, *momenta, *rate_names;
    double *values;          /* owns the memory of all arrays */
    size_t inputs, controls; /* m, and how many of them are controls */
    bool timed;              /* the first input is the time */
    bool varied;             /* inputs that are neither time nor controls change in a trajectory, as
                                far as a time or a trial tells which rows are one */
    char *input_names;       /* as the names above; "" */
};

/* Reads a data set. Memory: that of the chosen columns and one more. AD_E_INPUT names file, line,
   column (in characters) and what was expected: a missing column, with the nearest that exists;
   text, NaN and infinity; rows of another length; times that do not increase. AD_E_ARGUMENT for
   contradictory settings. Free with hnn_dataset_free in any case. */
enum ad_status hnn_dataset_read(const struct hnn_dataset_settings *settings,
                                struct hnn_dataset *dataset, struct ad_error *error);
/* The same of states x [2 dof x samples] and their rates [2 dof x samples] in memory, both copied;
   the last samples, this fraction of all, are used for the test. AD_E_INPUT names a number that is
   not finite; AD_E_ARGUMENT for no or over 2^32 - 1 samples, and a fraction that leaves none. */
enum ad_status hnn_dataset_arrays(size_t dof, size_t samples, const double *x, const double *rate,
                                  double test_fraction, struct hnn_dataset *dataset,
                                  struct ad_error *error);
/* Adds what sample k of those held is worth to sum. */
typedef void hnn_samples_add(void *context, size_t k, double *sum);
/* sum [n] over all samples, the same bits for any number of ranks. */
enum ad_status hnn_samples_sum(struct ad_ranks *ranks, const struct hnn_samples *samples, size_t n,
                               hnn_samples_add *add, void *context, double *sum,
                               struct ad_error *error);
/* Of samples picked[n], whoever holds them: the rows of x, and of the target those of the `targets`
   first, then `steps` rows of steps, of length dt where there are none; taken [rows x n] on every
   rank. */
enum ad_status hnn_samples_take(struct ad_ranks *ranks, const struct hnn_samples *samples,
                                const size_t rows[3], double dt, size_t n, const uint32_t *picked,
                                double *taken, struct ad_error *error);
void hnn_dataset_free(struct hnn_dataset *dataset); /* takes zero-initialised ones too */
/* hnn_model_normalise with means, deviations and rates of the training samples; for rollouts with
   the rates of their first step. */
enum ad_status hnn_dataset_normalise(const struct hnn_dataset *dataset, hnn_model *model,
                                     struct ad_error *error);

/* ---- from a published system ---- */

/* Systems and settings of S. Greydanus et al., arXiv 1906.01563, appendix A; the double pendulum of
   M. Cranmer et al., arXiv 2003.04630. */

/* Sampling of the trajectories of a system. */
struct hnn_sampling {
    size_t size;                   /* sizeof(struct hnn_sampling) */
    size_t trials, points;         /* trajectories, and observations of each, both ends included */
    double time;                   /* from 0 */
    double noise;                  /* standard deviation, added to states, not to rates */
    double radius_min, radius_max; /* of starts; two bodies: of their coordinates; of the double
                                      pendulum only the largest counts: that of its velocities */
    double spread;                 /* of starting speeds about circular motion, relative */
    double strength;               /* of the potential */
};

struct phys_random;

/* A published system: H(q, p), its random starts, and its published sampling. */
struct hnn_task {
    const char *name, *what;
    size_t dof;
    const char *const *coordinates; /* [dof] without their q or p: "", "1x" */
    /* params: const double *strength; NULL: states are (q, v), with velocities for momenta */
    phys_hamiltonian *H;
    /* y [2 dof] = (q, p) or (q, v) at time 0 */
    void (*start)(struct phys_random *random, const struct hnn_sampling *sampling, double *y);
    /* How the published energy errors were computed: starts drawn otherwise than the data's (NULL:
       alike); an energy other than H (NULL: H); the models' time longer than the true one by a
       factor (0: 1). */
    void (*published_start)(struct phys_random *random, const struct hnn_sampling *sampling,
                            double *y);
    phys_hamiltonian *published_energy;
    double time_stretch;
    bool unit_masses;              /* dq/dt = p: momenta are velocities */
    struct hnn_sampling published; /* last, so that it may grow */
};
extern const struct hnn_task *const hnn_tasks[]; /* NULL-terminated */
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct hnn_task *hnn_task_find(const char *name, struct ad_error *error);
/* One random start y [2 dof]; strength 0: as published. */
void hnn_task_start(const struct hnn_task *task, double strength, uint64_t seed, double *y);
/* The equations of motion, y = (q, p) or (q, v); strength 0: as published. Free with phys_ode_free.
 */
enum ad_status hnn_task_ode(const struct hnn_task *task, double strength, struct phys_ode *ode,
                            struct ad_error *error);

/* Samples in rows, as in files: states, rates, trial, time. */
struct hnn_observations {
    size_t dof, rows, cols; /* cols = 4 dof + 2 */
    double *values;         /* [cols x rows] */
    char **names;           /* [cols] */
};
/* Observes the motion from random starts, followed by dop853 at 1e-10. AD_E_ARGUMENT for a sampling
   out of range. Free with hnn_observations_free in any case. */
enum ad_status hnn_task_observe(const struct hnn_task *task, const struct hnn_sampling *sampling,
                                uint64_t seed, struct hnn_observations *observations,
                                struct ad_error *error);
void hnn_observations_free(struct hnn_observations *observations);

AD_HEADER_END
#endif
