/* Settings of fits, ensembles, periodic motions, networks and quantum runs, as test_settings.c has
   them of optimisers, paths and motions. */
#include "hnn/data/data.h"
#include "hnn/pixels/pixels.h"
#include "hnn/rollout/rollout.h"
#include "physics/fit/fit.h"
#include "physics/modes/modes.h"
#include "physics/motion/ensemble.h"
#include "physics/physics.h"
#include "physics/stability/periodic.h"
#include "quantum/run.h"
#include "quantum/slit.h"
#include "tests/contract/settings.h"

#include <math.h>

enum { ROWS = 12, SAMPLES = 20 };
static struct phys_system pendulum, free_particle;
static double t[ROWS], motion[2 * ROWS], columns[4][SAMPLES], x[2 * SAMPLES], rates[2 * SAMPLES];

/* ---- physics ---- */

static struct phys_fit_data rows(void)
{
    return (struct phys_fit_data){
        .size = sizeof(struct phys_fit_data), .n = ROWS, .t = t, .x = motion};
}

static struct phys_fit_settings fit(void)
{
    static const char *const names[] = {"l"};
    return (struct phys_fit_settings){
        .size = sizeof(struct phys_fit_settings), .n_free = 1, .free = names, .tries = 1};
}

static enum ad_status fit_both(const struct phys_fit_data *data, const struct phys_fit_settings *s,
                               struct ad_error *error)
{
    struct phys_fit result;
    phys_fit_solve(&pendulum, data, s, &result, error);
    phys_fit_free(&result);
    return error->status;
}

static enum ad_status use_rows(const struct phys_fit_data *s, struct ad_error *error)
{
    const struct phys_fit_settings how = fit();
    return fit_both(s, &how, error);
}

static enum ad_status use_fit(const struct phys_fit_settings *s, struct ad_error *error)
{
    const struct phys_fit_data data = rows();
    return fit_both(&data, s, error);
}

static void test_fit(void **state)
{
    (void)state;
    wrong = 0;
    TRY(rows, use_rows, "", (void)s);
    TRY(rows, use_rows, "size", s.size = 0);
    TRY(rows, use_rows, "rows", s.n = 0);
    TRY(rows, use_rows, "t", s.t = NULL);
    TRY(rows, use_rows, "x", s.x = NULL);
    TRY(rows, use_rows, "row 1: time", s.n = 2, s.t = (double[]){NAN, 1});
    TRY(rows, use_rows, "row 2: time", s.n = 2, s.t = (double[]){1, 1});
    TRY(rows, use_rows, "row 1: trial", s.n = 2, s.trial = (size_t[]){1, 1});
    TRY(rows, use_rows, "row 2: column 1", s.x = (double[2 * ROWS]){1, 1, INFINITY, 1});
    TRY(fit, use_fit, "", (void)s);
    TRY(fit, use_fit, "size", s.size = 0);
    TRY(fit, use_fit, "free", s.free = NULL);
    TRY(fit, use_fit, "free", s.free = (const char *[]){NULL});
    TRY(fit, use_fit, "ll", s.free = (const char *[]){"ll"});
    TRY(fit, use_fit, "noise", s.noise = (double[]){NAN, 1});
    TRY(fit, use_fit, "noise", s.noise = (double[]){0, -1});
    TRY(fit, use_fit, "noise", s.noise = (double[]){INFINITY, 1});
    TRY(fit, use_fit, "held-out", s.held_out = NAN);
    TRY(fit, use_fit, "held-out", s.held_out = -.1);
    TRY(fit, use_fit, "held-out", s.held_out = 1);
    assert_int_equal(wrong, 0);
}

static struct phys_motion_settings each;
static struct phys_ensemble_settings ensemble(void)
{
    static const char *const names[] = {"theta"};
    static const double values[] = {.1, .2};
    each = (struct phys_motion_settings){.size = sizeof each, .time = .5, .no_reference = true};
    return (struct phys_ensemble_settings){.size = sizeof(struct phys_ensemble_settings),
                                           .n = 2,
                                           .n_columns = 1,
                                           .names = names,
                                           .values = values,
                                           .motion = &each};
}

static enum ad_status use_ensemble(const struct phys_ensemble_settings *s, struct ad_error *error)
{
    struct phys_ensemble result;
    phys_ensemble_solve(&pendulum, s, &result, error);
    phys_ensemble_free(&result);
    return error->status;
}

