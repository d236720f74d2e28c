/* Motion by a model, and its distance from the truth.

       hnn_model_ode(model, &ode, &error);
       struct hnn_rollout_settings settings = {.size = sizeof settings, .n = 100, .t = t};
       hnn_rollout(&ode, &settings, x0, &path, &info, &error);
       hnn_task_trials(&ode, task, &(struct hnn_trials){.size = sizeof(struct hnn_trials), .starts =
   15}, &score, &error);

   A rollout needs a struct phys_ode: a vector field y' = f(t, y), y = (q, p), and, for energies,
   E(t, y). A model gives one (hnn_model_ode), so does a published system (hnn_task_ode); any other
   model can be given as callbacks.

   Units are the field's. Errors: AD_E_ARGUMENT, AD_E_MEMORY, those of the field. Threads: calls
   may run at once on different fields. */
#ifndef HNN_ROLLOUT_ROLLOUT_H
#define HNN_ROLLOUT_ROLLOUT_H

#include "hnn/data/data.h"

AD_HEADER_BEGIN

/* ---- paths ---- */

/* A motion at n times. Free with hnn_path_free. */
struct hnn_path {
    size_t states, n;
    double *t; /* [n] */
    double *x; /* [n][states], one state after the other */
    size_t inputs;
    double *u; /* [n][inputs], of models with inputs; NULL: none were asked for */
};
void hnn_path_free(struct hnn_path *path); /* takes zero-initialised ones too */

/* Fills t [n], n >= 2, with equally spaced times, both ends included. */
void hnn_times(double t0, double t1, size_t n, double *t);

/* Reads one measured trajectory of a file: of the settings the columns `state`, `inputs` and `time`
   (required), `file`, `trial`, `skip_missing` and `skip_rows` are used. Rows start at or after the
   time `from` (-INFINITY: the file's first) and span `time` (INFINITY: to the end) of the
   trajectory there: AD_E_INPUT where it ends before. Without a column that distinguishes
   trajectories, a gap in time (see data.h) ends one, too. */
enum ad_status hnn_path_read(const struct hnn_dataset_settings *settings, double from, double time,
                             struct hnn_path *path, struct ad_error *error);

/* ---- inputs ---- */

enum hnn_input_source { HNN_INPUT_VALUE, HNN_INPUT_TIME, HNN_INPUT_COLUMN };

/* Inputs of a motion, for hnn_drive: `at` is hnn_inputs_at, `context` one of these, `constant` what
   hnn_inputs_constant says of all. */
struct hnn_inputs {
    size_t n;                     /* inputs of the model */
    const struct hnn_path *table; /* whose u are taken; NULL: no HNN_INPUT_COLUMN */
    bool hold;                    /* from row to row; false: linear between */
    struct hnn_input {
        enum hnn_input_source source;
        double value;
        size_t column; /* of table->u */
    } input[HNN_INPUTS_MOST];
};
/* u [n] at t. AD_E_INPUT before the first row of the table and after the last. */
enum ad_status hnn_inputs_at(void *inputs, double t, double *u, struct ad_error *error);
/* Input k at times t [1 x n] on a tape, for hnn_drive.record: of columns of the table, NaN before
   its first row and after the last; of others tape NULL. */
ad_var hnn_inputs_record(void *inputs, size_t k, ad_var t);
/* Whether the first n of them, but for the time, are the same throughout. */
bool hnn_inputs_constant(const struct hnn_inputs *inputs, size_t n);
/* Reads columns of a table over time, names as in hnn_dataset_settings: path has t and u alone.
   AD_E_INPUT for times that do not increase, and what is no finite number. */
enum ad_status hnn_inputs_read(const char *file, const char *time, const char *columns,
                               struct hnn_path *path, struct ad_error *error);

/* ---- rollouts ---- */

/* Zero means the default, except for n and t. */
struct hnn_rollout_settings {
    size_t size;                              /* sizeof(struct hnn_rollout_settings) */
    const struct phys_integrator *integrator; /* NULL: dop853 */
    double dt;       /* fixed steps; shortened to divide the time to the next output evenly */
    double rtol;     /* tolerance of adaptive steps: error relative to the state, by component where
                        that is larger than the typical sizes at the start; 0: 1e-9 */
    size_t n;        /* outputs, the start at t[0] included */
    const double *t; /* [n], increasing */
    /* Energy added at t = add_at at once: the state moves along the gradient of the energy, which
       is its rate turned by 90 degrees (arXiv 1906.01563, section 6), until the energy has risen by
       `add`. Needs an energy and a canonical field. An output at add_at precedes it. */
    double add, add_at;
    bool reverse; /* also run back to the start */
};

