/* Lagrangian models: accelerations against a closed form, what cannot be learnt from, a spring
   learnt, angles. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/rollout/rollout.h"

#include <stdlib.h>

/* ---- accelerations ---- */

/* What the double pendulum's L has beyond |v|^2/2; the parameter is g. */
static ad_var double_pendulum(void *context, ad_var parameters, ad_var x)
{
    (void)context;
    ad_var a = ad_row(x, 0), b = ad_row(x, 1), va = ad_row(x, 2), vb = ad_row(x, 3);
    ad_var cross = ad_mul(ad_mul(va, vb), ad_cos(ad_sub(a, b)));
    ad_var heights = ad_add(ad_mul(2.0, ad_cos(a)), ad_cos(b));
    return ad_add(ad_add(ad_mul(0.5, ad_square(va)), cross), ad_mul(parameters, heights));
}

static void test_double_pendulum(void **state)
{
    (void)state;
    enum { N = 7 };
    static const double g = 9.8;
    const struct hnn_network network = {
        .name = "double pendulum", .size = 1, .start = &g, .record = double_pendulum};
    struct ad_error error = {0};
    struct hnn_settings s = hnn_defaults(HNN_LAGRANGIAN, 2);
    s.precision = AD_F64;
    s.network = &network;
    hnn_model *model = small_model(&s);
    const struct hnn_task *task = hnn_task_find("double-pendulum", &error);
    struct phys_ode truth, ode;
    assert_int_equal(hnn_task_ode(task, 0, &truth, &error), AD_OK);
    assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
    assert_false(ode.canonical);
    double *x = small_values(3, 4, N), rates[4 * N], energy[N];
    assert_int_equal(hnn_model_evaluate(model, N, x, rates, energy, &error), AD_OK);
    for (size_t k = 0; k < N; k++) {
        double y[4], rate[4], one[4];
        for (size_t r = 0; r < 4; r++)
            y[r] = x[r * N + k];
        assert_int_equal(truth.field(truth.context, 0, y, rate, &error), AD_OK);
        assert_int_equal(ode.field(ode.context, 0, y, one, &error), AD_OK);
        for (size_t r = 0; r < 4; r++) {
            assert_close(rates[r * N + k], rate[r], 1e-12, 1e-12);
            assert_close(one[r], rate[r], 1e-12, 1e-12);
        }
        assert_close(energy[k], truth.energy(truth.context, 0, y), 1e-12, 1e-12);
    }
    free(x);
    phys_ode_free(&truth);
    phys_ode_free(&ode);
    hnn_model_free(model);
}

/* The task itself against the scene's Lagrangian, another code and other formulas. */
static void test_task_and_scene(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_system system;
    struct phys_ode scene, task;
    double y[4], a[4], b[4];
    assert_int_equal(phys_system_open("dblpend", &system, &error), AD_OK);
    assert_int_equal(phys_system_set(&system, "g", 9.8, &error), AD_OK);
    assert_int_equal(phys_ode_lagrangian(&system, &scene, &error), AD_OK);
    assert_int_equal(hnn_task_ode(hnn_task_find("double-pendulum", &error), 0, &task, &error),
                     AD_OK);
    for (uint64_t seed = 0; seed < 5; seed++) {
        hnn_task_start(hnn_task_find("double-pendulum", &error), 0, seed, y);
        assert_true(y[0] >= 0 && y[0] < 6.2832 && y[2] >= -10 && y[2] < 10);
        assert_int_equal(scene.field(scene.context, 0, y, a, &error), AD_OK);
        assert_int_equal(task.field(task.context, 0, y, b, &error), AD_OK);
        for (size_t k = 0; k < 4; k++)
            assert_close(b[k], a[k], 1e-11, 1e-11);
        assert_close(task.energy(task.context, 0, y), scene.energy(scene.context, 0, y), 1e-12,
                     1e-12);
    }
    phys_ode_free(&scene);
    phys_ode_free(&task);
    phys_system_close(&system);
}

/* ---- what cannot be learnt from ---- */

/* L = w q v^2/2: L_vv = w q. */
static ad_var crossing(void *context, ad_var parameters, ad_var x)
{
    (void)context;
    ad_var q = ad_row(x, 0), v2 = ad_mul(0.5, ad_square(ad_row(x, 1)));
    return ad_mul(ad_sub(ad_mul(parameters, q), 1), v2);
}

