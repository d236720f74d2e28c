/* Models with inputs: fields and gradients by differences, motions by hand, files, data. */
#include "tests/hnn/small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/model/exchange.h"
#include "hnn/rollout/rollout.h"
#include "hnn/train/train.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Time, a parameter, a control. */
enum { INPUTS = 3, ROWS = 2 + INPUTS, SAMPLES = 3 };

static struct hnn_settings with_inputs(size_t k)
{
    struct hnn_settings s = small_settings(&small_kinds[k], 1, 3);
    s.inputs = INPUTS;
    s.controls = s.kind != HNN_BASELINE;
    s.time = true;
    return s;
}

static void normalise(hnn_model *model)
{
    struct ad_error error = {0};
    assert_int_equal(hnn_model_normalise(model, (double[]){0.3, -0.2, 1.1, 0.4, 5},
                                         (double[]){1.7, 0.6, 2.3, 0.8, 1.4}, (double[]){0.8, 1.9},
                                         &error),
                     AD_OK);
}

static void check_gradient(const hnn_model *model, const struct hnn_training *training,
                           const char *what)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    size_t rows = hnn_target_rows(model, training), x_rows = hnn_x_rows(model, training);
    ad_var p = ad_input(tape, 1, hnn_model_size(model), "parameters");
    double *states = small_values(5, x_rows, SAMPLES), *targets = small_values(6, rows, SAMPLES);
    ad_var x = ad_const(tape, x_rows, SAMPLES, states);
    ad_var target = ad_const(tape, rows, SAMPLES, targets);
    ad_var loss = ad_mean(hnn_record_losses(model, training, p, x, target));
    struct ad_check report = {0};
    const double *at = hnn_model_parameters(model);
    if (ad_check_gradient(loss, 1, &p, &at, 2e-7, 0, &report) != AD_OK || !report.passed)
        fail_msg("%s: %s; entry %zu: %.12g on the tape, %.12g by differences", what,
                 ad_tape_error(tape)->message, report.col, report.tape, report.difference);
    free(states);
    free(targets);
    ad_tape_free(tape);
}

static void test_gradients(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    training.dt = 0.3;
    for (size_t k = 0; k < small_n_kinds; k++)
        for (size_t how = 0; how < 3; how++) {
            struct hnn_settings s = with_inputs(k);
            hnn_model *model = small_model(&s);
            training.rollout = how;
            training.hold = how == 2;
            if (how)
                normalise(model);
            check_gradient(model, &training, small_kinds[k].name);
            hnn_model_free(model);
        }
}

static double energy_at(hnn_model *model, const double *x, size_t row, double by)
{
    double moved[ROWS];
    memcpy(moved, x, sizeof moved);
    moved[row] += by;
    return hnn_model_energy(model, moved);
}

static double slope(hnn_model *model, const double *x, size_t row)
{
    double h = 1e-4;
    return (8 * (energy_at(model, x, row, h) - energy_at(model, x, row, -h)) -
            (energy_at(model, x, row, 2 * h) - energy_at(model, x, row, -2 * h))) /
           (12 * h);
}

static double matrix_of_controls(const hnn_model *model)
{
    size_t n;
    const struct hnn_block *b = hnn_model_blocks(model, &n) + n - 1;
    assert_string_equal(b->name, "control.linear1.weight");
    return ((const double *)hnn_model_parameters(model))[b->offset];
}

/* (H_p, -H_q + G u): H depends on time and parameter, and not on the control. */
static void test_hamiltonian_field(void **state)
{
    (void)state;
    static const double x[ROWS] = {0.4, -0.7, 0.9, 0.2, 1.3};
    for (int how = 0; how < 4; how++) {
        struct hnn_settings s = with_inputs(how % 2 ? 4 : 1);
        hnn_model *model = small_model(&s);
        double unit = 1, rate[2];
        if (how >= 2) {
            normalise(model);
            unit = 1.9 / 1.4;
        }
        assert_int_equal(hnn_model_field(model, x, rate), AD_OK);
        assert_close(rate[0], slope(model, x, 1), 1e-9, 1e-10);
        assert_close(rate[1], -slope(model, x, 0) + matrix_of_controls(model) * unit * x[4], 1e-9,
                     1e-10);
        assert_true(fabs(slope(model, x, 2)) > 1e-3 && fabs(slope(model, x, 3)) > 1e-3);
        assert_true(slope(model, x, 4) == 0);
        hnn_model_free(model);
    }
}

