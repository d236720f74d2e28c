/* Losses on rollouts whose starts are unknown: against the least loss that a search finds,
   gradients by differences, noise that the loss ends at, what is refused. */
#include "tests/hnn/small.h"
#include "tests/close.h"
#include "tests/mentions.h"
#include "hnn/train/train.h"
#include "physics/io/random.h"

#include <stdlib.h>

enum { STEPS = 3, SAMPLES = 3, COUNT = 5 };
static const size_t picked[COUNT] = {0, 1, 4, 6, 7}; /* of small_kinds */

/* The loss of samples x and what follows, [STEPS * 2 + STEPS x SAMPLES]. */
static void losses(const hnn_model *model, const struct hnn_training *training, const double *x,
                   const double *target, double *values)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_program *program;
    ad_var w = ad_const(tape, 1, hnn_model_size(model), hnn_model_parameters(model));
    ad_var out = hnn_record_losses(
        model, training, w, ad_const(tape, hnn_x_rows(model, training), SAMPLES, x),
        ad_const(tape, hnn_target_rows(model, training), SAMPLES, target));
    assert_int_equal(ad_compile(tape, 1, &out, &program), AD_OK);
    ad_run(program);
    ad_get(program, out, values);
    ad_program_free(program);
    ad_tape_free(tape);
}

static void normalise(hnn_model *model)
{
    struct ad_error error = {0};
    assert_int_equal(hnn_model_normalise(model, (double[]){0.3, -0.2}, (double[]){1.7, 0.6},
                                         (double[]){0.8, 1.9}, &error),
                     AD_OK);
}

/* States near the first one, and the lengths of steps. */
static double *observed(uint64_t seed, const double *x)
{
    double *to = small_values(seed, 3 * STEPS, SAMPLES);
    for (size_t k = 0; k < 2 * STEPS * SAMPLES; k++)
        to[k] = x[k % (2 * SAMPLES)] + 0.1 * to[k];
    for (size_t k = 0; k < STEPS * SAMPLES; k++)
        to[2 * STEPS * SAMPLES + k] = 0.1 + 0.02 * (double)k;
    return to;
}

/* The loss with a start of the caller's: that of the fixed start, and its distance. */
struct sample {
    const hnn_model *model;
    const double *x, *target;
    size_t k;
};

static double at_start(const struct sample *s, const double *unit, double a, double b)
{
    struct hnn_training fixed = hnn_training_defaults();
    double x[2 * SAMPLES], values[SAMPLES];
    fixed.rollout = STEPS;
    for (size_t i = 0; i < 2 * SAMPLES; i++)
        x[i] = s->x[i];
    x[s->k] += unit[0] * a;
    x[SAMPLES + s->k] += unit[1] * b;
    losses(s->model, &fixed, x, s->target, values);
    return (STEPS * values[s->k] + 0.5 * (a * a + b * b)) / (STEPS + 1);
}

/* The least value by a search along both axes in turn. */
static double least(const struct sample *s, const double *unit)
{
    double a = 0, b = 0, value = at_start(s, unit, 0, 0);
    for (double length = 0.2; length > 1e-5;) {
        bool better = false;
        for (int way = 0; way < 4; way++) {
            double to_a = a + (way == 0   ? length
                               : way == 1 ? -length
                                          : 0),
                   to_b = b + (way == 2   ? length
                               : way == 3 ? -length
                                          : 0);
            double there = at_start(s, unit, to_a, to_b);
            if (there < value) {
                value = there;
                a = to_a;
                b = to_b;
                better = true;
            }
        }
        length *= better ? 1 : 0.5;
    }
    return value;
}

static void test_least(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    training.rollout = STEPS;
    training.free_starts = true;
    for (size_t i = 0; i < COUNT; i++) {
        struct hnn_settings s = small_settings(&small_kinds[picked[i]], 1, 3);
        hnn_model *model = small_model(&s);
        const double units[2][2] = {{1, 1}, {1.7, 0.6}};
        if (i % 2)
            normalise(model);
        double *x = small_values(5, 2, SAMPLES), *to = observed(6, x), values[SAMPLES];
        losses(model, &training, x, to, values);
        for (size_t k = 0; k < SAMPLES; k++) {
            struct sample sample = {model, x, to, k};
            assert_close(values[k], least(&sample, units[i % 2]), 1e-7, 1e-7);
            assert_true(values[k] < 0.999 * at_start(&sample, units[i % 2], 0, 0));
        }
        free(x);
        free(to);
        hnn_model_free(model);
    }
}

/* Turns whose speed grows with the radius: H = w (q^2 + p^2)^2/4. */
static ad_var whirl(void *context, ad_var parameters, ad_var x)
{
    (void)context;
    return ad_mul(ad_mul(0.25, parameters), ad_square(ad_sum_rows(ad_square(x))));
}

