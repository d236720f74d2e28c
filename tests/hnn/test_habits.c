/* Schedules, clipped gradients and activations against other implementations' numbers. */
#include "small.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

/* torch.optim.lr_scheduler.OneCycleLR(max_lr=1, total_steps=100); warmup in closed form. */
static void test_schedules(void **state)
{
    static const struct {
        const char *name;
        size_t step;
        double factor;
    } known[] = {{"onecycle", 0, 0.04},
                 {"onecycle", 10, 0.29516394846410077},
                 {"onecycle", 28, 0.9971862194340926},
                 {"onecycle", 29, 1},
                 {"onecycle", 30, 0.9994965352845243},
                 {"onecycle", 60, 0.5892800902855287},
                 {"onecycle", 99, 4e-6},
                 {"warmup", 0, 0.1},
                 {"warmup", 4, 0.5},
                 {"warmup", 9, 1},
                 {"warmup", 99, 1}};
    struct ad_error error = {0};
    (void)state;
    for (size_t k = 0; k < LENGTH(known); k++)
        assert_close(hnn_schedule_find(known[k].name, &error)->factor(known[k].step, 100),
                     known[k].factor, 1e-12, 0);
    for (size_t s = 0; hnn_schedules[s]; s++)
        for (size_t steps = 1; steps < 5; steps++)
            for (size_t step = 0; step < steps; step++) {
                double factor = hnn_schedules[s]->factor(step, steps);
                assert_true(factor > 0 && factor <= 1);
            }
}

/* torch.nn.functional.gelu(x, approximate='tanh') and elu(x). */
static void test_activations(void **state)
{
    static const double x[] = {-2.1, -0.3, 0.7},
                        gelu[] = {-0.037330995038887836, -0.11462907645724074, 0.5305701347051167},
                        elu[] = {-0.8775435717470181, -0.2591817793182821, 0.7};
    (void)state;
    for (size_t k = 0; hnn_activations[k].name; k++) {
        const char *name = hnn_activations[k].name;
        const double *expected = strcmp(name, "gelu") == 0  ? gelu
                                 : strcmp(name, "elu") == 0 ? elu
                                                            : NULL;
        struct ad_error error = {0};
        struct ad_check report;
        double y[3];
        const double *at[] = {x};
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var in = ad_input(tape, 1, 3, "x"), out = hnn_activations[k].record(in);
        assert_int_equal(ad_check_second(ad_sum(out), 1, &in, at, 1e-6, 0, &report), AD_OK);
        assert_true(report.passed);
        assert_int_equal(ad_evaluate(1, &in, at, out, y, &error), AD_OK);
        for (size_t i = 0; i < 3 && expected; i++)
            assert_close(y[i], expected[i], 1e-14, 0);
        ad_tape_free(tape);
    }
}

/* The Euclidean length of one step of plain descent with rate 1: the norm of the gradient. */
static double length_of_step(enum ad_type precision, double clip, double *direction)
{
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    struct hnn_training training = hnn_training_defaults();
    struct hnn_samples samples = small_pendulum(1, 40, 0);
    struct ad_error error = {0};
    s.precision = precision;
    hnn_model *model = small_model(&s);
    size_t n = hnn_model_size(model), bytes = n * (precision == AD_F32 ? 4 : 8);
    void *before = malloc(bytes);
    memcpy(before, hnn_model_parameters(model), bytes);
    training.optimiser = hnn_optimiser_find("sgd", &error);
    training.learning_rate = 1;
    training.weight_decay = training.average = 0;
    training.steps = 1;
    training.clip = clip;
    hnn_trainer *trainer = small_trainer(model, &training, &samples, NULL);
    small_run(trainer);
    double square = 0, change;
    for (size_t k = 0; k < n; k++) {
        const void *now = hnn_model_parameters(model);
        change = precision == AD_F32 ? (double)((const float *)now)[k] - ((float *)before)[k]
                                     : ((const double *)now)[k] - ((double *)before)[k];
        square += change * change;
        *direction = k == 3 ? change : *direction;
    }
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&samples);
    free(before);
    return sqrt(square);
}

static void test_clipped_gradients(void **state)
{
    (void)state;
    for (int type = AD_F32; type <= AD_F64; type++) {
        double rtol = type == AD_F32 ? 1e-4 : 1e-12, whole, part, same;
        double norm = length_of_step((enum ad_type)type, 0, &whole);
        assert_true(norm > 0.1);
        assert_close(length_of_step((enum ad_type)type, norm / 4, &part), norm / 4, rtol, 0);
        assert_close(part, whole / 4, rtol, 0);
        assert_true(length_of_step((enum ad_type)type, 2 * norm, &same) == norm && same == whole);
    }
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    struct hnn_training training = hnn_training_defaults();
    struct hnn_samples samples = small_pendulum(1, 40, 0);
    struct ad_error error = {0};
    hnn_model *model = small_model(&s);
    hnn_trainer *trainer;
    training.clip = -1;
    assert_int_equal(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "-1");
    training.clip = 1;
    error = (struct ad_error){0};
    training.optimiser = hnn_optimiser_find("lbfgs", &error);
    assert_int_equal(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "lbfgs");
    hnn_model_free(model);
    small_samples_free(&samples);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_schedules),
        cmocka_unit_test(test_activations),
        cmocka_unit_test(test_clipped_gradients),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
