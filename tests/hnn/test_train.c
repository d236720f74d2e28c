/* Training: losses fall, resumed runs go on to the last bit, single precision follows double, and
   what friction does to the plain model. */
#include "small.h"
#include "../close.h"
#include "../files.h"
#include "../../hnn/train.h"

#include <stdlib.h>
#include <string.h>

static const struct hnn_samples none = {.n = 0};

static hnn_trainer *trainer_of(hnn_model *model, const struct hnn_training *training,
                               const struct hnn_samples *train, const struct hnn_samples *test)
{
    struct ad_error error = {0};
    hnn_trainer *trainer;
    if (hnn_trainer_new(model, training, train, test, &trainer, &error) != AD_OK)
        fail_msg("%s", error.message);
    return trainer;
}

static enum hnn_stop run(hnn_trainer *trainer)
{
    struct ad_error error = {0};
    enum hnn_stop stop;
    if (hnn_trainer_run(trainer, &stop, &error) != AD_OK)
        fail_msg("%s", error.message);
    return stop;
}

/* Trains a model anew; returns the loss over all samples at the end. */
static double trained(hnn_model *model, const struct hnn_training *training,
                      const struct hnn_samples *train)
{
    hnn_trainer *trainer = trainer_of(model, training, train, &none);
    run(trainer);
    double loss = hnn_trainer_train_loss(trainer);
    hnn_trainer_free(trainer);
    return loss;
}

/* Losses as they are defined, from the field itself. */
static double loss_of(hnn_model *model, const struct hnn_samples *samples)
{
    struct ad_error error = {0};
    size_t m = 2 * hnn_model_settings(model)->dof, n = m * samples->n;
    double *rate = malloc(n * sizeof *rate), sum = 0;
    assert_int_equal(hnn_model_evaluate(model, samples->n, samples->x, rate, NULL, &error), AD_OK);
    for (size_t k = 0; k < n; k++)
        sum += (rate[k] - samples->target[k]) * (rate[k] - samples->target[k]);
    free(rate);
    return sum / (double)n;
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
            double before = loss_of(model, &train), after = trained(model, &training, &train);
            assert_close(after, loss_of(model, &train), 1e-12, 0);
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
    double before = loss_of(model, &train);
    hnn_trainer *trainer = trainer_of(model, &training, &train, &test);
    assert_int_equal(run(trainer), HNN_STOP_STEPS);
    size_t rows;
    const struct hnn_row *history = hnn_trainer_history(trainer, &rows);
    assert_int_equal(rows, 25);
    assert_close(history[0].train_loss, before, 1e-12, 0);
    assert_close(history[24].test_loss, loss_of(model, &test), 1e-12, 0);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
    small_samples_free(&test);
}

/* Surveys in pieces, the last one not full, give the loss of the whole. */
static void test_large_sets(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(3, 4096 + 777, 0);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.batch = 10;
    hnn_trainer *trainer = trainer_of(model, &training, &train, &none);
    assert_close(hnn_trainer_train_loss(trainer), loss_of(model, &train), 1e-12, 0);
    assert_true(isnan(hnn_trainer_test_loss(trainer)));
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
}

/* Seven batches of 3 from 7 samples take each three times. */
static void test_batches(void **state)
{
    (void)state;
    enum { N = 7, BATCH = 3 };
    double x[N], target[N], drawn[BATCH], with[BATCH];
    int times[N] = {0};
    for (int k = 0; k < N; k++) {
        x[k] = k;
        target[k] = 10 * k;
    }
    struct hnn_data data;
    struct ad_error error = {0};
    assert_int_equal(hnn_data_new(&data, AD_F64,
                                  &(struct hnn_samples){.n = N, .x = x, .target = target}, 1, 1,
                                  &error),
                     AD_OK);
    assert_int_equal(hnn_data_shuffle(&data, 3, &error), AD_OK);
    for (int k = 0; k < N; k++) {
        hnn_data_draw(&data, BATCH, drawn, with);
        for (int j = 0; j < BATCH; j++) {
            times[(int)drawn[j]]++;
            assert_true(with[j] == 10 * drawn[j]);
        }
    }
    for (int k = 0; k < N; k++)
        assert_int_equal(times[k], 3);
    hnn_data_free(&data);
}

/* Blocks of a batch, the last two sharing columns, give the loss and gradient of the whole; to the
   last bit whatever the number of threads. */
