/* The hand-written training step, in every build that this machine can run, against the tape. */
#include "tests/close.h"
#include "apps/bench/hand/hand_training.h"

#include <stdlib.h>

enum { WIDTH = 40, BATCH = 2 * HAND_HNN_BLOCK + 57 };

static const double weight_decay = 1e-2;

/* Samples and a network for all tests; double_* are the same numbers. */
static struct fixture {
    float *x, *rates;
    double *double_x, *double_rates;
    hnn_model *model;
} f;

static int setup(void **state)
{
    (void)state;
    struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct ad_error error = {0};
    settings.hidden[0] = settings.hidden[1] = WIDTH;
    settings.seed = 7;
    assert_true(hand_training_suits(&settings));
    f.x = malloc(4 * BATCH * sizeof *f.x);
    f.double_x = malloc(4 * BATCH * sizeof *f.double_x);
    assert_true(f.x && f.double_x);
    f.rates = f.x + 2 * BATCH;
    f.double_rates = f.double_x + 2 * BATCH;
    for (size_t k = 0; k < 2 * BATCH; k++)
        f.x[k] = (float)(1.3 * sin(0.7 * (double)(k * k) + 0.1));
    for (size_t k = 0; k < BATCH; k++) { /* of q^2 + p^2 */
        f.rates[k] = 2 * f.x[BATCH + k];
        f.rates[BATCH + k] = -2 * f.x[k];
    }
    for (size_t k = 0; k < 4 * BATCH; k++)
        f.double_x[k] = f.x[k];
    return hnn_model_new(&settings, &f.model, &error) != AD_OK;
}

static int teardown(void **state)
{
    (void)state;
    hnn_model_free(f.model);
    free(f.x);
    free(f.double_x);
    return 0;
}

/* Loss and gradient [parameters] by a tape of f64, at the parameters of f32. */
static double by_tape(double *gradient)
{
    const float *point = hnn_model_parameters(f.model);
    size_t n = hnn_model_size(f.model);
    double loss;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var p = ad_input(tape, 1, n, "parameters"), g;
    ad_var x = ad_const(tape, 2, BATCH, f.double_x),
           rates = ad_const(tape, 2, BATCH, f.double_rates);
    ad_var mean = ad_mean(ad_square(ad_sub(hnn_model_record(f.model, p, x).field, rates)));
    ad_program *program;
    ad_grad(mean, 1, &p, &g);
    assert_int_equal(ad_compile(tape, 2, (ad_var[]){mean, g}, &program), AD_OK);
    for (size_t k = 0; k < n; k++)
        ((double *)ad_data(program, p))[k] = point[k];
    ad_run(program);
    ad_get(program, mean, &loss);
    ad_get(program, g, gradient);
    ad_program_free(program);
    ad_tape_free(tape);
    return loss;
}

/* Largest entries of each of W1, b1, W2, b2 and w3 differ by orders of magnitude: each block by its
   own. A sum of 441 terms rounds to some 20 times 6e-8. */
static void test_gradient(void **state)
{
    (void)state;
    const struct hand_hnn_shape shape = {WIDTH, BATCH};
    const struct hand_hnn *hand;
    size_t n = hnn_model_size(f.model), blocks;
    const struct hnn_block *block = hnn_model_blocks(f.model, &blocks);
    assert_int_equal(n, hand_hnn_parameters(WIDTH));
    assert_int_equal(blocks, 5);
    double *exact = malloc(n * sizeof *exact), loss = by_tape(exact);
    float *g = malloc(n * sizeof *g), *room = malloc(hand_hnn_room(WIDTH) * sizeof *room);
    assert_true(exact && g && room);
    for (int k = 0; (hand = hand_hnn_build(k)); k++) {
        for (size_t i = 0; i < n; i++)
            g[i] = NAN;
        assert_close(hand->gradient(&shape, hnn_model_parameters(f.model), f.x, f.rates, g, room),
                     loss, 1e-6, 0);
        for (size_t b = 0; b < blocks; b++) {
            double largest = 0;
            size_t first = block[b].offset, end = first + block[b].rows * block[b].cols;
            for (size_t i = first; i < end; i++)
                largest = fmax(largest, fabs(exact[i]));
            for (size_t i = first; i < end; i++)
                assert_close((double)g[i], exact[i], 0, 1e-6 * largest);
        }
    }
    free(exact);
    free(g);
    free(room);
}

/* The trainer and the hand go the same way from the same weights. */
static void test_steps(void **state)
{
    (void)state;
    struct hnn_training settings = hnn_training_defaults();
    const struct hnn_samples samples = {.n = BATCH, .x = f.double_x, .target = f.double_rates};
    struct hand_training hand;
    struct ad_error error = {0};
    hnn_trainer *trainer;
    enum hnn_stop stop;
    size_t rows;
    settings.weight_decay = weight_decay;
    settings.steps = 20;
    settings.every = 1;
    assert_int_equal(hand_training_new(&hand, f.model, BATCH, f.x, f.rates, weight_decay, &error),
                     AD_OK);
    assert_int_equal(
        hnn_trainer_new(f.model, &settings, &samples, &(struct hnn_samples){0}, &trainer, &error),
        AD_OK);
    assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_OK);
    const struct hnn_row *history = hnn_trainer_history(trainer, &rows);
    assert_int_equal(rows, settings.steps);
    for (size_t k = 0; k < rows; k++)
        assert_close(hand_training_step(&hand), history[k].train_loss, 1e-6, 0);
    assert_true(history[rows - 1].train_loss < 0.9 * history[0].train_loss);
    hand_training_free(&hand);
    hnn_trainer_free(trainer);
}

static void test_other_networks_do_not_suit(void **state)
{
    (void)state;
    struct hnn_settings settings = *hnn_model_settings(f.model);
    settings.hidden[1]++;
    assert_false(hand_training_suits(&settings));
    settings = *hnn_model_settings(f.model);
    settings.precision = AD_F64;
    assert_false(hand_training_suits(&settings));
    settings = hnn_defaults(HNN_BASELINE, 1);
    assert_false(hand_training_suits(&settings));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_other_networks_do_not_suit),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