static struct phys_periodic_settings periodic(void)
{
    static const double begin[] = {1.5, 0};
    return (struct phys_periodic_settings){.size = sizeof(struct phys_periodic_settings),
                                           .x = begin,
                                           .period = 115,
                                           .hold_energy = true};
}

static enum ad_status use_periodic(const struct phys_periodic_settings *s, struct ad_error *error)
{
    struct phys_periodic found;
    phys_periodic_find(&pendulum, s, &found, error);
    phys_periodic_free(&found);
    return error->status;
}

static struct phys_equilibria_settings equilibria(void)
{
    return (struct phys_equilibria_settings){.size = sizeof(struct phys_equilibria_settings),
                                             .starts = 3};
}

static enum ad_status use_equilibria(const struct phys_equilibria_settings *s,
                                     struct ad_error *error)
{
    struct phys_equilibria found;
    phys_equilibria_find(&pendulum, s, &found, error);
    phys_equilibria_free(&found);
    return error->status;
}

static void test_motions(void **state)
{
    (void)state;
    wrong = 0;
    TRY(ensemble, use_ensemble, "", (void)s);
    TRY(ensemble, use_ensemble, "size", s.size = 0);
    TRY(ensemble, use_ensemble, "members", s.n = 0);
    TRY(ensemble, use_ensemble, "names", s.names = NULL);
    TRY(ensemble, use_ensemble, "names", s.names = (const char *[]){NULL});
    TRY(ensemble, use_ensemble, "phi", s.names = (const char *[]){"phi"});
    TRY(ensemble, use_ensemble, "values", s.values = NULL);
    TRY(ensemble, use_ensemble, "row 2: theta", s.values = (double[]){1, NAN});
    TRY(ensemble, use_ensemble, "motion", s.motion = NULL);
    TRY(ensemble, use_ensemble, "size", each.size = 0);
    TRY(ensemble, use_ensemble, "time", each.time = 0);
    TRY(ensemble, use_ensemble, "time", each.time = NAN);
    TRY(ensemble, use_ensemble, "time", each.time = INFINITY);
    TRY(ensemble, use_ensemble, "tolerance", each.tolerance = NAN);
    TRY(ensemble, use_ensemble, "tolerance", each.tolerance = -1);
    TRY(ensemble, use_ensemble, "error", each.error = NAN);
    TRY(ensemble, use_ensemble, "error", each.error = -1);
    TRY(periodic, use_periodic, "", (void)s);
    TRY(periodic, use_periodic, "size", s.size = 0);
    TRY(periodic, use_periodic, "x", s.x = NULL);
    TRY(periodic, use_periodic, "x[0]", s.x = (double[]){NAN, 0});
    TRY(periodic, use_periodic, "period", s.period = 0);
    TRY(periodic, use_periodic, "period", s.period = NAN);
    TRY(equilibria, use_equilibria, "", (void)s);
    TRY(equilibria, use_equilibria, "size", s.size = 0);
    TRY(equilibria, use_equilibria, "low", s.high = (double[]){1});
    TRY(equilibria, use_equilibria, "low", s.low = (double[]){1}, s.high = (double[]){1});
    TRY(equilibria, use_equilibria, "low", s.low = (double[]){1}, s.high = (double[]){INFINITY});
    assert_int_equal(wrong, 0);
}

/* ---- networks ---- */

static struct hnn_settings model(void)
{
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    s.hidden[0] = s.hidden[1] = 4;
    return s;
}

static enum ad_status use_model(const struct hnn_settings *s, struct ad_error *error)
{
    hnn_model *m;
    hnn_model_new(s, &m, error);
    hnn_model_free(m);
    return error->status;
}

static ad_var energy(void *context, ad_var w, ad_var at)
{
    (void)context;
    return ad_mul(w, ad_sum_rows(ad_square(at)));
}

static struct hnn_network network;
static struct hnn_settings own(void)
{
    static const double start[] = {1};
    network = (struct hnn_network){.name = "own", .size = 1, .start = start, .record = energy};
    struct hnn_settings s = model();
    s.network = &network;
    return s;
}