/* Output k of the network "control." at what it sees, from its parameters; tanh, 7 and 5 units. */
static double matrix_at(const hnn_model *model, const double *sees, size_t k)
{
    size_t n, from = 0;
    const struct hnn_block *b = hnn_model_blocks(model, &n);
    const double *values = hnn_model_parameters(model);
    double layer[2][8] = {{0}}, *in = layer[0], *out = layer[1];
    while (strncmp(b[from].name, "control.", 8) != 0)
        from++;
    memcpy(in, sees, b[from].cols * sizeof *in);
    for (size_t l = from; l < n; l += 2) {
        for (size_t i = 0; i < b[l].rows; i++) {
            out[i] = 0;
            for (size_t j = 0; j < b[l].cols; j++)
                out[i] += values[b[l].offset + i * b[l].cols + j] * in[j];
            if (l + 1 < n)
                out[i] = tanh(out[i] + values[b[l + 1].offset + i]);
        }
        double *kept = in;
        in = out;
        out = kept;
    }
    return in[k];
}

/* dp_i/dt = ... + sum_j G_ij(q, t, parameter) u_j: two coordinates, two controls. */
static void test_control_network(void **state)
{
    (void)state;
    enum { DOF = 2, M = 4 };
    static const double centre[] = {0.3, -0.2, 0.1, 0.4, 1.1, 0.4, 5, 2},
                        scale[] = {1.7, 0.6, 0.9, 1.2, 2.3, 0.8, 1.4, 0.7},
                        rate[] = {0.8, 1.9, 1.3, 0.7},
                        x[] = {0.4, -0.7, 0.5, 0.3, 0.9, 0.2, 1.3, -0.6};
    for (size_t k = 0; k < small_n_kinds; k++) {
        struct ad_error error = {0};
        struct hnn_settings s = small_settings(&small_kinds[k], DOF, 3);
        if (s.kind == HNN_BASELINE)
            continue;
        s.inputs = M;
        s.controls = 2;
        s.time = s.control_network = true;
        hnn_model *model = small_model(&s);
        struct hnn_training training = hnn_training_defaults();
        check_gradient(model, &training, small_kinds[k].name);
        assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
        double with[2 * DOF], without[2 * DOF], free_x[2 * DOF + M], sees[6];
        memcpy(free_x, x, sizeof x);
        free_x[6] = free_x[7] = 0;
        assert_int_equal(hnn_model_field(model, x, with), AD_OK);
        assert_int_equal(hnn_model_field(model, free_x, without), AD_OK);
        size_t n = 0;
        for (size_t r = 0; r < DOF; r++)
            sees[n++] = s.angles >> r & 1 ? sin(x[r]) : (x[r] - centre[r]) / scale[r];
        if (s.angles & 1)
            sees[n++] = cos(x[0]);
        for (size_t r = 4; r < 6; r++)
            sees[n++] = (x[r] - centre[r]) / scale[r];
        for (size_t i = 0; i < DOF && s.kind == HNN_HAMILTONIAN; i++) {
            double push = matrix_at(model, sees, 2 * i) * x[6] / 1.4 +
                          matrix_at(model, sees, 2 * i + 1) * x[7] / 0.7;
            assert_close(with[DOF + i] - without[DOF + i], rate[DOF + i] * push, 1e-12, 1e-12);
            assert_true(with[i] == without[i]);
        }
        struct path h5 = files_temporary("steered.h5"), tensors = files_temporary("s.safetensors");
        hnn_model *other[2];
        struct hnn_exchange exchange;
        struct hnn_settings any = hnn_defaults(HNN_HAMILTONIAN, 1);
        assert_int_equal(hnn_model_save(model, h5.text, NULL, &error), AD_OK);
        assert_int_equal(hnn_model_export(model, tensors.text, &error), AD_OK);
        assert_int_equal(hnn_model_load(h5.text, &other[0], &error), AD_OK);
        assert_int_equal(hnn_model_import(tensors.text, &any, &other[1], &exchange, &error), AD_OK);
        for (size_t i = 0; i < 2; i++) {
            assert_int_equal(hnn_model_field(other[i], x, without), AD_OK);
            assert_memory_equal(with, without, sizeof with);
            hnn_model_free(other[i]);
        }
        hnn_model_free(model);
    }
    struct ad_error error = {0};
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model;
    s.control_network = true;
    assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "controls");
}

static double L_at(const hnn_model *model, const double *x, size_t row, double by, size_t other,
                   double and_by)
{
    double moved[ROWS], value;
    memcpy(moved, x, sizeof moved);
    moved[row] += by;
    moved[other] += and_by;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var w = ad_const(tape, 1, hnn_model_size(model), hnn_model_parameters(model));
    ad_var L = hnn_record_L(model, w, ad_const(tape, ROWS, 1, moved));
    ad_program *program;
    assert_int_equal(ad_compile(tape, 1, &L, &program), AD_OK);
    ad_run(program);
    ad_get(program, L, &value);
    ad_program_free(program);
    ad_tape_free(tape);
    return value;
}