struct hnn_rollout_info {
    size_t evaluations; /* evaluations of the field */
    double seconds;
    double reversal_error; /* distance from the start after running back; NaN: not requested */
};

/* Follows the motion from x0 [ode->n]; info may be NULL. path owns its memory and is empty on
   failure: AD_E_NONFINITE and AD_E_ACCURACY name time and component, AD_E_ARGUMENT an integrator
   that does not suit the field. */
enum ad_status hnn_rollout(const struct phys_ode *ode, const struct hnn_rollout_settings *settings,
                           const double *x0, struct hnn_path *path, struct hnn_rollout_info *info,
                           struct ad_error *error);

/* The same of a sympnet, in steps settings->dt, of which outputs are whole numbers apart;
   `evaluations` are steps, and `reverse` runs back by the inverse map. Of the settings rtol and
   integrator are not used. AD_E_ARGUMENT for other models, outputs between steps, added energy. */
enum ad_status hnn_map_rollout(const hnn_model *model, const struct hnn_rollout_settings *settings,
                               const double *x0, struct hnn_path *path,
                               struct hnn_rollout_info *info, struct ad_error *error);

/* ---- measures ---- */

/* Mean over components of (a - b)^2 at sample i; and over all samples. As all measures of two
   paths, NaN where their shapes differ or there is no such sample. */
double hnn_path_square(const struct hnn_path *a, const struct hnn_path *b, size_t i);
double hnn_path_mse(const struct hnn_path *a, const struct hnn_path *b);
/* E at sample i; NaN where the ode has none. */
double hnn_path_energy(const struct phys_ode *ode, const struct hnn_path *path, size_t i);
/* Mean over samples of (E(a) - E(b))^2: the published energy error, where E is the true energy, a
   the motion by the model and b the true motion. */
double hnn_energy_mse(const struct phys_ode *ode, const struct hnn_path *a,
                      const struct hnn_path *b);
/* The error of the published table, as its code computed it: of the published energy of a system,
   with the model followed over the published time from the same start (hnn_task.published_energy,
   time_stretch). `path` and `truth` belong to `settings`, whose times begin at 0; strength 0: as
   published. */
enum ad_status hnn_task_published_mse(const struct hnn_task *task, double strength,
                                      const struct phys_ode *model,
                                      const struct hnn_rollout_settings *settings,
                                      const struct hnn_path *path, const struct hnn_path *truth,
                                      double *mse, struct ad_error *error);
/* The largest change of E from its start, less the energy added, in units of E: the energy of a
   model is known up to a constant, so a ratio would be meaningless. */
double hnn_energy_drift(const struct phys_ode *ode, const struct hnn_path *path,
                        const struct hnn_rollout_settings *settings);

/* The first sample outside the model's range of training, energies first, described in `what`;
   path->n if there is none or the range is unknown. */
size_t hnn_path_outside(hnn_model *model, const struct hnn_path *path, char *what, size_t size);

/* L_vv of a Lagrangian model along a path (hnn_model_mass). */
enum ad_status hnn_path_mass(const hnn_model *model, const struct hnn_path *path,
                             struct hnn_mass *mass, struct ad_error *error);

/* ---- trials ---- */

/* Trials of a model against a published system from random starts. Zero: as published. */
struct hnn_trials {
    size_t size;           /* sizeof(struct hnn_trials) */
    size_t starts, points; /* 0: 15; outputs of each, both ends included, 0: 100 */
    double time;           /* 0: 20 */
    double strength;       /* of the system; 0: as published */
    uint64_t seed;         /* of the starts */
    const struct phys_integrator *integrator;
    double dt, rtol; /* as in hnn_rollout_settings */
};

/* Means over starts. */
struct hnn_score {
    double energy_mse;       /* true energy, true time */
    double energy_mse_model; /* the model's own H of its motion and of the true one; or NaN */
    /* As the published code computed it (hnn_task.published_energy, time_stretch). */
    double energy_mse_published;
    double coordinate_mse, conserved_drift; /* the latter NaN likewise */
    size_t evaluations;
    double seconds;
};
/* Follows both from each start, the truth by dop853 at 1e-12, and averages the errors. */
enum ad_status hnn_task_trials(const struct phys_ode *model, const struct hnn_task *task,
                               const struct hnn_trials *trials, struct hnn_score *score,
                               struct ad_error *error);

AD_HEADER_END
#endif
