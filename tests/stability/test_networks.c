/* Limits of Hamiltonian networks: motion with friction has no Hamiltonian, and beyond the energies
   of its training a network is undetermined. */
#include "tests/close.h"

#include "hnn/rollout/rollout.h"
#include "tests/mentions.h"

enum { SAMPLES = 208, WIDTH = 32 };

/* A model trained on these samples; its loss. */
static hnn_model *train(const struct hnn_settings *settings, const double *x, const double *rate,
                        size_t steps, double *loss)
{
    struct ad_error error = {0};
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    enum hnn_stop stop;
    struct hnn_training training = hnn_training_defaults();
    struct hnn_samples samples = {.n = SAMPLES, .x = x, .target = rate}, none = {.n = 0};
    training.optimiser = hnn_optimiser_find("lbfgs", &error);
    training.steps = steps;
    training.weight_decay = 0;
    if (hnn_model_new(settings, &model, &error) != AD_OK ||
        hnn_trainer_new(model, &training, &samples, &none, &trainer, &error) != AD_OK ||
        hnn_trainer_run(trainer, &stop, &error) != AD_OK)
        fail_msg("%s", error.message);
    *loss = hnn_trainer_train_loss(trainer);
    hnn_trainer_free(trainer);
    return model;
}

static struct hnn_settings small(enum hnn_kind kind)
{
    struct hnn_settings s = hnn_defaults(kind, 1);
    s.precision = AD_F64;
    s.hidden[0] = s.hidden[1] = WIDTH;
    return s;
}

/* ---- friction ---- */

static const double friction = 0.2;

/* q' = p, p' = -q - g p on a disc of radius sqrt(2), evenly (H. Vogel's spiral): <r^2> = 1. */
static void rub(double *x, double *rate)
{
    for (size_t k = 0; k < SAMPLES; k++) {
        double r = sqrt(2 * ((double)k + 0.5) / SAMPLES), angle = 2.399963229728653 * (double)k;
        double q = x[k] = r * cos(angle), p = x[SAMPLES + k] = r * sin(angle);
        rate[k] = p;
        rate[SAMPLES + k] = -q - friction * p;
    }
}

static double loss_with_friction(const struct hnn_settings *settings)
{
    double x[2 * SAMPLES], rate[2 * SAMPLES], loss;
    rub(x, rate);
    hnn_model_free(train(settings, x, rate, 800, &loss));
    return loss;
}

/* Symplectic fields have no divergence. What is orthogonal to all of them on the disc is grad phi
   with phi = 0 on its edge; the friction's share there has the divergence -g, so phi = g (R^2 -
   r^2)/4, and the mean square of a component of its gradient is g^2 <r^2>/8 = 0.005. */
static void test_friction(void **state)
{
    (void)state;
    struct hnn_settings hamiltonian = small(HNN_HAMILTONIAN), baseline = small(HNN_BASELINE);
    double floor = friction * friction / 8;
    assert_close(loss_with_friction(&hamiltonian), floor, 0.01, 0);
    assert_true(loss_with_friction(&baseline) < 1e-6);
    hamiltonian.dissipation = true;
    assert_true(loss_with_friction(&hamiltonian) < 1e-6);
}

/* ---- beyond the training ---- */

/* The pendulum H = p^2 + 3 (1 - cos q), seen at energies from 1.8 to 5.5. */
static void field(double q, double p, double *rate)
{
    rate[0] = 2 * p;
    rate[1] = -3 * sin(q);
}

/* A point of the level E, by an angle: p^2 = E cos^2, 3 (1 - cos q) = E sin^2. */
static void on_level(double E, double angle, double *y)
{
    double s = sin(angle);
    y[0] = copysign(acos(1 - E * s * s / 3), s);
    y[1] = sqrt(E) * cos(angle);
}

static void swing(double *x, double *rate)
{
    for (size_t k = 0; k < SAMPLES; k++) {
        double y[2], r[2];
        on_level(1.8 + 3.7 * ((double)k + 0.5) / SAMPLES, 2.399963229728653 * (double)k, y);
        field(y[0], y[1], r);
        x[k] = y[0], x[SAMPLES + k] = y[1];
        rate[k] = r[0], rate[SAMPLES + k] = r[1];
    }
}