static double second(const hnn_model *model, const double *x, size_t i, size_t j)
{
    double h = 1e-3;
    return (L_at(model, x, i, h, j, h) - L_at(model, x, i, h, j, -h) - L_at(model, x, i, -h, j, h) +
            L_at(model, x, i, -h, j, -h)) /
           (4 * h * h);
}

/* L_vv a + L_vq v + L_vt = L_q + G u. */
static void test_lagrangian_field(void **state)
{
    (void)state;
    static const double x[ROWS] = {0.4, -0.7, 0.9, 0.2, 1.3};
    for (size_t k = 7; k < small_n_kinds; k++)
        if (small_kinds[k].kind == HNN_LAGRANGIAN) {
            struct hnn_settings s = with_inputs(k);
            hnn_model *model = small_model(&s);
            double rate[2], h = 1e-5;
            assert_int_equal(hnn_model_field(model, x, rate), AD_OK);
            double L_q = (L_at(model, x, 0, h, 0, 0) - L_at(model, x, 0, -h, 0, 0)) / (2 * h);
            double L_vt = second(model, x, 1, 2);
            assert_true(fabs(L_vt) > 1e-3);
            assert_true(rate[0] == x[1]);
            assert_close(second(model, x, 1, 1) * rate[1] + second(model, x, 1, 0) * x[1] + L_vt,
                         L_q + matrix_of_controls(model) * x[4], 1e-5, 0);
            hnn_model_free(model);
        }
}

/* q' = p, p' = u - q: rows of a baseline of one map are q, u, p. */
static hnn_model *oscillator(bool time)
{
    struct hnn_settings s = hnn_defaults(HNN_BASELINE, 1);
    s.layers = 1;
    s.precision = AD_F64;
    s.inputs = 1;
    s.time = time;
    hnn_model *model = small_model(&s);
    hnn_model_set_parameters(model, (double[]){0, 0, 1, -1, 1, 0});
    return model;
}

/* u = t from tables, linear between 5 rows: q = t - sin t; held: from row to row a circle about u.
 */
static void test_motion_by_table(void **state)
{
    (void)state;
    double rows[5] = {0, 0.5, 1, 2, 3}, t[2] = {0, 3}, x0[2] = {0, 0};
    struct hnn_path table = {.n = 5, .t = rows, .inputs = 1, .u = rows};
    for (int how = 0; how < 3; how++) {
        hnn_model *model = oscillator(how == 2);
        struct hnn_inputs inputs = {.n = 1, .table = &table, .hold = how == 1};
        inputs.input[0].source = HNN_INPUT_COLUMN;
        struct hnn_drive drive = {hnn_inputs_at, &inputs, hnn_inputs_constant(&inputs, 1), NULL};
        struct ad_error error = {0};
        struct phys_ode ode;
        struct hnn_path path;
        assert_false(drive.constant);
        if (how < 2) {
            assert_int_equal(hnn_model_ode(model, &ode, &error), AD_E_ARGUMENT);
            assert_mentions(error.message, "u1");
            error = (struct ad_error){0};
            hnn_model_drive(model, &drive);
        }
        assert_false(hnn_model_conserves(model));
        assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
        struct hnn_rollout_settings s = {
            .size = sizeof s, .n = 2, .t = t, .rtol = how == 1 ? 1e-6 : 1e-10};
        if (hnn_rollout(&ode, &s, x0, &path, NULL, &error) != AD_OK)
            fail_msg("%s", error.message);
        double q = 3 - sin(3), p = 1 - cos(3);
        for (size_t k = how == 1 ? 0 : 5; k < 4; k++) {
            double dt = rows[k + 1] - rows[k], d = k ? q - rows[k] : 0, v = k ? p : 0;
            q = rows[k] + d * cos(dt) + v * sin(dt);
            p = v * cos(dt) - d * sin(dt);
        }
        assert_close(path.x[2], q, how == 1 ? 1e-4 : 1e-8, 0);
        assert_close(path.x[3], p, how == 1 ? 1e-4 : 1e-8, 0);
        hnn_path_free(&path);
        t[1] = 3.5;
        if (how < 2)
            assert_int_equal(hnn_rollout(&ode, &s, x0, &path, NULL, &error), AD_E_INPUT);
        t[1] = 3;
        hnn_model_free(model);
    }
}

/* The loss on rollouts of that motion is 0 for inputs that are linear, and not for held ones; a
   time is never held. */
