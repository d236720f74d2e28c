/* Settings of networks, their training, data and rollouts (test_settings.c). */
#include "hnn/data/data.h"
#include "hnn/pixels/pixels.h"
#include "hnn/rollout/rollout.h"
#include "physics/physics.h"
#include "tests/contract/settings.h"

#include <math.h>

enum { SAMPLES = 20 };
static double columns[4][SAMPLES], x[2 * SAMPLES], rates[2 * SAMPLES];

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
    TRY(model, use_model, "model", s.kind = (enum hnn_kind)(HNN_SYMPNET + 1));
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

static int prepare(void **state)
{
    (void)state;
    for (int k = 0; k < SAMPLES; k++) {
        columns[0][k] = x[k] = 2 * sin(k);
        columns[1][k] = x[SAMPLES + k] = cos(1.7 * k);
        columns[2][k] = rates[k] = x[SAMPLES + k];
        columns[3][k] = rates[SAMPLES + k] = -sin(x[k]);
    }
    samples = (struct hnn_samples){.n = SAMPLES, .x = x, .target = rates};
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_models),
        cmocka_unit_test(test_training),
        cmocka_unit_test(test_data),
        cmocka_unit_test(test_rollouts),
    };
    return cmocka_run_group_tests(tests, prepare, NULL);
}