static void check_blocks(enum ad_type type, double tolerance)
{
    enum { N = 601 };
    struct hnn_samples train = small_pendulum(3, N, 0.3);
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    s.precision = type;
    hnn_model *model = small_model(&s);
    struct ad_error error = {0};
    size_t n = hnn_model_size(model), bytes = n * hnn_type_bytes(type);
    double *whole = malloc(n * sizeof *whole), *found = malloc(n * sizeof *found), loss[3];
    void *first = malloc(bytes);

    ad_tape *tape = ad_tape_new(type);
    ad_var p = ad_input(tape, 1, n, "parameters"), g;
    ad_var x = ad_const(tape, 2, N, train.x), target = ad_const(tape, 2, N, train.target);
    struct hnn_training training = hnn_training_defaults();
    ad_var mean = ad_mean(hnn_record_losses(model, &training, p, x, target));
    ad_program *program;
    ad_grad(mean, 1, &p, &g);
    assert_int_equal(ad_compile(tape, 2, (ad_var[]){mean, g}, &program), AD_OK);
    memcpy(ad_data(program, p), hnn_model_parameters(model), bytes);
    ad_run(program);
    ad_get(program, mean, &loss[0]);
    ad_get(program, g, whole);

    for (size_t threads = 1; threads <= 3; threads++) {
        struct hnn_problem problem;
        training.threads = threads;
        assert_int_equal(hnn_problem_new(&problem, model, &training, N, &error), AD_OK);
        assert_true(problem.blocks == 4 && problem.last.columns == N - 3 * problem.whole.columns);
        hnn_from_double(type, 2 * N, train.x, problem.x);
        hnn_from_double(type, 2 * N, train.target, problem.target);
        memcpy(hnn_problem_point(&problem), hnn_model_parameters(model), bytes);
        loss[1] = hnn_problem_evaluate(&problem);
        assert_close(loss[1], loss[0], tolerance, 0);
        if (threads == 1) {
            memcpy(first, hnn_problem_gradient(&problem), bytes);
            loss[2] = loss[1];
        }
        assert_memory_equal(hnn_problem_gradient(&problem), first, bytes);
        assert_true(loss[1] == loss[2]);
        hnn_problem_free(&problem);
    }
    hnn_to_double(type, n, first, found);
    for (size_t k = 0; k < n; k++)
        assert_close(found[k], whole[k], tolerance, tolerance);
    free(whole);
    free(found);
    free(first);
    ad_program_free(program);
    ad_tape_free(tape);
    hnn_model_free(model);
    small_samples_free(&train);
}

static void test_blocks(void **state)
{
    (void)state;
    check_blocks(AD_F32, 2e-6);
    check_blocks(AD_F64, 1e-14);
}

/* ---- the mean over the last steps ---- */

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

/* ---- resuming ---- */

struct half {
    size_t at; /* step after which the run is cut */
    struct path file;
};

static bool cut(void *context, hnn_trainer *trainer)
{
    const struct half *half = context;
    struct ad_error error = {0};
    if (hnn_trainer_step(trainer) < half->at)
        return true;
    assert_int_equal(hnn_trainer_save(trainer, half->file.text, "cut", &error), AD_OK);
    return false;
}

/* 100 steps, a file, and 100 more from that file by new handles, against 200 at once: parameters,
   history, and the files that either writes. */