static void test_models(void **state)
{
    (void)state;
    wrong = 0;
    TRY(model, use_model, "", (void)s);
    TRY(model, use_model, "size", s.size = 0);
    TRY(model, use_model, "model", s.kind = (enum hnn_kind)3);
    TRY(model, use_model, "model", s.kind = (enum hnn_kind) - 1);
    TRY(model, use_model, "degrees", s.dof = 0);
    TRY(model, use_model, "degrees", s.dof = SIZE_MAX);
    TRY(model, use_model, "layers", s.layers = 0);
    TRY(model, use_model, "layers", s.layers = SIZE_MAX);
    TRY(model, use_model, "hidden", s.hidden[1] = 0);
    TRY(model, use_model, "hidden", s.hidden[0] = SIZE_MAX);
    TRY(model, use_model, "activation", s.activation = NULL);
    TRY(model, use_model, "tanhh", s.activation = "tanhh");
    TRY(model, use_model, "field", s.field = (enum hnn_field_type)3);
    TRY(model, use_model, "precision", s.precision = (enum ad_type)2);
    TRY(model, use_model, "start", s.start = (enum hnn_start)3);
    TRY(model, use_model, "pixels", s.pixels = SIZE_MAX);
    TRY(model, use_model, "autoencoder", s.pixels = 9);
    TRY(model, use_model, "angles", s.angles = 2);
    TRY(own, use_model, "", (void)s);
    TRY(own, use_model, "name", network.name = NULL);
    TRY(own, use_model, "name", network.name = "");
    TRY(own, use_model, "parameters", network.size = 0);
    TRY(own, use_model, "parameters", network.size = SIZE_MAX);
    TRY(own, use_model, "start", network.start = NULL);
    TRY(own, use_model, "starts", network.start = (double[]){NAN});
    TRY(own, use_model, "record", network.record = NULL);
    assert_int_equal(wrong, 0);
}

static struct hnn_training training(void)
{
    struct hnn_training s = hnn_training_defaults();
    s.steps = 1;
    return s;
}

static struct hnn_samples samples;
static enum ad_status use_training(const struct hnn_training *s, struct ad_error *error)
{
    const struct hnn_settings of = model();
    hnn_model *m;
    hnn_trainer *trainer;
    hnn_model_new(&of, &m, error);
    hnn_trainer_new(m, s, &samples, NULL, &trainer, error);
    hnn_trainer_run(trainer, NULL, error);
    hnn_trainer_free(trainer);
    hnn_model_free(m);
    samples = (struct hnn_samples){.n = SAMPLES, .x = x, .target = rates};
    return error->status;
}

static void test_training(void **state)
{
    (void)state;
    wrong = 0;
    TRY(training, use_training, "", (void)s);
    TRY(training, use_training, "size", s.size = 0);
    TRY(training, use_training, "optimiser", s.optimiser = NULL);
    TRY(training, use_training, "schedule", s.schedule = NULL);
    TRY(training, use_training, "steps", s.steps = 0);
    TRY(training, use_training, "batch", s.batch = SAMPLES + 1);
    TRY(training, use_training, "learning rate", s.learning_rate = 0);
    TRY(training, use_training, "learning rate", s.learning_rate = NAN);
    TRY(training, use_training, "weight decay", s.weight_decay = -1);
    TRY(training, use_training, "weight decay", s.weight_decay = NAN);
    TRY(training, use_training, "momentum", s.momentum = NAN);
    TRY(training, use_training, "momentum", s.momentum = 1);
    TRY(training, use_training, "average", s.average = NAN);
    TRY(training, use_training, "average", s.average = 2);
    TRY(training, use_training, "test", s.patience = 1);
    TRY(training, use_training, "time steps", s.rollout = 1);
    TRY(training, use_training, "time steps", s.rollout = 1, s.dt = NAN);
    TRY(training, use_training, "rollout", s.rollout = SIZE_MAX, s.dt = 1);
    TRY(training, use_training, "samples", samples.n = 0);
    TRY(training, use_training, "x", samples.x = NULL);
    TRY(training, use_training, "target", samples.target = NULL);
    assert_int_equal(wrong, 0);
}

static struct hnn_columns memory;
static struct hnn_dataset_settings dataset(void)
{
    static const double *const column[] = {columns[0], columns[1], columns[2], columns[3]};
    memory = (struct hnn_columns){4, SAMPLES, column, NULL};
    return (struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                         .columns = &memory,
                                         .state = "1,2",
                                         .rate = "3,4",
                                         .test_fraction = .2};
}

static enum ad_status use_dataset(const struct hnn_dataset_settings *s, struct ad_error *error)
{
    struct hnn_dataset data;
    hnn_dataset_read(s, &data, error);
    hnn_dataset_free(&data);
    return error->status == AD_E_INPUT ? AD_E_ARGUMENT : error->status;
}

