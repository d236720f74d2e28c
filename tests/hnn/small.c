/* Small models and samples for tests (small.h). */
#include "small.h"
#include "tests/close.h"
#include "physics/io/random.h"

#include <stdlib.h>

const struct small_kind small_kinds[] = {
    {"baseline", HNN_BASELINE, HNN_SYMPLECTIC, false, false, 0, false},
    {"hnn", HNN_HAMILTONIAN, HNN_SYMPLECTIC, false, false, 0, false},
    {"conservative", HNN_HAMILTONIAN, HNN_CONSERVATIVE, false, false, 0, false},
    {"both", HNN_HAMILTONIAN, HNN_BOTH, false, false, 0, false},
    {"separable", HNN_HAMILTONIAN, HNN_SYMPLECTIC, true, false, 0, false},
    {"dissipation", HNN_HAMILTONIAN, HNN_SYMPLECTIC, false, true, 0, false},
    {"separable, dissipation", HNN_HAMILTONIAN, HNN_SYMPLECTIC, true, true, 0, false},
    {"lnn", .kind = HNN_LAGRANGIAN},
    {"separable, angle", HNN_HAMILTONIAN, HNN_SYMPLECTIC, .separable = true, .angles = 1},
    {"lnn, angle", .kind = HNN_LAGRANGIAN, .angles = 1},
    {"lnn, quadratic", .kind = HNN_LAGRANGIAN, .angles = 1, .quadratic = true},
};
const size_t small_n_kinds = sizeof small_kinds / sizeof *small_kinds;

struct hnn_settings small_settings(const struct small_kind *kind, size_t dof, size_t layers)
{
    struct hnn_settings s = hnn_defaults(kind->kind, dof);
    s.layers = layers;
    for (size_t k = 0; k + 1 < layers; k++)
        s.hidden[k] = k % 2 ? 5 : 7;
    s.field = kind->field;
    s.separable = kind->separable;
    s.dissipation = kind->dissipation;
    s.angles = kind->angles;
    s.quadratic = kind->quadratic;
    s.precision = AD_F64;
    s.seed = 11;
    return s;
}

hnn_model *small_model(const struct hnn_settings *settings)
{
    struct ad_error error = {0};
    hnn_model *model;
    if (hnn_model_new(settings, &model, &error) != AD_OK)
        fail_msg("%s", error.message);
    return model;
}

double *small_values(uint64_t seed, size_t rows, size_t n)
{
    struct phys_random random;
    double *values = malloc(rows * n * sizeof *values);
    assert_non_null(values);
    phys_random_seed(&random, seed);
    for (size_t k = 0; k < rows * n; k++)
        values[k] = 2.4 * phys_random_uniform(&random) - 1.2;
    return values;
}

struct hnn_samples small_pendulum(uint64_t seed, size_t n, double friction)
{
    double *x = small_values(seed, 2, n), *rate = malloc(2 * n * sizeof *rate);
    assert_non_null(rate);
    for (size_t k = 0; k < n; k++) {
        double q = x[k] *= 1.25, p = x[n + k] *= 1.25;
        rate[k] = p;
        rate[n + k] = -sin(q) - friction * p;
    }
    return (struct hnn_samples){.n = n, .x = x, .target = rate};
}

void small_samples_free(struct hnn_samples *samples)
{
    free((void *)(uintptr_t)samples->x);
    free((void *)(uintptr_t)samples->target);
}

const struct hnn_samples small_none = {.n = 0};

hnn_trainer *small_trainer(hnn_model *model, const struct hnn_training *training,
                           const struct hnn_samples *train, const struct hnn_samples *test)
{
    struct ad_error error = {0};
    hnn_trainer *trainer;
    if (hnn_trainer_new(model, training, train, test, &trainer, &error) != AD_OK)
        fail_msg("%s", error.message);
    return trainer;
}

enum hnn_stop small_run(hnn_trainer *trainer)
{
    struct ad_error error = {0};
    enum hnn_stop stop;
    if (hnn_trainer_run(trainer, &stop, &error) != AD_OK)
        fail_msg("%s", error.message);
    return stop;
}

double small_loss(hnn_model *model, const struct hnn_samples *samples)
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