static void test_singular_mass(void **state)
{
    (void)state;
    enum { N = 4 };
    static const double one = 1, x[2 * N] = {1.5, 0.25, 0, -0.5, 1, -1, 2, 1},
                        target[2 * N] = {1, -1, 2, 1, 0, 0, 0, 0};
    const struct hnn_network network = {
        .name = "crossing", .size = 1, .start = &one, .record = crossing};
    struct hnn_settings s = hnn_defaults(HNN_LAGRANGIAN, 1);
    s.precision = AD_F64;
    s.network = &network;
    hnn_model *model = small_model(&s);
    struct ad_error error = {0};
    struct hnn_mass mass;
    assert_int_equal(hnn_model_mass(model, N, x, &mass, &error), AD_OK);
    assert_true(isinf(mass.condition));
    assert_int_equal(mass.worst, 2);
    assert_int_equal(mass.negative_least, 0);
    assert_int_equal(mass.negative_most, 1);
    for (size_t batch = 0; batch < 4; batch += 3) { /* all, and drawn */
        const struct hnn_samples samples = {.n = N, .x = x, .target = target};
        struct hnn_training training = hnn_training_defaults();
        training.batch = batch;
        hnn_trainer *trainer = small_trainer(model, &training, &samples, NULL);
        enum hnn_stop stop;
        assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_E_NONFINITE);
        assert_mentions(error.message, "sample 3");
        assert_mentions(error.message, batch ? "step" : "step 1");
        assert_true(*(const double *)hnn_model_parameters(model) == 1);
        hnn_trainer_free(trainer);
        error = (struct ad_error){0};
    }
    double rate[2] = {0};
    struct phys_ode ode;
    assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
    assert_int_equal(ode.field(ode.context, 0, (double[]){0, 1}, rate, &error), AD_E_NONFINITE);
    assert_mentions(error.message, "v1");
    hnn_model_free(model);
}

/* Columns v = m dq/dt + a q + c for m = 1, a = c = 0, with noise in either, and for others. */
static void test_momenta(void **state)
{
    (void)state;
    enum { N = 400 };
    enum kind { RATES, DIFFERENCES, ROLLOUT };
    static const struct {
        double mass, noise_v, noise_rate, share_q, constant;
        enum kind kind;
        bool refused;
    } row[] = {
        {1, 0, 0, 0, 0, RATES, false},       {1, 0.4, 0, 0, 0, RATES, false},
        {1, 0, 0.4, 0, 0, RATES, false},     {2, 0, 0, 0, 0, RATES, true},
        {0.5, 0, 0, 0, 0, RATES, true},      {-1, 0, 0, 0, 0, RATES, true},
        {1.3, 0.1, 0, 0, 0, RATES, true},    {1, 0, 0, 0, 0, ROLLOUT, false},
        {2, 0, 0, 0, 0, ROLLOUT, true},      {1, 0, 0, 0.3, 0, RATES, true},
        {1, 0.1, 0, 0.3, 0, RATES, true},    {1, 0, 0, -0.3, 0, ROLLOUT, true},
        {1, 0, 0.1, 0, 0.2, RATES, true},    {1, 0, 0, 0.01, 0.01, RATES, false},
        {1, 0, 0, 0, 0, DIFFERENCES, false}, {1, 0, 0, 0.3, 0, DIFFERENCES, true},
        {0, 0, 0, 0, 0, RATES, true},        {0, 0, 0, 0, 0, ROLLOUT, true},
    };
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        double *x = small_values(5, 2, N), *target = malloc(2 * N * sizeof *target);
        double *noise = small_values(6, 1, N), steps[N];
        const double dt = 0.3, m = row[k].mass, a = row[k].share_q, c = row[k].constant;
        for (size_t i = 0; i < N; i++) {
            double q = x[i], v = x[N + i];
            x[N + i] = m * v + a * q + c + row[k].noise_v * noise[i];
            target[i] = v + row[k].noise_rate * noise[i];
            target[N + i] = a * v - m * q;
            steps[i] = dt;
            if (row[k].kind == RATES)
                continue;
            target[i] = q * cos(dt) + v * sin(dt);
            target[N + i] = m * (v * cos(dt) - q * sin(dt)) + a * target[i] + c;
            for (size_t r = 0; row[k].kind == DIFFERENCES && r < 2; r++)
                target[r * N + i] = (target[r * N + i] - x[r * N + i]) / dt;
        }
        struct hnn_settings s = small_settings(&small_kinds[7], 1, 3);
        assert_int_equal(s.kind, HNN_LAGRANGIAN);
        hnn_model *model = small_model(&s);
        struct hnn_training training = hnn_training_defaults();
        training.rollout = row[k].kind == ROLLOUT;
        training.dt = dt;
        const struct hnn_samples samples = {
            .n = N, .x = x, .target = target, .steps = row[k].kind == RATES ? NULL : steps};
        struct ad_error error = {0};
        hnn_trainer *trainer;
        enum ad_status status = hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error);
        if ((status == AD_E_ARGUMENT) != row[k].refused)
            fail_msg("row %zu: %s", k, error.message);
        if (row[k].refused)
            assert_mentions(error.message, "v1");
        hnn_trainer_free(trainer);
        hnn_model_free(model);
        free(x);
        free(noise);
        free(target);
    }
}

static void test_refused_settings(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k++) {
        struct hnn_settings s = hnn_defaults(HNN_LAGRANGIAN, k == 0 ? 33 : 2);
        struct ad_error error = {0};
        hnn_model *model;
        s.separable = k == 1;
        s.dissipation = k == 2;
        s.pixels = k == 3 ? 9 : 0;
        s.autoencoder = 5;
        s.activation = k == 4 ? "relu" : s.activation;
        s.angles = k == 5 ? 4 : 0; /* of a third coordinate */
        assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
        assert_null(model);
    }
}