static struct hnn_sampling sampling(void)
{
    struct hnn_sampling s = hnn_task_find("pendulum", &(struct ad_error){0})->published;
    s.trials = 1;
    s.points = 3;
    return s;
}

static enum ad_status use_sampling(const struct hnn_sampling *s, struct ad_error *error)
{
    struct hnn_observations seen;
    hnn_task_observe(hnn_task_find("pendulum", error), s, 0, &seen, error);
    hnn_observations_free(&seen);
    return error->status;
}

static void test_data(void **state)
{
    (void)state;
    wrong = 0;
    TRY(dataset, use_dataset, "", (void)s);
    TRY(dataset, use_dataset, "size", s.size = 0);
    TRY(dataset, use_dataset, "columns", s.columns = NULL);
    TRY(dataset, use_dataset, "column", memory.column = NULL);
    TRY(dataset, use_dataset, "rows", memory.rows = 0);
    TRY(dataset, use_dataset, "columns", memory.n = 0);
    TRY(dataset, use_dataset, "state", s.state = "1");
    TRY(dataset, use_dataset, "state", s.state = "");
    TRY(dataset, use_dataset, "5", s.rate = "3,5");
    TRY(dataset, use_dataset, "differences", s.differences = (enum hnn_differences)2);
    TRY(dataset, use_dataset, "split", s.split = (enum hnn_split)3);
    TRY(dataset, use_dataset, "split", s.split = (enum hnn_split) - 1);
    TRY(dataset, use_dataset, "fraction", s.test_fraction = NAN);
    TRY(dataset, use_dataset, "fraction", s.test_fraction = 1);
    TRY(dataset, use_dataset, "fraction", s.test_fraction = -1);
    TRY(dataset, use_dataset, "time step", s.rate = NULL, s.rollout = 2, s.dt = NAN);
    TRY(dataset, use_dataset, "time step", s.rate = NULL, s.rollout = 2, s.dt = INFINITY);
    TRY(dataset, use_dataset, "time step", s.rate = NULL, s.rollout = 2, s.dt = -1);
    TRY(dataset, use_dataset, "rollout", s.rate = NULL, s.rollout = SIZE_MAX, s.dt = 1);
    TRY(sampling, use_sampling, "", (void)s);
    TRY(sampling, use_sampling, "size", s.size = 0);
    TRY(sampling, use_sampling, "trials", s.trials = 0);
    TRY(sampling, use_sampling, "observations", s.trials = SIZE_MAX);
    TRY(sampling, use_sampling, "points", s.points = 1);
    TRY(sampling, use_sampling, "time", s.time = NAN);
    TRY(sampling, use_sampling, "noise", s.noise = -1);
    TRY(sampling, use_sampling, "noise", s.noise = NAN);
    TRY(sampling, use_sampling, "radius", s.radius_min = NAN);
    TRY(sampling, use_sampling, "radius", s.radius_max = INFINITY);
    TRY(sampling, use_sampling, "spread", s.spread = 1);
    TRY(sampling, use_sampling, "strength", s.strength = 0);
    assert_int_equal(wrong, 0);
}

static struct hnn_rollout_settings rollout(void)
{
    static const double times[] = {0, .5, 1};
    return (struct hnn_rollout_settings){
        .size = sizeof(struct hnn_rollout_settings), .n = 3, .t = times};
}

static enum ad_status use_rollout(const struct hnn_rollout_settings *s, struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct hnn_path path;
    hnn_task_ode(hnn_task_find("pendulum", error), 0, &ode, error);
    hnn_rollout(&ode, s, (double[]){1, 0}, &path, NULL, error);
    hnn_path_free(&path);
    phys_ode_free(&ode);
    return error->status;
}

static struct hnn_trials trials(void)
{
    return (struct hnn_trials){
        .size = sizeof(struct hnn_trials), .starts = 1, .points = 3, .time = 1};
}

static enum ad_status use_trials(const struct hnn_trials *s, struct ad_error *error)
{
    const struct hnn_task *task = hnn_task_find("pendulum", error);
    struct phys_ode ode = {0};
    struct hnn_score score;
    hnn_task_ode(task, 0, &ode, error);
    hnn_task_trials(&ode, task, s, &score, error);
    phys_ode_free(&ode);
    return error->status;
}

static struct hnn_video_settings settings(void)
{
    struct hnn_video_settings s = hnn_video_published();
    s.trajectories = 1;
    s.frames = 3;
    s.height = s.width = 4;
    return s;
}

