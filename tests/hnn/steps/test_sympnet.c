/* SympNets: J^T Omega J = Omega, the inverse, the map by hand, gradients, files, motions, and that
   nothing takes one for a field. */
#include "tests/hnn/small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/model/exchange.h"
#include "hnn/rollout/rollout.h"
#include "hnn/train/train.h"

#include <stdlib.h>
#include <string.h>

enum { DOF = 3, STATES = 2 * DOF, WIDTH = 5, MODULES = 4 };

static hnn_model *make(size_t dof, bool normalised, const char *activation)
{
    static const double centre[STATES] = {0.3, -0.2, 0.1, 0.05, 1, -2},
                        scale[STATES] = {1.7, 0.6, 0.9, 2.1, 11, 0.3},
                        rate[STATES] = {0.8, 1.9, 1.1, 0.7, 2, 3};
    struct hnn_settings s = hnn_defaults(HNN_SYMPNET, dof);
    struct ad_error error = {0};
    s.layers = MODULES;
    for (size_t k = 0; k + 1 < MODULES; k++)
        s.hidden[k] = WIDTH;
    s.activation = activation;
    s.precision = AD_F64;
    s.seed = 3;
    hnn_model *model = small_model(&s);
    if (normalised)
        assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
    return model;
}

/* State [2n] and its Jacobian [2n x 2n] after the map. */
static void map(const hnn_model *model, const double *x0, double dt, bool back, double *x,
                double *J)
{
    size_t n = 2 * hnn_model_settings(model)->dof;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var w = ad_const(tape, 1, hnn_model_size(model), hnn_model_parameters(model));
    ad_var in = ad_input(tape, n, 1, "x"), out[STATES + 1];
    out[0] = ad_mul(1.0, hnn_record_map(model, w, in, ad_const(tape, 1, 1, &dt), back));
    for (size_t k = 0; k < n; k++) {
        ad_var row = ad_row(out[0], k), by;
        ad_grad(row, 1, &in, &by);
        out[k + 1] = by;
    }
    ad_program *program;
    assert_int_equal(ad_compile(tape, n + 1, out, &program), AD_OK);
    ad_set(program, in, x0);
    ad_run(program);
    ad_get(program, out[0], x);
    for (size_t k = 0; k < n && J; k++)
        ad_get(program, out[k + 1], J + k * n);
    ad_program_free(program);
    ad_tape_free(tape);
}

static double omega(size_t i, size_t j) { return j == i + DOF ? 1 : i == j + DOF ? -1 : 0; }

static void test_symplectic_and_inverse(void **state)
{
    (void)state;
    static const double x0[STATES] = {0.4, -0.7, 0.9, 0.2, 1.3, -1.6};
    static const char *const activations[] = {"tanh", "sigmoid", "relu"};
    for (int how = 0; how < 6; how++) {
        hnn_model *model = make(DOF, how % 2, activations[how / 2]);
        double x[STATES], J[STATES * STATES], again[STATES], moved = 0;
        map(model, x0, 0.7, false, x, J);
        for (size_t i = 0; i < STATES; i++)
            for (size_t j = 0; j < STATES; j++) {
                double sum = 0, size = 0;
                for (size_t k = 0; k < DOF; k++) {
                    double a = J[k * STATES + i] * J[(k + DOF) * STATES + j];
                    double b = J[(k + DOF) * STATES + i] * J[k * STATES + j];
                    sum += a - b;
                    size += fabs(a) + fabs(b);
                }
                assert_true(fabs(sum - omega(i, j)) < 1e-13 * fmax(1, size));
            }
        map(model, x, 0.7, true, again, NULL);
        for (size_t k = 0; k < STATES; k++) {
            assert_close(again[k], x0[k], 1e-12, 1e-13);
            moved = fmax(moved, fabs(x[k] - x0[k]));
        }
        assert_true(moved > 0.1);
        hnn_model_free(model);
    }
}

/* Of one coordinate, by the formula. */
static void test_map_by_hand(void **state)
{
    (void)state;
    hnn_model *model = make(1, false, "tanh");
    const double *w = hnn_model_parameters(model);
    double half[2] = {0.4, -0.7}, x[2], dt = 0.3;
    for (size_t k = 0; k < MODULES; k++, w += 3 * WIDTH) {
        double sum = 0;
        for (size_t i = 0; i < WIDTH; i++)
            sum += w[i] * w[2 * WIDTH + i] * tanh(w[i] * half[k % 2] + w[WIDTH + i]);
        half[1 - k % 2] += dt * sum;
    }
    map(model, (double[]){0.4, -0.7}, dt, false, x, NULL);
    assert_close(x[0], half[0], 1e-15, 0);
    assert_close(x[1], half[1], 1e-15, 0);
    hnn_model_free(model);
}