/* Noise of a fifth of the states, where undamped steps of the method go astray. */
static void test_far(void **state)
{
    (void)state;
    static const double speed = 3, unit[2] = {1, 1};
    const struct hnn_network network = {
        .name = "whirl", .size = 1, .start = &speed, .record = whirl};
    struct hnn_training training = hnn_training_defaults();
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    s.precision = AD_F64;
    s.network = &network;
    training.rollout = STEPS;
    training.free_starts = true;
    hnn_model *model = small_model(&s);
    for (uint64_t seed = 1; seed < 9; seed++) {
        double *noise = small_values(seed, 2 * (STEPS + 1), SAMPLES), values[SAMPLES];
        double x[2 * SAMPLES], to[3 * STEPS * SAMPLES];
        for (size_t i = 0; i < SAMPLES; i++)
            for (size_t k = 0; k <= STEPS; k++)
                for (size_t r = 0; r < 2; r++) {
                    double *at = k ? to + 2 * (k - 1) * SAMPLES : x;
                    at[r * SAMPLES + i] = cos(0.6 * (double)k + M_PI / 2 * (double)r) +
                                          0.2 * noise[(2 * k + r) * SAMPLES + i];
                }
        for (size_t k = 0; k < STEPS * SAMPLES; k++)
            to[2 * STEPS * SAMPLES + k] = 0.2;
        losses(model, &training, x, to, values);
        for (size_t k = 0; k < SAMPLES; k++)
            assert_close(values[k], least(&(struct sample){model, x, to, k}, unit), 1e-4, 0);
        free(noise);
    }
    hnn_model_free(model);
}

static void test_gradient(void **state)
{
    (void)state;
    struct hnn_training training = hnn_training_defaults();
    training.rollout = STEPS;
    training.free_starts = true;
    for (size_t i = 0; i < COUNT; i++) {
        struct hnn_settings s = small_settings(&small_kinds[picked[i]], 1, 3);
        hnn_model *model = small_model(&s);
        if (i % 2)
            normalise(model);
        ad_tape *tape = ad_tape_new(AD_F64);
        double *x = small_values(7, 2, SAMPLES), *to = observed(8, x);
        const double *at = hnn_model_parameters(model);
        ad_var p = ad_input(tape, 1, hnn_model_size(model), "parameters");
        ad_var loss = ad_mean(hnn_record_losses(model, &training, p, ad_const(tape, 2, SAMPLES, x),
                                                ad_const(tape, 3 * STEPS, SAMPLES, to)));
        struct ad_check report = {0};
        if (ad_check_gradient(loss, 1, &p, &at, 1e-6, 0, &report) != AD_OK || !report.passed)
            fail_msg("%s: %s; entry %zu: %.12g on the tape, %.12g by differences",
                     small_kinds[picked[i]].name, ad_tape_error(tape)->message, report.col,
                     report.tape, report.difference);
        free(x);
        free(to);
        ad_tape_free(tape);
        hnn_model_free(model);
    }
}

/* Circles q' = p, p' = -q with noise of deviation 0.1: of the 2 (K + 1) numbers of a sample the
   best start takes 2, so that a loss of .01 K/(K + 1) is left; of fixed starts more. */
static ad_var circle(void *context, ad_var parameters, ad_var x)
{
    (void)context;
    return ad_mul(parameters, ad_mul(0.5, ad_sum_rows(ad_square(x))));
}

static void test_noise(void **state)
{
    (void)state;
    enum { N = 4000, K = 6 };
    static const double one = 1;
    const struct hnn_network network = {
        .name = "circle", .size = 1, .start = &one, .record = circle};
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    s.precision = AD_F64;
    s.network = &network;
    hnn_model *model = small_model(&s);
    struct phys_random random;
    double *x = malloc(2 * N * (K + 1) * sizeof *x);
    phys_random_seed(&random, 3);
    for (size_t i = 0; i < N; i++) {
        double phase = 6 * phys_random_uniform(&random);
        for (size_t k = 0; k <= K; k++)
            for (size_t r = 0; r < 2; r++)
                x[(2 * k + r) * N + i] = cos(phase + M_PI / 2 * (double)r + 0.2 * (double)k) +
                                         0.1 * phys_random_normal(&random);
    }
    struct hnn_training training = hnn_training_defaults();
    training.rollout = K;
    training.dt = 0.2;
    training.steps = 1;
    const struct hnn_samples samples = {.n = N, .x = x, .target = x + 2 * N};
    for (int free_starts = 0; free_starts < 2; free_starts++) {
        training.free_starts = free_starts;
        hnn_trainer *trainer = small_trainer(model, &training, &samples, NULL);
        assert_close(hnn_trainer_train_loss(trainer), free_starts ? 0.01 * K / (K + 1) : 0.02, 0.03,
                     0);
        hnn_trainer_free(trainer);
    }
    free(x);
    hnn_model_free(model);
}

static void test_refused(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        struct ad_error error = {0};
        struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, k ? 17 : 1);
        s.hidden[0] = s.hidden[1] = 4;
        hnn_model *model = small_model(&s);
        struct hnn_training training = hnn_training_defaults();
        training.free_starts = true;
        training.rollout = k;
        training.dt = 0.1;
        double *x = small_values(2, 34, 2);
        const struct hnn_samples samples = {.n = 2, .x = x, .target = x};
        hnn_trainer *trainer;
        assert_int_equal(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error),
                         AD_E_ARGUMENT);
        assert_mentions(error.message, "free starts");
        free(x);
        hnn_model_free(model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_least),    cmocka_unit_test(test_far),
        cmocka_unit_test(test_gradient), cmocka_unit_test(test_noise),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests_name("free starts", tests, NULL, NULL);
}