static enum ad_status use_video(const struct hnn_video_settings *s, struct ad_error *error)
{
    struct hnn_frames frames;
    hnn_rod_video(s, 0, &frames, error);
    hnn_frames_free(&frames);
    return error->status;
}

static const struct phys_integrator *fixed(void)
{
    return phys_integrator_find("rk4", &(struct ad_error){0});
}

static void test_rollouts(void **state)
{
    (void)state;
    wrong = 0;
    TRY(rollout, use_rollout, "", (void)s);
    TRY(rollout, use_rollout, "size", s.size = 0);
    TRY(rollout, use_rollout, "output", s.n = 0);
    TRY(rollout, use_rollout, "s->t", s.t = NULL);
    TRY(rollout, use_rollout, "outputs", s.t = (double[]){0, 1, 1});
    TRY(rollout, use_rollout, "outputs", s.t = (double[]){NAN, 1, 2});
    TRY(rollout, use_rollout, "outputs", s.n = 1, s.t = (double[]){NAN});
    TRY(rollout, use_rollout, "outputs", s.t = (double[]){0, 1, INFINITY});
    TRY(rollout, use_rollout, "dt", s.integrator = fixed());
    TRY(rollout, use_rollout, "dt", s.integrator = fixed(), s.dt = NAN);
    TRY(rollout, use_rollout, "rtol", s.rtol = NAN);
    TRY(rollout, use_rollout, "rtol", s.rtol = -1);
    TRY(rollout, use_rollout, "add", s.add = NAN);
    TRY(rollout, use_rollout, "added", s.add = 1, s.add_at = NAN);
    TRY(rollout, use_rollout, "added", s.add = 1, s.add_at = 2);
    TRY(trials, use_trials, "", (void)s);
    TRY(trials, use_trials, "size", s.size = 0);
    TRY(trials, use_trials, "points", s.points = 1);
    TRY(trials, use_trials, "time", s.time = NAN);
    TRY(trials, use_trials, "time", s.time = -1);
    TRY(trials, use_trials, "strength", s.strength = NAN);
    TRY(trials, use_trials, "strength", s.strength = -1);
    TRY(trials, use_trials, "dt", s.integrator = fixed());
    TRY(trials, use_trials, "rtol", s.rtol = NAN);
    TRY(settings, use_video, "", (void)s);
    TRY(settings, use_video, "size", s.size = 0);
    TRY(settings, use_video, "frames", s.trajectories = 0);
    TRY(settings, use_video, "frames", s.frames = 2);
    TRY(settings, use_video, "pixel", s.height = 0);
    TRY(settings, use_video, "frames", s.trajectories = SIZE_MAX);
    TRY(settings, use_video, "gravity", s.rod.gravity = NAN);
    TRY(settings, use_video, "filter", s.rod.filter = (enum hnn_filter)2);
    assert_int_equal(wrong, 0);
}

/* ---- quantum ---- */

static struct qm_slice slice(void)
{
    return (struct qm_slice){.size = sizeof(struct qm_slice),
                             .system = &free_particle,
                             .grid = {-8, 8, 16},
                             .dt = 1,
                             .hbar = 1};
}

static enum ad_status use_slice(const struct qm_slice *s, struct ad_error *error)
{
    qm_propagator *p;
    qm_propagator_new(&qm_method_kernel, s, &p, error);
    qm_propagator_free(p);
    return error->status;
}

static struct qm_slice of_run;
static struct qm_gaussian packet;
static struct qm_run_settings run(void)
{
    of_run = slice();
    packet = (struct qm_gaussian){0, 1, 0};
    return (struct qm_run_settings){.size = sizeof(struct qm_run_settings),
                                    .slice = &of_run,
                                    .method = &qm_method_kernel,
                                    .steps = 2,
                                    .every = 1,
                                    .packets = 1,
                                    .packet = &packet};
}

static enum ad_status use_run(const struct qm_run_settings *s, struct ad_error *error)
{
    struct qm_run_result result;
    qm_run(s, &result, error);
    qm_run_free(&result);
    return error->status;
}

static struct qm_slit_setup slit(void) { return qm_slit_defaults(); }

static enum ad_status use_slit(const struct qm_slit_setup *s, struct ad_error *error)
{
    struct qm_slit made;
    if (error->status == AD_OK)
        qm_slit_new(s, &made, error);
    qm_slit_free(&made);
    return error->status;
}