static void test_gradient(void **state)
{
    (void)state;
    enum { SAMPLES = 3 };
    struct hnn_training training = hnn_training_defaults();
    training.rollout = 2;
    for (int normalised = 0; normalised < 2; normalised++) {
        hnn_model *model = make(DOF, normalised, "tanh");
        size_t rows = hnn_target_rows(model, &training);
        double *states = small_values(5, STATES, SAMPLES), *goals = small_values(6, rows, SAMPLES);
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var p = ad_input(tape, 1, hnn_model_size(model), "parameters");
        ad_var loss =
            ad_mean(hnn_record_losses(model, &training, p, ad_const(tape, STATES, SAMPLES, states),
                                      ad_const(tape, rows, SAMPLES, goals)));
        struct ad_check report = {0};
        const double *at = hnn_model_parameters(model);
        assert_int_equal(ad_check_gradient(loss, 1, &p, &at, 2e-7, 0, &report), AD_OK);
        assert_true(report.passed);
        ad_tape_free(tape);
        free(states);
        free(goals);
        hnn_model_free(model);
    }
}

/* Files return the same map; a motion is its powers, and runs back. */
static void test_files_and_motion(void **state)
{
    (void)state;
    static const double x0[STATES] = {0.4, -0.7, 0.9, 0.2, 1.3, -1.6};
    for (int kind = 0; kind < 2; kind++) {
        struct path file = files_temporary(kind ? "m.safetensors" : "m.h5");
        hnn_model *model = make(DOF, true, "tanh"), *other = NULL;
        struct hnn_exchange exchange = {0};
        struct ad_error error = {0};
        double x[STATES];
        if (kind) {
            assert_int_equal(hnn_model_export(model, file.text, &error), AD_OK);
            hnn_model_import(file.text, hnn_model_settings(model), &other, &exchange, &error);
        } else {
            assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
            hnn_model_load(file.text, &other, &error);
        }
        if (error.status != AD_OK)
            fail_msg("%s", error.message);
        struct hnn_path path;
        struct hnn_rollout_info info;
        double t[3] = {1, 1.2, 1.5};
        struct hnn_rollout_settings s = {
            .size = sizeof s, .n = 3, .t = t, .dt = 0.1, .reverse = true};
        assert_int_equal(hnn_map_rollout(other, &s, x0, &path, &info, &error), AD_OK);
        memcpy(x, x0, sizeof x);
        for (size_t k = 1; k <= 5; k++) {
            map(model, x, 0.1, false, x, NULL);
            for (size_t i = 0; i < STATES && (k == 2 || k == 5); i++)
                assert_close(path.x[(k == 2 ? 1U : 2U) * STATES + i], x[i], 1e-13, 1e-14);
        }
        assert_true(info.evaluations == 5 && info.reversal_error < 1e-12);
        hnn_path_free(&path);
        t[1] = 1.23;
        assert_int_equal(hnn_map_rollout(other, &s, x0, &path, &info, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, "whole steps 1.23");
        hnn_model_free(model);
        hnn_model_free(other);
    }
}

static void test_refusals(void **state)
{
    (void)state;
    hnn_model *model = make(1, false, "tanh");
    double x[2] = {0.4, 0.2}, rate[2], one = 1;
    struct ad_error error = {0};
    struct phys_ode ode;
    struct hnn_mass mass;
    assert_int_equal(hnn_model_field(model, x, rate), AD_E_ARGUMENT);
    assert_int_equal(hnn_model_evaluate(model, 1, x, rate, NULL, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "sympnet field");
    error = (struct ad_error){0};
    assert_int_equal(hnn_model_ode(model, &ode, &error), AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(hnn_model_mass(model, 1, x, &mass, &error), AD_E_ARGUMENT);
    assert_true(isnan(hnn_model_energy(model, x)));
    struct hnn_samples samples = {.n = 1, .x = x, .target = x, .steps = &one};
    struct hnn_training training = hnn_training_defaults();
    hnn_trainer *trainer;
    for (size_t how = 0; how < 2; how++) {
        error = (struct ad_error){0};
        training.rollout = how;
        training.stepping = how ? HNN_MIDPOINT : HNN_RUNGE_KUTTA;
        assert_int_equal(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error),
                         AD_E_ARGUMENT);
    }
    hnn_model_free(model);
    for (int how = 0; how < 5; how++) {
        struct hnn_settings s = hnn_defaults(HNN_SYMPNET, how == 0 ? 65 : 1);
        s.layers = how == 1 ? 1 : 3;
        s.hidden[1] = how == 2 ? 7 : s.hidden[0];
        s.angles = how == 3;
        s.inputs = how == 4;
        error = (struct ad_error){0};
        assert_int_equal(hnn_model_new(&s, &model, &error), AD_E_ARGUMENT);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_symplectic_and_inverse),
        cmocka_unit_test(test_map_by_hand),
        cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_files_and_motion),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests_name("sympnet", tests, files_setup, files_teardown);
}
