/* Losses on rollouts by symplectic steps: against JAX (scripts/peers/stepping_jax.py), and what the
   methods do not suit. */
#include "tests/hnn/small.h"
#include "tests/close.h"
#include "tests/mentions.h"
#include "hnn/train/train.h"

#include <stdlib.h>

enum { DOF = 2, STATES = 2 * DOF, SAMPLES = 2, STEPS = 2 };

static hnn_model *make(bool separable)
{
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, DOF);
    s.layers = 2;
    s.hidden[0] = 3;
    s.separable = separable;
    s.precision = AD_F64;
    hnn_model *model = small_model(&s);
    double w[64];
    for (size_t k = 0; k < hnn_model_size(model); k++)
        w[k] = 0.7 * sin(1 + 1.3 * (double)k);
    hnn_model_set_parameters(model, w);
    return model;
}

static void fill(double *x, double *target, double *steps)
{
    for (size_t k = 0; k < SAMPLES; k++)
        for (size_t j = 0; j < STEPS; j++) {
            double i = (double)k;
            steps[j * SAMPLES + k] = 0.3 + 0.1 * (double)j + 0.05 * i;
            for (size_t r = 0; r < STATES; r++) {
                double row = (double)r;
                x[r * SAMPLES + k] = 0.9 * sin(1 + 2.3 * row + 1.7 * i);
                target[(j * STATES + r) * SAMPLES + k] =
                    0.8 * cos(2 + 1.9 * row + 1.1 * i + 0.7 * (double)j);
            }
        }
}

/* Loss, two elements of its gradient, and the gradient's norm. */
static void test_against_jax(void **state)
{
    (void)state;
    static const struct {
        enum hnn_stepping stepping;
        double loss, second, last_but_one, norm;
    } known[] = {
        {HNN_LEAPFROG, 1.093094685367176, -0.0165966580462023, -0.1508350563291579,
         0.3641198252623064},
        {HNN_MIDPOINT, 1.026111006955245, -0.1201662020093237, 0.0460326434968644,
         0.3384399369468024},
    };
    for (size_t c = 0; c < LENGTH(known); c++) {
        double x[STATES * SAMPLES], target[STEPS * STATES * SAMPLES], steps[STEPS * SAMPLES];
        fill(x, target, steps);
        struct hnn_samples samples = {.n = SAMPLES, .x = x, .target = target, .steps = steps};
        struct hnn_training training = hnn_training_defaults();
        training.rollout = STEPS;
        training.stepping = known[c].stepping;
        hnn_model *model = make(known[c].stepping == HNN_LEAPFROG);
        hnn_trainer *trainer = small_trainer(model, &training, &samples, &small_none);
        assert_close(hnn_trainer_train_loss(trainer), known[c].loss, 1e-10, 0);
        assert_close(hnn_problem_evaluate(&trainer->problem), known[c].loss, 1e-10, 0);
        const double *g = hnn_problem_gradient(&trainer->problem);
        size_t n = hnn_model_size(model);
        double square = 0;
        for (size_t k = 0; k < n; k++)
            square += g[k] * g[k];
        assert_close(g[1], known[c].second, 1e-10, 1e-12);
        assert_close(g[n - 2], known[c].last_but_one, 1e-10, 1e-12);
        assert_close(sqrt(square), known[c].norm, 1e-10, 0);
        hnn_trainer_free(trainer);
        hnn_model_free(model);
    }
}

/* The equation of a step much longer than the motion's time has no solution that Newton's method
   finds: no loss rather than a wrong one. */
static void test_no_solution(void **state)
{
    (void)state;
    double x[STATES * SAMPLES], target[STEPS * STATES * SAMPLES];
    double steps[STEPS * SAMPLES] = {40, 40, 40, 40};
    fill(x, target, (double[STEPS * SAMPLES]){0});
    struct hnn_samples samples = {.n = SAMPLES, .x = x, .target = target, .steps = steps};
    struct hnn_training training = hnn_training_defaults();
    training.rollout = STEPS;
    training.stepping = HNN_MIDPOINT;
    hnn_model *model = make(false);
    hnn_trainer *trainer = small_trainer(model, &training, &samples, &small_none);
    struct ad_error error = {0};
    assert_int_equal(hnn_trainer_run(trainer, NULL, &error), AD_E_NONFINITE);
    assert_mentions(error.message, "shorter time steps");
    assert_null(strstr(error.message, "rate"));
    hnn_trainer_free(trainer);
    hnn_model_free(model);
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        int stepping;
        size_t rollout, dof;
        bool separable, dissipation;
        const char *says;
    } wrong[] = {
        {HNN_LEAPFROG, 1, 1, false, false, "separable"},
        {HNN_LEAPFROG, 1, 1, true, true, "dissipation"},
        {HNN_LEAPFROG, 0, 1, true, false, "rollouts"},
        {HNN_MIDPOINT, 1, 17, false, false, "16 coordinates"},
        {3, 1, 1, false, false, "stepping"},
    };
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, wrong[k].dof);
        s.separable = wrong[k].separable;
        s.dissipation = wrong[k].dissipation;
        hnn_model *model = small_model(&s);
        double zero[2 * 17] = {0}, one = 1;
        struct hnn_samples samples = {.n = 1, .x = zero, .target = zero, .steps = &one};
        struct hnn_training training = hnn_training_defaults();
        training.rollout = wrong[k].rollout;
        training.stepping = (enum hnn_stepping)wrong[k].stepping;
        struct ad_error error = {0};
        hnn_trainer *trainer;
        assert_int_equal(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error),
                         AD_E_ARGUMENT);
        assert_mentions(error.message, wrong[k].says);
        hnn_model_free(model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_jax),
        cmocka_unit_test(test_no_solution),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests_name("stepping", tests, NULL, NULL);
}
