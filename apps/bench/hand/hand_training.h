/* Training by the hand-written step (hand.h): the whole batch, Adam, one thread. */
#ifndef APPS_BENCH_HAND_HAND_TRAINING_H
#define APPS_BENCH_HAND_HAND_TRAINING_H

#include "hand.h"
#include "hnn/hnn.h"

struct hand_training {
    struct hand_hnn_shape shape;
    const float *x, *rates; /* [2 x batch] */
    double weight_decay;
    size_t parameters, steps; /* steps: taken so far */
    float *point, *gradient, *moments, *room;
};

/* Whether a network is the one that is written by hand, but for its width. */
bool hand_training_suits(const struct hnn_settings *settings);

/* Begins at the parameters of a model that suits. Samples [2 x batch] are kept by reference.
   AD_E_MEMORY. Ends with hand_training_free, whatever it returned. */
enum ad_status hand_training_new(struct hand_training *training, const hnn_model *model,
                                 size_t batch, const float *x, const float *rates,
                                 double weight_decay, struct ad_error *error);
void hand_training_free(struct hand_training *training);
/* One step; returns the loss before it. */
double hand_training_step(struct hand_training *training);

#endif