static void test_quantum(void **state)
{
    (void)state;
    wrong = 0;
    TRY(slice, use_slice, "", (void)s);
    TRY(slice, use_slice, "size", s.size = 0);
    TRY(slice, use_slice, "system", s.system = NULL);
    TRY(slice, use_slice, "walls", s.walls = (enum qm_walls)3);
    TRY(slice, use_slice, "points", s.grid.n = 0);
    TRY(slice, use_slice, "kernel", s.grid.n = SIZE_MAX);
    TRY(slice, use_slice, "box", s.grid.low = NAN);
    TRY(slice, use_slice, "box", s.grid.high = -8);
    TRY(slice, use_slice, "absorbing", s.absorb = NAN);
    TRY(slice, use_slice, "absorbing", s.absorb = -1);
    TRY(slice, use_slice, "absorbing", s.absorb = 9);
    TRY(slice, use_slice, "dt", s.dt = 0);
    TRY(slice, use_slice, "dt", s.dt = NAN);
    TRY(slice, use_slice, "hbar", s.hbar = 0);
    TRY(slice, use_slice, "hbar", s.hbar = INFINITY);
    TRY(run, use_run, "", (void)s);
    TRY(run, use_run, "size", s.size = 0);
    TRY(run, use_run, "slice", s.slice = NULL);
    TRY(run, use_run, "method", s.method = NULL);
    TRY(run, use_run, "packets", s.packets = 0);
    TRY(run, use_run, "packet", s.packet = NULL);
    TRY(run, use_run, "packets", s.packets = SIZE_MAX);
    TRY(run, use_run, "", s.steps = 0);
    TRY(run, use_run, "steps", s.steps = SIZE_MAX);
    TRY(run, use_run, "every", s.every = 0);
    TRY(run, use_run, "squarings", s.leap = true, s.power = 2000);
    TRY(run, use_run, "packet", packet.sigma = 0);
    TRY(run, use_run, "packet", packet.sigma = NAN);
    TRY(run, use_run, "packet", packet.x = NAN);
    TRY(run, use_run, "packet", packet.p = INFINITY);
    TRY(run, use_run, "dt", of_run.dt = NAN);
    TRY(slit, use_slit, "size", s.size = 0);
    TRY(slit, use_slit, "apart", s.apart = NAN);
    TRY(slit, use_slit, "sigma", s.sigma = 0);
    TRY(slit, use_slit, "speed", s.speed = -1);
    TRY(slit, use_slit, "flight", s.flight = INFINITY);
    TRY(slit, use_slit, "m", s.mass = NAN);
    TRY(slit, use_slit, "hbar", s.hbar = 0);
    TRY(slit, use_slit, "points", s.points = 0);
    TRY(slit, use_slit, "points", s.points = SIZE_MAX);
    TRY(slit, use_slit, "steps", s.steps = 0);
    assert_int_equal(wrong, 0);
}

static int prepare(void **state)
{
    struct ad_error error = {0};
    struct phys_motion_settings how = {
        .size = sizeof how, .time = 2, .n_samples = ROWS, .no_reference = true};
    struct phys_motion_solution m = {0};
    (void)state;
    phys_system_open("pendulum", &pendulum, &error);
    phys_system_open("freebody", &free_particle, &error);
    phys_motion_solve(&pendulum, &how, &m, &error);
    for (int k = 0; k < ROWS && error.status == AD_OK; k++) {
        t[k] = m.t[k];
        for (int i = 0; i < 2; i++)
            motion[2 * k + i] = m.x[2 * k + i];
    }
    phys_motion_solution_free(&m);
    for (int k = 0; k < SAMPLES; k++) {
        columns[0][k] = x[k] = 2 * sin(k);
        columns[1][k] = x[SAMPLES + k] = cos(1.7 * k);
        columns[2][k] = rates[k] = x[SAMPLES + k];
        columns[3][k] = rates[SAMPLES + k] = -sin(x[k]);
    }
    samples = (struct hnn_samples){.n = SAMPLES, .x = x, .target = rates};
    if (error.status != AD_OK)
        print_error("%s\n", error.message);
    return error.status;
}

static int release(void **state)
{
    (void)state;
    phys_system_close(&pendulum);
    phys_system_close(&free_particle);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fit),     cmocka_unit_test(test_motions),
        cmocka_unit_test(test_models),  cmocka_unit_test(test_training),
        cmocka_unit_test(test_data),    cmocka_unit_test(test_rollouts),
        cmocka_unit_test(test_quantum),
    };
    return cmocka_run_group_tests(tests, prepare, release);
}