static void check_resume(struct hnn_settings settings, struct hnn_training training)
{
    struct hnn_samples train = small_pendulum(1, 40, 0.1), test = small_pendulum(2, 30, 0.1);
    struct half half = {.at = 103, .file = files_temporary("half.h5")};
    struct path whole = files_temporary("whole.h5"), joined = files_temporary("joined.h5");
    struct ad_error error = {0};
    training.steps = 200;
    hnn_model *a = small_model(&settings), *b = small_model(&settings), *c = small_model(&settings);
    hnn_trainer *at_once = trainer_of(a, &training, &train, &test);
    run(at_once);
    struct hnn_training first = training;
    first.progress = cut;
    first.context = &half;
    hnn_trainer *before = trainer_of(b, &first, &train, &test);
    assert_int_equal(run(before), HNN_STOP_INTERRUPTED);
    hnn_trainer *after = trainer_of(c, &training, &train, &test);
    if (hnn_trainer_resume(after, half.file.text, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(hnn_trainer_step(after), 103);
    run(after);
    assert_int_equal(hnn_trainer_step(after), hnn_trainer_step(at_once));
    assert_memory_equal(hnn_model_parameters(a), hnn_model_parameters(c),
                        hnn_model_size(a) * hnn_type_bytes(settings.precision));
    assert_memory_not_equal(hnn_model_parameters(a), hnn_model_parameters(b),
                            hnn_model_size(a) * hnn_type_bytes(settings.precision));
    assert_int_equal(hnn_trainer_save(at_once, whole.text, "x", &error), AD_OK);
    assert_int_equal(hnn_trainer_save(after, joined.text, "x", &error), AD_OK);
    size_t bytes, others;
    char *one = files_read(whole.text, &bytes), *two = files_read(joined.text, &others);
    assert_int_equal(bytes, others);
    assert_memory_equal(one, two, bytes);
    free(one);
    free(two);
    hnn_trainer_free(at_once);
    hnn_trainer_free(before);
    hnn_trainer_free(after);
    hnn_model_free(a);
    hnn_model_free(b);
    hnn_model_free(c);
    small_samples_free(&train);
    small_samples_free(&test);
}

static void test_resume(void **state)
{
    (void)state;
    for (int type = AD_F32; type <= AD_F64; type++)
        for (size_t m = 0; hnn_optimisers[m]; m++)
            for (int batches = 0; batches < 2; batches++) {
                struct hnn_settings s = small_settings(&small_kinds[5], 1, 3);
                struct hnn_training training = hnn_training_defaults();
                if (batches && hnn_optimisers[m]->full_batch)
                    continue;
                s.precision = (enum ad_type)type;
                training.optimiser = hnn_optimisers[m];
                training.schedule = hnn_schedules[batches];
                training.batch = batches ? 13 : 0;
                training.momentum = 0.8;
                training.seed = 17;
                check_resume(s, training);
            }
}

/* With patience a file holds the best parameters beside the present ones, with or without their
   mean. */
static void test_resume_with_patience(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 3);
    struct hnn_training training = hnn_training_defaults();
    training.batch = 5;
    training.learning_rate = 0.05; /* the test loss goes up and down */
    training.patience = 190;
    training.every = 7;
    check_resume(s, training);
    training.average = 0;
    check_resume(s, training);
}

/* ---- stopping ---- */

static void test_patience(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 6, 0), test = small_pendulum(2, 50, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    s.hidden[0] = s.hidden[1] = 40; /* too many for six samples: the test loss rises again */
    hnn_model *model = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.steps = 20000;
    training.learning_rate = 0.01;
    training.weight_decay = 0;
    training.patience = 300;
    hnn_trainer *trainer = trainer_of(model, &training, &train, &test);
    assert_int_equal(run(trainer), HNN_STOP_PATIENCE);
    size_t rows, best = 0;
    const struct hnn_row *history = hnn_trainer_history(trainer, &rows);
    for (size_t k = 0; k < rows; k++)
        if (history[k].test_loss < history[best].test_loss)
            best = k;
    assert_int_equal(history[rows - 1].step, history[best].step + 300);
    assert_close(loss_of(model, &test), history[best].test_loss, 1e-12, 0);
    assert_true(history[rows - 1].test_loss > history[best].test_loss);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    small_samples_free(&train);
    small_samples_free(&test);
}

static void test_not_finite(void **state)
{
    (void)state;
    struct hnn_samples train = small_pendulum(1, 40, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    s.activation = "relu";
    hnn_model *model = small_model(&s), *start = small_model(&s);
    struct hnn_training training = hnn_training_defaults();
    training.optimiser = hnn_optimisers[2];
    training.learning_rate = 1e9;
    hnn_trainer *trainer = trainer_of(model, &training, &train, &none);
    struct ad_error error = {0};
    enum hnn_stop stop;
    assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_E_NONFINITE);
    assert_non_null(strstr(error.message, "step"));
    assert_memory_equal(hnn_model_parameters(model), hnn_model_parameters(start),
                        hnn_model_size(model) * sizeof(double));
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    hnn_model_free(start);
    small_samples_free(&train);
}

static void refused(struct hnn_training training, const char *why)
{
    struct hnn_samples train = small_pendulum(1, 10, 0);
    struct hnn_settings s = small_settings(&small_kinds[0], 1, 3);
    hnn_model *model = small_model(&s);
    struct ad_error error = {0};
    hnn_trainer *trainer;
    assert_int_equal(hnn_trainer_new(model, &training, &train, &none, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_null(trainer);
    if (!strstr(error.message, why))
        fail_msg("'%s' does not say '%s'", error.message, why);
    hnn_model_free(model);
    small_samples_free(&train);
}

static void test_refusals(void **state)
{
    (void)state;
    struct hnn_training good = hnn_training_defaults(), t;
    refused((t = good, t.batch = 11, t), "got 11");
    refused((t = good, t.learning_rate = 0, t), "learning rate");
    refused((t = good, t.learning_rate = NAN, t), "learning rate");
    refused((t = good, t.weight_decay = -1, t), "weight decay");
    refused((t = good, t.momentum = 1, t), "momentum");
    refused((t = good, t.average = 1.1, t), "average");
    refused((t = good, t.rollout = 2, t), "time step");
    refused((t = good, t.patience = 2, t), "test samples");
    refused((t = good, t.optimiser = hnn_optimisers[3], t.batch = 5, t), "all samples");
}

/* ---- precision, friction, rollouts ---- */

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
        training.steps = 300;
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
    double before = loss_of(model, &train);
    trained(model, &training, &(struct hnn_samples){.n = N, .x = train.x, .target = later});
    double after = loss_of(model, &train);
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
        cmocka_unit_test(test_large_sets),
        cmocka_unit_test(test_batches),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_average),
        cmocka_unit_test(test_average_rests),
        cmocka_unit_test(test_resume),
        cmocka_unit_test(test_resume_with_patience),
        cmocka_unit_test(test_patience),
        cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_single_follows_double),
        cmocka_unit_test(test_friction),
        cmocka_unit_test(test_rollout),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
