/* First-order optimisers.
   Adam: D. P. Kingma, J. Ba, "Adam: a method for stochastic optimization", ICLR 2015, algorithm 1;
   AdamW: I. Loshchilov, F. Hutter, "Decoupled weight decay regularization", ICLR 2019. */
#include "internal.h"
#include "kernels.h"
#include "optim.h"

#include <math.h>
#include <stdlib.h>

struct ad_optimiser {
    struct ad_optimiser_settings settings;
    const struct ad_kernels *kernels;
    size_t n, moment_bytes, moments;
    uint64_t steps;
    char *state; /* [moments x n] */
};

struct ad_optimiser_settings ad_optimiser_defaults(enum ad_optimiser_method method)
{
    return (struct ad_optimiser_settings){
        .method = method, .learning_rate = 1e-3, .beta1 = 0.9, .beta2 = 0.999, .epsilon = 1e-8};
}

ad_optimiser *ad_optimiser_new(const struct ad_optimiser_settings *settings, enum ad_type type,
                               size_t n)
{
    if (n > SIZE_MAX / 2 / sizeof(double))
        return NULL;
    ad_optimiser *o = malloc(sizeof *o);
    if (!o)
        return NULL;
    *o = (ad_optimiser){.settings = *settings,
                        .kernels = ad_kernels_for(type),
                        .n = n,
                        .moment_bytes = n * type_bytes(type),
                        .moments = settings->method == AD_ADAM ? 2 : 1};
    o->state = calloc(o->moments * n + 1, type_bytes(type));
    if (!o->state) {
        free(o);
        return NULL;
    }
    return o;
}

void ad_optimiser_free(ad_optimiser *optimiser)
{
    if (!optimiser)
        return;
    free(optimiser->state);
    free(optimiser);
}

/* beta^t by squaring: a function of t alone, so a resumed run is bitwise the run never stopped, and
   a third of the time of pow, which for a few hundred elements is worth having. */
static double power(double beta, uint64_t t)
{
    double result = 1;
    for (; t && beta > 0; t >>= 1, beta *= beta)
        result *= t & 1 ? beta : 1;
    return t ? 0 : result;
}

/* m/c1 / (sqrt(v/c2) + epsilon) with c = 1 - beta^t is
   sqrt(c2)/c1 m / (sqrt(v) + epsilon sqrt(c2)): the corrections cost nothing per element. */
static void correct_bias(struct ad_step *step, uint64_t t)
{
    double root2 = sqrt(1 - power(step->beta2, t));
    step->rate *= root2 / (1 - power(step->beta1, t));
    step->epsilon *= root2;
}

void ad_optimiser_step(ad_optimiser *optimiser, void *x, const void *g)
{
    ad_optimiser *o = optimiser;
    const struct ad_optimiser_settings *s = &o->settings;
    struct ad_step step = {.rate = s->learning_rate,
                           .keep = s->decoupled ? 1 - s->learning_rate * s->weight_decay : 1,
                           .decay = s->decoupled ? 0 : s->weight_decay,
                           .momentum = s->momentum,
                           .beta1 = s->beta1,
                           .beta2 = s->beta2,
                           .epsilon = s->epsilon};
    o->steps++;
    if (s->method == AD_SGD) {
        o->kernels->sgd(o->n, x, g, o->state, &step);
    } else {
        correct_bias(&step, o->steps);
        o->kernels->adam(o->n, x, g, o->state, o->state + o->moment_bytes, &step);
    }
}

void ad_optimiser_set_rate(ad_optimiser *optimiser, double learning_rate)
{
    optimiser->settings.learning_rate = learning_rate;
}

uint64_t *ad_optimiser_steps(ad_optimiser *optimiser) { return &optimiser->steps; }

void *ad_optimiser_state(ad_optimiser *optimiser, size_t *bytes)
{
    *bytes = optimiser->moments * optimiser->moment_bytes;
    return optimiser->state;
}