static void test_rollout_losses(void **state)
{
    (void)state;
    enum { K = 2 };
    double x[2 + K + 1], target[2 * K] = {0}, steps[K] = {0.02, 0.03}, t = 1;
    for (size_t k = 0; k <= K; k++) {
        double *at = k ? target + 2 * (k - 1) : x;
        at[0] = t - sin(t);
        at[1] = 1 - cos(t);
        x[2 + k] = t;
        t += k < K ? steps[k] : 0;
    }
    struct hnn_samples samples = {.n = 1, .x = x, .target = target, .steps = steps};
    for (int how = 0; how < 6; how++) {
        hnn_model *model = oscillator(how >= 4);
        struct hnn_training training = hnn_training_defaults();
        training.rollout = K;
        training.hold = how % 2;
        training.stepping = how == 2 || how == 3 ? HNN_MIDPOINT : HNN_RUNGE_KUTTA;
        hnn_trainer *trainer = small_trainer(model, &training, &samples, &small_none);
        double loss = hnn_trainer_train_loss(trainer), size = how == 2 ? 1e-11 : 1e-18;
        assert_true(how == 1 || how == 3 ? loss > 1e-9 : loss < size);
        hnn_trainer_free(trainer);
        hnn_model_free(model);
    }
}

/* Files of both kinds return the same model. */
static void test_files(void **state)
{
    (void)state;
    static const double x[ROWS] = {0.4, -0.7, 0.9, 0.2, 1.3};
    for (size_t k = 0; k < small_n_kinds; k++)
        for (int kind = 0; kind < 2; kind++) {
            struct path file = files_temporary(kind ? "m.safetensors" : "m.h5");
            struct hnn_settings s = with_inputs(k);
            hnn_model *model = small_model(&s), *other = NULL;
            struct ad_error error = {0};
            double a[2], b[2], *seen = small_values(3, ROWS, 4);
            normalise(model);
            hnn_model_note(model, "inputs", "t,g,u", &error);
            assert_int_equal(hnn_model_see(model, 4, seen, &error), AD_OK);
            if (kind) {
                struct hnn_exchange exchange = {0};
                assert_int_equal(hnn_model_export(model, file.text, &error), AD_OK);
                hnn_model_import(file.text, &s, &other, &exchange, &error);
            } else {
                assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
                hnn_model_load(file.text, &other, &error);
            }
            if (error.status != AD_OK)
                fail_msg("%s", error.message);
            assert_int_equal(hnn_model_field(model, x, a), AD_OK);
            assert_int_equal(hnn_model_field(other, x, b), AD_OK);
            assert_memory_equal(a, b, sizeof a);
            assert_memory_equal(hnn_model_range(model).low, hnn_model_range(other).low,
                                2 * (ROWS + 1) * sizeof(double));
            char name[16];
            hnn_model_input(other, 1, name, sizeof name);
            assert_string_equal(name, "g");
            free(seen);
            hnn_model_free(model);
            hnn_model_free(other);
        }
}
static void test_settings(void **state)
{
    (void)state;
    struct hnn_settings timed = with_inputs(1);
    hnn_model *flat = small_model(&timed);
    struct ad_error refused = {0};
    assert_int_equal(hnn_model_normalise(flat, (double[ROWS]){0}, (double[]){1, 1, 1, 0, 1},
                                         (double[]){1, 1}, &refused),
                     AD_E_ARGUMENT);
    assert_mentions(refused.message, "input 2 0");
    hnn_model_free(flat);
    static const struct {
        enum hnn_kind kind;
        size_t inputs, controls, pixels;
        bool time;
    } wrong[] = {
        {HNN_HAMILTONIAN, 33, 0, 0, false}, {HNN_HAMILTONIAN, 1, 2, 0, false},
        {HNN_HAMILTONIAN, 1, 1, 0, true},   {HNN_HAMILTONIAN, 0, 0, 0, true},
        {HNN_HAMILTONIAN, 1, 0, 8, false},  {HNN_BASELINE, 1, 1, 0, false},
    };
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct hnn_settings s = hnn_defaults(wrong[k].kind, 1);
        s.inputs = wrong[k].inputs;
        s.controls = wrong[k].controls;
        s.pixels = wrong[k].pixels;
        s.autoencoder = 4;
        s.time = wrong[k].time;
        struct ad_error error = {0};
        hnn_model *model;
        assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradients),       cmocka_unit_test(test_hamiltonian_field),
        cmocka_unit_test(test_control_network), cmocka_unit_test(test_lagrangian_field),
        cmocka_unit_test(test_motion_by_table), cmocka_unit_test(test_rollout_losses),
        cmocka_unit_test(test_files),           cmocka_unit_test(test_settings),
    };
    return cmocka_run_group_tests_name("inputs", tests, files_setup, files_teardown);
}
