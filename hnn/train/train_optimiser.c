/* The table of training methods, and those of first order (autodiff/optim.h). */
#include "train.h"

#include <float.h>
#include <math.h>

static void *create(const struct hnn_training *training, enum ad_type type, size_t n,
                    enum ad_optimiser_method method, bool decoupled)
{
    struct ad_optimiser_settings s = ad_optimiser_defaults(method);
    s.learning_rate = training->learning_rate;
    s.weight_decay = training->weight_decay;
    s.momentum = training->momentum;
    s.decoupled = decoupled;
    /* Weights of pixels that are always dark, and of dead units, only decay: half of the network.
       Products of two parameters that are left are never subnormal. */
    s.least = sqrt(type == AD_F32 ? (double)FLT_MIN : DBL_MIN);
    return ad_optimiser_new(&s, type, n, NULL);
}

static void *create_adam(const struct hnn_training *training, enum ad_type type, size_t n)
{
    return create(training, type, n, AD_ADAM, false);
}

static void *create_adamw(const struct hnn_training *training, enum ad_type type, size_t n)
{
    return create(training, type, n, AD_ADAM, true);
}

static void *create_sgd(const struct hnn_training *training, enum ad_type type, size_t n)
{
    return create(training, type, n, AD_SGD, false);
}

static void destroy(void *method) { ad_optimiser_free(method); }

static bool step(void *method, const struct hnn_problem *problem, double rate, double *loss)
{
    *loss = hnn_problem_evaluate(problem);
    ad_optimiser_set_rate(method, rate);
    ad_optimiser_step(method, hnn_problem_point(problem), hnn_problem_gradient(problem));
    return true;
}

static uint64_t *count(void *method) { return ad_optimiser_steps(method); }

static void *state(void *method, size_t *n, enum ad_type *type)
{
    size_t bytes;
    void *values = ad_optimiser_state(method, &bytes);
    *n = bytes / hnn_type_bytes(*type);
    return values;
}

static const struct hnn_optimiser adam = {
    "adam", "weight decay as a force, as published", false, create_adam, destroy, step, count,
    state};
static const struct hnn_optimiser adamw = {
    "adamw", "weight decay apart from the gradient", false, create_adamw, destroy, step, count,
    state};
static const struct hnn_optimiser sgd = {"sgd", "with momentum", false, create_sgd, destroy,
                                         step,  count,           state};

const struct hnn_optimiser *const hnn_optimisers[] = {&adam, &adamw, &sgd, &hnn_lbfgs, NULL};

const char *hnn_optimiser_name(const struct hnn_optimiser *optimiser)
{
    return optimiser ? optimiser->name : NULL;
}

const struct hnn_optimiser *hnn_optimiser_find(const char *name, struct ad_error *error)
{
    const char *names[LENGTH(hnn_optimisers)] = {NULL};
    size_t k = 0;
    for (; hnn_optimisers[k]; k++)
        names[k] = hnn_optimisers[k]->name;
    return hnn_find("optimiser", name, names, &k, error) == AD_OK ? hnn_optimisers[k] : NULL;
}