/* ---- learning ---- */

/* q'' = -q from 200 states: accelerations of unseen states, and the energy of a motion. */
static void test_spring(void **state)
{
    (void)state;
    enum { N = 200, POINTS = 51 };
    double *x = small_values(1, 2, N), *target = malloc(2 * N * sizeof *target);
    for (size_t i = 0; i < N; i++) {
        target[i] = x[N + i];
        target[N + i] = -x[i];
    }
    struct hnn_settings s = hnn_defaults(HNN_LAGRANGIAN, 1);
    s.hidden[0] = s.hidden[1] = 16;
    s.precision = AD_F64;
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.optimiser = hnn_optimiser_find("lbfgs", &(struct ad_error){0});
    training.steps = 150;
    training.weight_decay = 0;
    const struct hnn_samples samples = {.n = N, .x = x, .target = target};
    hnn_trainer *trainer = small_trainer(model, &training, &samples, NULL);
    small_run(trainer);
    double *unseen = small_values(2, 2, 20), rate[2], worst = 0, t[POINTS];
    for (size_t i = 0; i < 20; i++) {
        assert_int_equal(hnn_model_field(model, (double[]){unseen[i], unseen[20 + i]}, rate),
                         AD_OK);
        assert_true(rate[0] == unseen[20 + i]);
        worst = fmax(worst, fabs(rate[1] + unseen[i]));
    }
    assert_true(worst < 1e-2);
    struct ad_error error = {0};
    struct hnn_mass mass;
    assert_int_equal(hnn_model_mass(model, N, x, &mass, &error), AD_OK);
    assert_close(mass.condition, 1, 1e-12, 0);
    assert_int_equal(mass.negative_least, mass.negative_most);
    struct phys_ode ode;
    struct hnn_path path = {0};
    hnn_times(0, 20, POINTS, t);
    const struct hnn_rollout_settings rollout = {.size = sizeof rollout, .n = POINTS, .t = t};
    assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
    assert_int_equal(hnn_rollout(&ode, &rollout, (double[]){1, 0}, &path, NULL, &error), AD_OK);
    assert_true(hnn_energy_drift(&ode, &path, &rollout) < 1e-7);
    for (size_t i = 0; i < POINTS; i++) {
        const double *y = path.x + 2 * i;
        assert_close(y[0] * y[0] + y[1] * y[1], 1, 0, 1e-2);
        assert_close(y[0], cos(t[i]), 0, 5e-2);
    }
    hnn_path_free(&path);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    free(unseen);
    free(x);
    free(target);
}

/* ---- angles ---- */

/* The field has the angle's period, also after a file; other coordinates have none. */
static void test_angles(void **state)
{
    (void)state;
    static const double turn = 6.283185307179586, one[4] = {1, 1, 1, 1}, zero[4] = {0.2, 0.3, 0, 1},
                        seen[8] = {0.7, 1.2, -0.4, 0.1, 0.3, -0.2, 1.1, 0.6};
    for (size_t k = 8; k <= 10; k++) {
        struct hnn_settings s = small_settings(&small_kinds[k], 2, 3);
        struct path file = files_temporary("angles.h5");
        struct ad_error error = {0};
        double x[4] = {0.7, -0.4, 0.3, 1.1}, a[4], b[4];
        hnn_model *model = small_model(&s), *loaded;
        assert_int_equal(hnn_model_normalise(model, zero, one, one, &error), AD_OK);
        assert_int_equal(hnn_model_see(model, 2, seen, &error), AD_OK);
        assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
        assert_int_equal(hnn_model_load(file.text, &loaded, &error), AD_OK);
        assert_int_equal(hnn_model_settings(loaded)->angles, 1);
        assert_int_equal(hnn_model_field(model, x, a), AD_OK);
        x[0] += 3 * turn;
        assert_int_equal(hnn_model_field(loaded, x, b), AD_OK);
        for (size_t i = 0; i < 4; i++)
            assert_close(b[i], a[i], 1e-12, 1e-13);
        char what[120];
        double t = 0;
        struct hnn_path path = {.states = 4, .n = 1, .t = &t, .x = x};
        assert_int_equal(hnn_path_outside(loaded, &path, what, sizeof what),
                         1); /* a turn is none */
        x[1] += turn;
        assert_int_equal(hnn_path_outside(loaded, &path, what, sizeof what), 0);
        assert_int_equal(hnn_model_field(loaded, x, b), AD_OK);
        assert_true(fabs(b[3] - a[3]) > 1e-6);
        hnn_model_free(model);
        hnn_model_free(loaded);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_double_pendulum),  cmocka_unit_test(test_task_and_scene),
        cmocka_unit_test(test_singular_mass),    cmocka_unit_test(test_momenta),
        cmocka_unit_test(test_refused_settings), cmocka_unit_test(test_spring),
        cmocka_unit_test(test_angles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
