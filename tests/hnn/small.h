/* Small models and samples for tests. */
#ifndef TESTS_HNN_SMALL_H
#define TESTS_HNN_SMALL_H

#include "hnn/hnn.h"

/* A kind of model, by name. */
struct small_kind {
    const char *name;
    enum hnn_kind kind;
    enum hnn_field_type field;
    bool separable, dissipation;
    uint64_t angles;
    bool quadratic;
};
extern const struct small_kind small_kinds[];
extern const size_t small_n_kinds;

/* Settings of that kind: f64, hidden layers of 7 and 5 units (as many as `layers` asks for). */
struct hnn_settings small_settings(const struct small_kind *kind, size_t dof, size_t layers);
/* A model; fails the test if there is none. */
hnn_model *small_model(const struct hnn_settings *settings);
/* `rows` x `n` irregular values within +-1.2, to be freed. */
double *small_values(uint64_t seed, size_t rows, size_t n);
/* States [2 x n] within +-1.5, and the rates of q' = p, p' = -sin q - friction p. */
struct hnn_samples small_pendulum(uint64_t seed, size_t n, double friction);
void small_samples_free(struct hnn_samples *samples);
extern const struct hnn_samples small_none;

/* A trainer, and all its steps; whatever fails, fails the test. */
hnn_trainer *small_trainer(hnn_model *model, const struct hnn_training *training,
                           const struct hnn_samples *train, const struct hnn_samples *test);
enum hnn_stop small_run(hnn_trainer *trainer);
/* The loss on rates as it is defined, from the field itself. */
double small_loss(hnn_model *model, const struct hnn_samples *samples);

#endif
