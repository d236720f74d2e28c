/* Gradients of the action written by hand, as a program without automatic differentiation would
   have them: the baseline of `leastaction chart gradients`.

   Each kernel is the objective of one scene at its defaults under the rule left+repeat: the mean of
   T - V over slices (and bodies, where there are any). Paths are [dof x HAND_SLICES], row-major,
   the layout of the library. */
#ifndef APPS_BENCH_HAND_HAND_H
#define APPS_BENCH_HAND_HAND_H

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

#endif