/* Errors of the rates on a level: root mean square, and the largest. */
struct field_error {
    double rms, most;
};
static struct field_error field_error(hnn_model *model, double E)
{
    enum { POINTS = 200 };
    struct field_error error = {0};
    for (int k = 0; k < POINTS; k++) {
        double y[2], rate[2], found[2];
        on_level(E, 2 * M_PI * k / POINTS, y);
        field(y[0], y[1], rate);
        assert_int_equal(hnn_model_field(model, y, found), AD_OK);
        double miss = hypot(found[0] - rate[0], found[1] - rate[1]);
        error.rms += miss * miss / POINTS;
        error.most = fmax(error.most, miss);
    }
    error.rms = sqrt(error.rms);
    return error;
}

/* What is said of a rollout from a level: NULL if nothing is. */
static const char *said(hnn_model *model, double E, char *what, size_t size)
{
    enum { POINTS = 50 };
    struct ad_error error = {0};
    struct phys_ode ode;
    struct hnn_path path;
    struct hnn_rollout_info info;
    double t[POINTS], x0[2];
    on_level(E, 0.3, x0);
    hnn_times(0, 2, POINTS, t);
    if (hnn_model_ode(model, &ode, &error) != AD_OK ||
        hnn_rollout(&ode,
                    &(struct hnn_rollout_settings){
                        .size = sizeof(struct hnn_rollout_settings), .n = POINTS, .t = t},
                    x0, &path, &info, &error) != AD_OK)
        fail_msg("%s", error.message);
    bool outside = hnn_path_outside(model, &path, what, size) < path.n;
    hnn_path_free(&path);
    return outside ? what : NULL;
}

static hnn_model *trained_on_swings(uint64_t seed, size_t steps)
{
    double x[2 * SAMPLES], rate[2 * SAMPLES], loss;
    struct hnn_settings settings = small(HNN_HAMILTONIAN);
    settings.start = HNN_HE;
    settings.seed = seed;
    swing(x, rate);
    return train(&settings, x, rate, steps, &loss);
}

/* The known errors, 0.003 inside, 0.22 at E = 0.13, 0.86 at E = 5.97, come without the network they
   are of. Largest errors next to the separatrix, E = 6, are from 0.55 to 0.92 whatever it is: He,
   Xavier or orthogonal starts, 32 or 64 units, 300 or 800 steps. At the centre, which lies far from
   anything seen, all depends on how the weights began, root mean squares are 0.09 to 0.7 from He
   starts and 0.02 to 0.1 from the others; so these are of He starts. Published data, with their
   noise of 0.1, allow no 0.003 inside: 200 units and 2000 steps of Adam give 0.037, 0.08 to 0.11,
   and 1.1. Of several seeds the geometric mean; one alone may differ by a factor of 2.5 at the
   centre. */
static void test_errors_beyond_training(void **state)
{
    (void)state;
    enum { SEEDS = 5 };
    static const double known[] = {0.003, 0.22, 0.86};
    double mean[3] = {1, 1, 1};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        hnn_model *model = trained_on_swings(seed, 800);
        double error[] = {field_error(model, 3).rms, field_error(model, 0.13).rms,
                          field_error(model, 5.97).most};
        print_message("seed %d: %.4f inside, %.3f at E = 0.13, %.3f at E = 5.97\n", (int)seed,
                      error[0], error[1], error[2]);
        for (int k = 0; k < 3; k++)
            mean[k] *= pow(error[k], 1.0 / SEEDS);
        hnn_model_free(model);
    }
    for (int k = 0; k < 3; k++)
        if (!(mean[k] < 2 * known[k] && mean[k] > known[k] / 2))
            fail_msg("%g, expected %g within a factor of 2", mean[k], known[k]);
}

static void test_said_beyond_training(void **state)
{
    (void)state;
    char what[120];
    hnn_model *model = trained_on_swings(0, 50);
    assert_null(said(model, 3, what, sizeof what));
    assert_non_null(said(model, 0.13, what, sizeof what));
    assert_mentions(what, "training");
    assert_non_null(said(model, 5.97, what, sizeof what));
    assert_mentions(what, "training");
    hnn_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_friction),
        cmocka_unit_test(test_errors_beyond_training),
        cmocka_unit_test(test_said_beyond_training),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
