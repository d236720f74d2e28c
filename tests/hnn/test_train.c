/* Training: losses decrease and agree with their definition, f32 agrees with f64, averaged weights,
   rollouts, and the effect of friction on the plain model. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/train/train.h"

#include <stdlib.h>

/* Trains a model anew; returns the loss over all samples at the end. */
static double trained(hnn_model *model, const struct hnn_training *training,
                      const struct hnn_samples *train)
{
    hnn_trainer *trainer = small_trainer(model, training, train, &small_none);
    small_run(trainer);
    double loss = hnn_trainer_train_loss(trainer);
    hnn_trainer_free(trainer);
    return loss;
}

static void test_every_method_and_kind(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 40, 0);
    for (size_t m = 0; hnn_optimisers[m]; m++)
        for (size_t k = 0; k < small_n_kinds; k++) {
            if (small_kinds[k].field == HNN_CONSERVATIVE)
                continue; /* no gradient is a rotation */
            struct hnn_settings s = small_settings(&small_kinds[k], 1, 3);
            hnn_model *model = small_model(&s);
            struct hnn_training training = hnn_training_defaults();
            training.optimiser = hnn_optimisers[m];
            training.learning_rate = m == 2 ? 0.05 : 0.01;
            training.momentum = 0.9;
            training.steps = 100;
            training.batch = hnn_optimisers[m]->full_batch ? 0 : 16;
            double before = small_loss(model, &train), after = trained(model, &training, &train);
            assert_close(after, small_loss(model, &train), 1e-12, 0);
            if (!(after < 0.5 * before))
                fail_msg("%s, %s: %g after %g", hnn_optimiser_name(hnn_optimisers[m]),
                         small_kinds[k].name, after, before);
            hnn_model_free(model);
        }
    small_samples_free(&train);
}

/* The loss of one step as the history tells it is that of the start. */
static void test_first_row(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 40, 0), test = small_pendulum(2, 30, 0);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.steps = 25;
    training.every = 1;
    double before = small_loss(model, &train);
    hnn_trainer *trainer = small_trainer(model, &training, &train, &test);
    assert_int_equal(small_run(trainer), HNN_STOP_STEPS);
    size_t rows;
    const struct hnn_row *history = hnn_trainer_history(trainer, &rows);
    assert_int_equal(rows, 25);
    assert_close(history[0].train_loss, before, 1e-12, 0);
    assert_close(history[24].test_loss, small_loss(model, &test), 1e-12, 0);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
    small_samples_free(&test);
}

enum { STEPS = 60 };

struct passed {
    size_t n, steps;
    double *point; /* [STEPS][n] */
};

static bool pass(void *context, hnn_trainer *trainer)
{
    struct passed *passed = context;
    hnn_to_double(trainer->problem.type, passed->n, hnn_problem_point(&trainer->problem),
                  passed->point + passed->steps++ * passed->n);
    return true;
}

/* The model against the points passed: what step j adds to the mean with the weight 1/(f j), the
   later ones leave by the factors 1 - 1/(f i). All weights are the same for f = 1. */
static void check_average(enum ad_type type, double f, double tolerance)
{
    struct hnn_samples train = small_pendulum(1, 40, 0);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    s.precision = type;
    hnn_model *model = small_model(&s);
    size_t n = hnn_model_size(model);
    struct passed passed = {.n = n, .point = malloc(STEPS * n * sizeof(double))};
    struct hnn_training training = hnn_training_defaults();
    training.learning_rate = 0.05;
    training.steps = STEPS;
    training.average = f;
    training.progress = pass;
    training.context = &passed;
    trained(model, &training, &train);
    double *found = malloc(n * sizeof *found), weight[STEPS], left = 1;
    for (size_t j = STEPS; j >= 1; j--) {
        double share = fmin(1, 1 / (f * (double)j));
        weight[j - 1] = left * share;
        left *= 1 - share;
    }
    hnn_to_double(type, n, hnn_model_parameters(model), found);
    for (size_t k = 0; k < n; k++) {
        double mean = 0;
        for (size_t j = 0; j < STEPS; j++)
            mean += (f == 1 ? 1.0 / STEPS : weight[j]) * passed.point[j * n + k];
        assert_close(found[k], mean, tolerance, tolerance);
    }
    free(found);
    free(passed.point);
    hnn_model_free(model);
    small_samples_free(&train);
}

/* F7: the mean as theory.md has it, with max(1, f k). */
static void test_average(void **state)
{
    (void)state;
    check_average(AD_F64, 1, 1e-14);
    check_average(AD_F64, 0.1, 1e-14);
    check_average(AD_F32, 0.1, 1e-7);
}

