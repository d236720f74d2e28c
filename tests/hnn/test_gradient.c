/* Gradients of the loss by differences, in f64, for every activation, kind of model and depth, on
   rates and on rollouts, plain and normalised; and the fields themselves. */
#include "small.h"
#include "tests/close.h"
#include "hnn/train/train.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DOF = 2, STATES = 2 * DOF, SAMPLES = 3 };

static const double centre[STATES] = {0.3, -0.2, 0.1, 0.05}, scale[STATES] = {1.7, 0.6, 0.9, 2.1},
                    rate[STATES] = {0.8, 1.9, 1.1, 0.7};

static void normalise(hnn_model *model)
{
    struct ad_error error = {0};
    assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
}

static void check(const hnn_model *model, const struct hnn_training *training, const char *what)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    size_t rows = hnn_target_rows(model, training);
    ad_var p = ad_input(tape, 1, hnn_model_size(model), "parameters");
    double *states = small_values(5, STATES, SAMPLES), *targets = small_values(6, rows, SAMPLES);
    ad_var x = ad_const(tape, STATES, SAMPLES, states);
    ad_var target = ad_const(tape, rows, SAMPLES, targets);
    ad_var loss = ad_mean(hnn_record_losses(model, training, p, x, target));
    struct ad_check report = {0};
    const double *at = hnn_model_parameters(model);
    enum ad_status status = ad_check_gradient(loss, 1, &p, &at, 2e-7, 0, &report);
    if (status != AD_OK || !report.passed || !(fabs(report.tape) >= 0))
        fail_msg("%s: %s; entry %zu: %.12g on the tape, %.12g by differences", what,
                 ad_tape_error(tape)->message, report.col, report.tape, report.difference);
    assert_int_equal(report.entries, hnn_model_size(model));
    free(states);
    free(targets);
    ad_tape_free(tape);
}

static void test_activations_and_kinds(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    for (size_t a = 0; hnn_activations[a].name; a++)
        for (size_t k = 0; k < small_n_kinds; k++) {
            struct hnn_settings s = small_settings(&small_kinds[k], DOF, 3);
            s.activation = hnn_activations[a].name;
            if (s.kind == HNN_LAGRANGIAN && strcmp(s.activation, "relu") == 0)
                continue; /* refused */
            hnn_model *model = small_model(&s);
            char what[80];
            snprintf(what, sizeof what, "%s, %s", s.activation, small_kinds[k].name);
            check(model, &training, what);
            hnn_model_free(model);
        }
}

static void test_depths(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    for (size_t layers = 1; layers <= 5; layers++)
        for (size_t k = 0; k < small_n_kinds; k++) {
            struct hnn_settings s = small_settings(&small_kinds[k], DOF, layers);
            hnn_model *model = small_model(&s);
            normalise(model);
            check(model, &training, small_kinds[k].name);
            hnn_model_free(model);
        }
}

static void test_rollouts(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    training.rollout = 2;
    training.dt = 0.3;
    for (int normalised = 0; normalised < 2; normalised++)
        for (size_t k = 0; k < small_n_kinds; k++) {
            struct hnn_settings s = small_settings(&small_kinds[k], DOF, 3);
            hnn_model *model = small_model(&s);
            if (normalised)
                normalise(model);
            check(model, &training, small_kinds[k].name);
            hnn_model_free(model);
        }
}

/* ---- the fields ---- */

/* H_k by Richardson's differences. */
static double slope(hnn_model *model, const double *x, size_t k)
{
    double d[2];
    for (int j = 0; j < 2; j++) {
        double h = j ? 5e-4 : 1e-3, y[STATES];
        for (size_t i = 0; i < STATES; i++)
            y[i] = x[i];
        y[k] = x[k] + h;
        d[j] = hnn_model_energy(model, y);
        y[k] = x[k] - h;
        d[j] = (d[j] - hnn_model_energy(model, y)) / (2 * h);
    }
    return (4 * d[1] - d[0]) / 3;
}

static void test_symplectic_field(void **state)
{
    (void)state;
    static const double x[STATES] = {0.4, -0.7, 0.9, 0.2};
    for (int which = 0; which < 4; which++) {
        struct hnn_settings s = small_settings(&small_kinds[which % 2 ? 4 : 1], DOF, 3);
        hnn_model *model = small_model(&s);
        if (which >= 2)
            normalise(model);
        double field[STATES];
        assert_int_equal(hnn_model_field(model, x, field), AD_OK);
        for (size_t k = 0; k < DOF; k++) {
            assert_close(field[k], slope(model, x, DOF + k), 1e-9, 1e-10);
            assert_close(field[DOF + k], -slope(model, x, k), 1e-9, 1e-10);
        }
        hnn_model_free(model);
    }
}

