/* Gradients of the action written by hand, as a program without automatic differentiation would
   have them: the baseline of `leastaction chart gradients`.

   Each kernel is the objective of one scene at its defaults under the rule left+repeat: the mean of
   T - V over slices (and bodies, where there are any). Paths are [dof x HAND_SLICES], row-major,
   the layout of the library. */
#ifndef APPS_BENCH_HAND_HAND_H
#define APPS_BENCH_HAND_HAND_H

#include <stddef.h>

enum { HAND_SLICES = 100 };

/* Fills g [dof x HAND_SLICES]; returns the mean. */
typedef double hand_gradient(const double *x, double *g);

struct hand_kernel {
    const char *scene;
    int dof;
    double dt;
    hand_gradient *gradient;
    double (*primal)(const double *x);
    /* Second derivatives times a vector u: fills h. */
    void (*product)(const double *x, const double *u, double *h);
};

enum { HAND_THREEBODY, HAND_DBLPEND, HAND_EPHEMERIS, HAND_GAS, HAND_N };

/* The kernels [HAND_N] as compiled for the k-th best instruction set of this machine; NULL past the
   last. */
const struct hand_kernel *hand_build(int k);

/* The gradient of a scene at the limit of this machine, by AVX-512 intrinsics (hand_limit.c); where
   there is none, that of the best build. */
hand_gradient *hand_limit(int scene);

/* The same for n slices, more than 8: g and x are [dof x n]; NULL where there is none. */
typedef double hand_long_gradient(int n, const double *x, double *g);
hand_long_gradient *hand_long_limit(int scene);

/* ---- training ---- */

/* A training step of the published Hamiltonian network written by hand, as a program without
   automatic differentiation would have it: the baseline of `leastaction chart hnn`.

   H(q, p) = w3 . tanh(W2 tanh(W1 x + b1) + b2), x = (q, p), in f32; the loss is the mean square of
   (H_p, -H_q) less the rates. Arrays are those of the library: x and rates [2 x batch], row-major,
   and parameters one after another, W1 [width x 2], b1, W2 [width x width], b2, w3 [width]. */
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

/* ---- accelerations ---- */

/* Accelerations written by hand, as a program for one system would have them: the baseline of
   forces.csv (`leastaction chart gradients`). */
enum { HAND_FORCES = 3, HAND_FORCE_DOF = 6, HAND_FORCE_PARAMS = 5 };

struct hand_force {
    const char *scene;
    int dof;
    const char *params[HAND_FORCE_PARAMS]; /* names of p; NULL: no more */
    void (*acceleration)(const double *p, const double *q, const double *v, double *a);
};

/* [HAND_FORCES], as compiled for the best instruction set of this machine. */
const struct hand_force *hand_forces(void);

#endif