/* Steps of one length, by batches, go on about the minimum; their mean is nearer to it. Of one run
   the last step may end there by chance, of several not. */
static void test_average_rests(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 40, 0);
    double loss[2] = {0};
    for (int average = 0; average < 2; average++)
        for (uint64_t seed = 0; seed < 5; seed++) {
            struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
            s.seed = seed;
            hnn_model *model = small_model(&s);
            struct hnn_training training = hnn_training_defaults();
            training.batch = 8;
            training.learning_rate = 0.05;
            training.steps = 500;
            training.average = average ? 0.1 : 0;
            loss[average] += trained(model, &training, &train);
            hnn_model_free(model);
        }
    assert_true(loss[1] < 0.5 * loss[0]);
    small_samples_free(&train);
}

static void test_single_follows_double(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 60, 0);
    double loss[2];
    for (int type = AD_F32; type <= AD_F64; type++) {
        struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
        s.precision = (enum ad_type)type;
        hnn_model *model = small_model(&s);
        struct hnn_training training = hnn_training_defaults();
        training.steps = 100;
        loss[type] = trained(model, &training, &train);
        hnn_model_free(model);
    }
    assert_close(loss[AD_F32], loss[AD_F64], 1e-4, 0);
    small_samples_free(&train);
}

/* p' = -q - g p: the friction is what no Hamiltonian has. Of (0, -g p) a symplectic field can make
   the part that is divergence-free, and so halves it: the least loss is g^2 <r^2>/8 over a disc, r
   its radius. A learned dissipation has no such floor. */
static void test_friction(void **state)
{
    (void)state;
    enum { N = 400 };
    const double g = 0.2;
    double x[2 * N], rate[2 * N], squares = 0, loss[2];
    for (size_t k = 0; k < N; k++) { /* evenly over the unit disc */
        double r = sqrt((double)k / N + 0.5 / N), angle = 2.618033988749895 * M_PI * (double)k;
        double q = x[k] = r * cos(angle), p = x[N + k] = r * sin(angle);
        rate[k] = p;
        rate[N + k] = -q - g * p;
        squares += r * r / N;
    }
    struct hnn_samples train = {.n = N, .x = x, .target = rate};
    for (int dissipation = 0; dissipation < 2; dissipation++) {
        struct hnn_settings s = small_settings(&small_kinds[dissipation ? 5 : 1], 1, 3);
        s.hidden[0] = s.hidden[1] = 30;
        hnn_model *model = small_model(&s);
        struct hnn_training training = hnn_training_defaults();
        training.optimiser = hnn_optimisers[3];
        training.weight_decay = 0;
        training.steps = 450; /* room for the rounding of other starts */
        loss[dissipation] = trained(model, &training, &train);
        hnn_model_free(model);
    }
    assert_close(loss[0], g * g * squares / 8, 0.02, 0);
    assert_true(loss[1] < 1e-3 * loss[0]);
}

/* States 0.2 and 0.4 later, from the motion itself: the field that is learned is the pendulum's. */
static void test_rollout(void **state)
{
    (void)state;
    enum { N = 80, FINE = 100 };
    const double dt = 0.2;
    struct hnn_samples train = small_pendulum(4, N, 0);
    double *later = malloc(4 * N * sizeof *later);
    for (size_t k = 0; k < N; k++) {
        double q = train.x[k], p = train.x[N + k], h = dt / FINE;
        for (int step = 1; step <= 2 * FINE; step++) { /* Stoermer and Verlet */
            p -= 0.5 * h * sin(q);
            q += h * p;
            p -= 0.5 * h * sin(q);
            if (step % FINE == 0) {
                double *row = later + (size_t)(step / FINE - 1) * 2 * N;
                row[k] = q;
                row[N + k] = p;
            }
        }
    }
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.optimiser = hnn_optimisers[3];
    training.weight_decay = 0;
    training.steps = 200;
    training.rollout = 2;
    training.dt = dt;
    double before = small_loss(model, &train);
    trained(model, &training, &(struct hnn_samples){.n = N, .x = train.x, .target = later});
    double after = small_loss(model, &train);
    assert_true(after < 1e-3 * before);
    free(later);
    hnn_model_free(model);
    small_samples_free(&train);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_method_and_kind),
        cmocka_unit_test(test_first_row),
        cmocka_unit_test(test_average),
        cmocka_unit_test(test_average_rests),
        cmocka_unit_test(test_single_follows_double),
        cmocka_unit_test(test_friction),
        cmocka_unit_test(test_rollout),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
