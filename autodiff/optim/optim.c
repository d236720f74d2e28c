/* First-order optimisers (autodiff/optim.h). Adam: D. P. Kingma, J. Ba, "Adam: a method for
   stochastic optimization", ICLR 2015, algorithm 1; AdamW: I. Loshchilov, F. Hutter, "Decoupled
   weight decay regularization", ICLR 2019. */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "autodiff/internal.h"
#include "autodiff/kernels/kernels.h"
#include "autodiff/optim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct ad_optimiser {
    struct ad_optimiser_settings settings;
    const struct ad_kernels *kernels;
    size_t n, moment_bytes, moments;
    uint64_t steps, counted;
    double power1, power2; /* beta^counted */
    char *state;           /* [moments x n] */
};

void ad_optimiser_defaults_to(struct ad_optimiser_settings *settings,
                              enum ad_optimiser_method method)
{
    const struct ad_optimiser_settings defaults = {.size = sizeof defaults,
                                                   .method = method,
                                                   .learning_rate = 1e-3,
                                                   .beta1 = 0.9,
                                                   .beta2 = 0.999,
                                                   .epsilon = 1e-8};
    AD_GIVE(settings, &defaults);
}

/* Replaces zeros by defaults. */
static void set_defaults(struct ad_optimiser_settings *s)
{
    const struct ad_optimiser_settings usual = ad_optimiser_defaults(s->method);
    double *const given[] = {&s->learning_rate, &s->beta1, &s->beta2, &s->epsilon};
    const double defaults[] = {usual.learning_rate, usual.beta1, usual.beta2, usual.epsilon};
    for (size_t k = 0; k < LENGTH(given); k++)
        if (*given[k] == 0)
            *given[k] = defaults[k];
}

static enum ad_status check_settings(const struct ad_optimiser_settings *s, struct ad_error *error)
{
    const struct {
        const char *name;
        double value, least, below;
    } ranges[] = {
        {"learning rate", s->learning_rate, 0, INFINITY},
        {"momentum", s->momentum, 0, 1},
        {"beta1", s->beta1, 0, 1},
        {"beta2", s->beta2, 0, 1},
        {"epsilon", s->epsilon, 0, INFINITY},
        {"weight decay", s->weight_decay, 0, INFINITY},
        {"least", s->least, 0, INFINITY},
    };
    if (s->method != AD_SGD && s->method != AD_ADAM)
        return ad_fail(error, AD_E_ARGUMENT, "optimiser: no method has number %d", (int)s->method);
    for (size_t k = 0; k < LENGTH(ranges); k++)
        if (!(ranges[k].value >= ranges[k].least && ranges[k].value < ranges[k].below))
            return ad_fail(error, AD_E_ARGUMENT,
                           "optimiser: %s %g; expected at least %g and less than %g",
                           ranges[k].name, ranges[k].value, ranges[k].least, ranges[k].below);
    return AD_OK;
}

ad_optimiser *ad_optimiser_new(const struct ad_optimiser_settings *settings, enum ad_type type,
                               size_t n, struct ad_error *error)
{
    struct ad_error own = {0};
    struct ad_optimiser_settings s;
    error = error ? error : &own;
    if (AD_LACKS(error, settings) || !AD_TAKE(&s, settings, least, error))
        return NULL;
    set_defaults(&s);
    if (check_settings(&s, error) != AD_OK)
        return NULL;
    ad_optimiser *o = n > SIZE_MAX / 4 / sizeof(double) ? NULL : malloc(sizeof *o);
    if (!o) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return NULL;
    }
    *o = (ad_optimiser){.settings = s,
                        .kernels = ad_kernels_for(type),
                        .n = n,
                        .moment_bytes = n * type_bytes(type),
                        .moments = settings->method == AD_ADAM ? 2 : 1,
                        .power1 = 1,
                        .power2 = 1};
    size_t bytes = aligned(o->moments * o->moment_bytes + 1);
    o->state = aligned_alloc(ALIGNMENT, bytes);
    if (!o->state) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        free(o);
        return NULL;
    }
    memset(o->state, 0, bytes);
    return o;
}

void ad_optimiser_free(ad_optimiser *optimiser)
{
    if (!optimiser)
        return;
    AD_FREE(optimiser->state, optimiser);
}

/* Counts a step. beta^steps is one product a step, so that its bits depend on the number of steps
   alone; after a checkpoint is restored it is computed again from the start. It is set to zero once
   1 - beta^steps is 1, because products of subnormal numbers are slow. */
static void count_step(ad_optimiser *o)
{
    if (o->counted != o->steps) {
        o->counted = 0;
        o->power1 = o->power2 = 1;
    }
    o->steps++;
    for (; o->counted < o->steps; o->counted++) {
        o->power1 = o->power1 > 0x1p-100 ? o->power1 * o->settings.beta1 : 0;
        o->power2 = o->power2 > 0x1p-100 ? o->power2 * o->settings.beta2 : 0;
        if (o->power1 + o->power2 == 0)
            o->counted = o->steps - 1;
    }
}

/* m/c1 / (sqrt(v/c2) + epsilon) with c = 1 - beta^t equals sqrt(c2)/c1 m / (sqrt(v) + epsilon
   sqrt(c2)): the bias corrections cost nothing per element. */
static void correct_bias(struct ad_step *step, const ad_optimiser *o)
{
    double root2 = sqrt(1 - o->power2);
    step->rate *= root2 / (1 - o->power1);
    step->epsilon *= root2;
}

void ad_optimiser_step(ad_optimiser *optimiser, void *x, const void *g)
{
    ad_optimiser *o = optimiser;
    if (!o || !x || !g)
        return;
    const struct ad_optimiser_settings *s = &o->settings;
    struct ad_step step = {.rate = s->learning_rate,
                           .keep = s->decoupled ? 1 - s->learning_rate * s->weight_decay : 1,
                           .decay = s->decoupled ? 0 : s->weight_decay,
                           .momentum = s->momentum,
                           .beta1 = s->beta1,
                           .beta2 = s->beta2,
                           .epsilon = s->epsilon,
                           .least = s->least};
    count_step(o);
    if (s->method == AD_SGD) {
        o->kernels->sgd(o->n, x, g, o->state, &step);
    } else {
        correct_bias(&step, o);
        o->kernels->adam(o->n, x, g, o->state, o->state + o->moment_bytes, &step);
    }
}

void ad_optimiser_set_rate(ad_optimiser *optimiser, double learning_rate)
{
    bool usable = learning_rate >= 0 && isfinite(learning_rate);
    if (optimiser)
        optimiser->settings.learning_rate = usable ? learning_rate : (double)NAN;
}

uint64_t *ad_optimiser_steps(ad_optimiser *optimiser)
{
    return optimiser ? &optimiser->steps : NULL;
}

void *ad_optimiser_state(ad_optimiser *optimiser, size_t *bytes)
{
    if (bytes)
        *bytes = optimiser ? optimiser->moments * optimiser->moment_bytes : 0;
    return optimiser ? optimiser->state : NULL;
}