/* T + V: dq/dt does not know q, nor dp/dt p; kick and drift are the halves of the field. */
static void test_separable_halves(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[4], DOF, 3);
    hnn_model *model = small_model(&s);
    struct phys_ode ode;
    struct ad_error error = {0};
    double x[STATES] = {0.4, -0.7, 0.9, 0.2}, whole[STATES], part[DOF], other[STATES];
    assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
    assert_true(ode.canonical && ode.kick && ode.drift && ode.energy);
    assert_int_equal(ode.field(ode.context, 0, x, whole, &error), AD_OK);
    assert_int_equal(ode.kick(ode.context, 0, x, part, &error), AD_OK);
    assert_close(part[1], whole[DOF + 1], 1e-14, 0);
    assert_int_equal(ode.drift(ode.context, 0, x + DOF, part, &error), AD_OK);
    assert_close(part[0], whole[0], 1e-14, 0);
    x[0] = -1.3;
    assert_int_equal(ode.field(ode.context, 0, x, other, &error), AD_OK);
    assert_true(other[0] == whole[0] && other[1] == whole[1] && other[2] != whole[2]);
    phys_ode_free(&ode);
    hnn_model_free(model);
}

/* A state that is not finite is named, and nothing is written. */
static void test_states_that_are_not_finite(void **state)
{
    (void)state;
    enum { N = 5 };
    struct hnn_settings s = small_settings(&small_kinds[0], DOF, 2);
    hnn_model *model = small_model(&s);
    double *x = small_values(9, STATES, N), rates[STATES * N] = {7}, energy[N] = {7};
    for (size_t k = 0; k < STATES * N; k++) {
        struct ad_error error = {0};
        char name[32];
        double was = x[k], at[STATES];
        x[k] = k % 2 ? (double)NAN : -INFINITY;
        snprintf(name, sizeof name, "%c%zu of sample %zu", k / N < DOF ? 'q' : 'p', k / N % DOF + 1,
                 k % N);
        assert_int_equal(hnn_model_evaluate(model, N, x, rates, energy, &error), AD_E_NONFINITE);
        assert_non_null(strstr(error.message, name));
        for (size_t i = 0; i < STATES; i++)
            at[i] = x[i * N + k % N];
        assert_int_equal(hnn_model_field(model, at, rates), AD_E_NONFINITE);
        x[k] = was;
    }
    assert_true(rates[0] == 7 && energy[0] == 7);
    free(x);
    hnn_model_free(model);
}

/* Many states at once, one at a time, and in the other precision. */
static void test_evaluations_agree(void **state)
{
    (void)state;
    enum { N = 37 };
    for (size_t k = 0; k < small_n_kinds; k++) {
        struct hnn_settings s = small_settings(&small_kinds[k], DOF, 3);
        hnn_model *model = small_model(&s);
        struct ad_error error = {0};
        double *x = small_values(9, STATES, N), rates[STATES * N], energy[N] = {0}, one[STATES],
               at[4];
        assert_int_equal(hnn_model_evaluate(model, N, x, rates, energy, &error), AD_OK);
        if (s.kind == HNN_BASELINE)
            assert_true(isnan(energy[N - 1]));
        for (int type = AD_F32; type <= AD_F64; type++) {
            double tolerance = type == AD_F32 ? 3e-6 : 1e-13;
            hnn_model_evaluate_in(model, (enum ad_type)type);
            for (size_t i = 0; i < STATES; i++)
                at[i] = x[i * N + 20];
            assert_int_equal(hnn_model_field(model, at, one), AD_OK);
            for (size_t i = 0; i < STATES; i++)
                assert_close(one[i], rates[i * N + 20], tolerance, tolerance);
            bool has_energy = s.kind != HNN_BASELINE && s.field != HNN_CONSERVATIVE;
            if (has_energy)
                assert_close(hnn_model_energy(model, at), energy[20], tolerance, tolerance);
            else
                assert_true(isnan(hnn_model_energy(model, at)) && isnan(energy[20]));
        }
        free(x);
        hnn_model_free(model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_activations_and_kinds),
        cmocka_unit_test(test_depths),
        cmocka_unit_test(test_rollouts),
        cmocka_unit_test(test_symplectic_field),
        cmocka_unit_test(test_separable_halves),
        cmocka_unit_test(test_states_that_are_not_finite),
        cmocka_unit_test(test_evaluations_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
