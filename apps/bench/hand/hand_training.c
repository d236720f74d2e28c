/* Hand-written training (hand_training.h). */
#include "hand_training.h"

#include <stdlib.h>
#include <string.h>

bool hand_training_suits(const struct hnn_settings *s)
{
    return s->kind == HNN_HAMILTONIAN && s->precision == AD_F32 && s->dof == 1 && s->layers == 3 &&
           s->hidden[0] == s->hidden[1] && strcmp(s->activation, "tanh") == 0 &&
           s->field == HNN_SYMPLECTIC && !s->separable && !s->dissipation && !s->pixels;
}

enum ad_status hand_training_new(struct hand_training *t, const hnn_model *model, size_t batch,
                                 const float *x, const float *rates, double weight_decay,
                                 struct ad_error *error)
{
    const size_t width = hnn_model_settings(model)->hidden[0], n = hnn_model_size(model);
    *t = (struct hand_training){.shape = {width, batch},
                                .x = x,
                                .rates = rates,
                                .weight_decay = weight_decay,
                                .parameters = n,
                                .point = calloc(4 * n, sizeof(float)),
                                .room = malloc(hand_hnn_room(width) * sizeof(float))};
    if (!t->point || !t->room)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a step of %zu samples", batch);
    t->gradient = t->point + n;
    t->moments = t->gradient + n;
    memcpy(t->point, hnn_model_parameters(model), n * sizeof *t->point);
    return AD_OK;
}

void hand_training_free(struct hand_training *training)
{
    free(training->point);
    free(training->room);
}

double hand_training_step(struct hand_training *t)
{
    const struct hand_hnn *hand = hand_hnn_build(0);
    double loss = hand->gradient(&t->shape, t->point, t->x, t->rates, t->gradient, t->room);
    hand->adam(t->parameters, ++t->steps, t->weight_decay, t->gradient, t->moments, t->point);
    return loss;
}
