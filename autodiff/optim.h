/* First-order optimisers over one flat vector of n elements (f32 or f64). x and g belong to the
   caller; a step updates x in place and allocates nothing.

   Lifetime: what *_new makes lives until its *_free. Threads: as in autodiff.h. */
#ifndef AUTODIFF_OPTIM_H
#define AUTODIFF_OPTIM_H

#include "autodiff.h"

AD_HEADER_BEGIN

enum ad_optimiser_method { AD_SGD, AD_ADAM };

/* learning_rate, beta1, beta2 and epsilon of 0 mean the default; the other members are off at 0. */
struct ad_optimiser_settings {
    size_t size; /* sizeof(struct ad_optimiser_settings) */
    enum ad_optimiser_method method;
    double learning_rate;
    double momentum;              /* SGD: v = momentum v + g, x -= rate v */
    double beta1, beta2, epsilon; /* Adam (Kingma and Ba 2015, algorithm 1) */
    double weight_decay;          /* g += weight_decay x, as in PyTorch's Adam and SGD ... */
    bool decoupled;               /* ... or x -= rate weight_decay x (AdamW) */
    double
        least; /* elements of x, velocity and mean below this become 0: values that only decay would
                  become subnormal, and products of subnormal numbers take a hundred cycles */
};

/* The defaults of a method: rate 1e-3, betas .9 and .999, epsilon 1e-8, the rest 0. */
void ad_optimiser_defaults_to(struct ad_optimiser_settings *settings,
                              enum ad_optimiser_method method);
static inline struct ad_optimiser_settings ad_optimiser_defaults(enum ad_optimiser_method method)
{
    struct ad_optimiser_settings settings;
    settings.size = sizeof settings;
    ad_optimiser_defaults_to(&settings, method);
    return settings;
}

typedef struct ad_optimiser ad_optimiser;

/* NULL when memory is exhausted, or for settings out of range: momentum and betas must be in [0,
   1), the others finite and not negative. `error` (may be NULL) names the setting. The functions
   below accept NULL: they do nothing, or return NULL. */
ad_optimiser *ad_optimiser_new(const struct ad_optimiser_settings *settings, enum ad_type type,
                               size_t n, struct ad_error *error);
void ad_optimiser_free(ad_optimiser *optimiser); /* takes NULL */

/* One step: x [n] moves against g [n], both of the optimiser's type. */
void ad_optimiser_step(ad_optimiser *optimiser, void *x, const void *g);
/* Sets the learning rate from the next step on. A rate out of range makes x NaN at the next step.
 */
void ad_optimiser_set_rate(ad_optimiser *optimiser, double learning_rate);

/* State for checkpoints: steps taken, and the moments, `bytes` long (velocity for SGD; m then v for
   Adam), owned by the optimiser. Writing both back resumes bitwise. */
uint64_t *ad_optimiser_steps(ad_optimiser *optimiser);
void *ad_optimiser_state(ad_optimiser *optimiser, size_t *bytes);

AD_HEADER_END
#endif
