/* A training step of the published Hamiltonian network written by hand, as a program without
   automatic differentiation would have it: the baseline of `leastaction chart hnn`.

   H(q, p) = w3 . tanh(W2 tanh(W1 x + b1) + b2), x = (q, p), in f32; the loss is the mean square of
   (H_p, -H_q) less the rates. Arrays are those of the library: x and rates [2 x batch], row-major,
   and parameters one after another, W1 [width x 2], b1, W2 [width x width], b2, w3 [width]. */
#ifndef APPS_BENCH_HAND_HAND_HNN_H
#define APPS_BENCH_HAND_HAND_HNN_H

#include <stddef.h>

struct hand_hnn_shape {
    size_t width, batch;
};

struct hand_hnn {
    /* Fills gradient [parameters] and returns the loss; `room` holds hand_hnn_room floats. */
    double (*gradient)(const struct hand_hnn_shape *shape, const float *parameters, const float *x,
                       const float *rates, float *gradient, float *room);
    /* Step number `step`, from 1, of Adam at the usual settings, rate 1e-3 and weight decay;
       moments [2 parameters] begin as zeros. */
    void (*adam)(size_t parameters, size_t step, double weight_decay, const float *gradient,
                 float *moments, float *x);
};

static inline size_t hand_hnn_parameters(size_t width) { return (width + 5) * width; }
/* Samples in a block; there is room for six matrices of one. */
enum { HAND_HNN_BLOCK = 192 };
static inline size_t hand_hnn_room(size_t width) { return 6 * width * HAND_HNN_BLOCK; }

/* As compiled for the k-th best instruction set of this machine; NULL past the last. */
const struct hand_hnn *hand_hnn_build(int k);

#endif
