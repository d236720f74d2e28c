/* One step of each optimiser over all elements. Included by kernels.c only, and so built for every
   element type R and instruction set. */
#include <math.h>

#ifdef __FMA__
#define MULADD(a, b, c) F(fma)(a, b, c)
#else
#define MULADD(a, b, c) ((a) * (b) + (c))
#endif

static inline R flush(R x, R least) { return F(fabs)(x) < least ? 0 : x; }

static void sgd(size_t n, void *px, const void *pg, void *pv, const struct ad_step *step)
{
    const R rate = (R)step->rate, keep = (R)step->keep, decay = (R)step->decay;
    const R momentum = (R)step->momentum, least = (R)step->least, *restrict g = pg;
    R *restrict x = px, *restrict v = pv;
#pragma omp simd
    for (size_t i = 0; i < n; i++) {
        v[i] = flush(MULADD(momentum, v[i], MULADD(decay, x[i], g[i])), least);
        x[i] = flush(MULADD(keep, x[i], -rate * v[i]), least);
    }
}

#if defined(__AVX512F__) && defined(AD_KERNEL_F64)
#include "optim_adam512.h"
#else

static void adam(size_t n, void *px, const void *pg, void *pm, void *pv, const struct ad_step *step)
{
    const R rate = (R)step->rate, keep = (R)step->keep, decay = (R)step->decay;
    const R beta1 = (R)step->beta1, beta2 = (R)step->beta2, epsilon = (R)step->epsilon;
    const R least = (R)step->least, least2 = least * least;
    const R rest1 = (R)(1 - step->beta1), rest2 = (R)(1 - step->beta2), *restrict g = pg;
    R *restrict x = px, *restrict m = pm, *restrict v = pv;
#pragma omp simd
    for (size_t i = 0; i < n; i++) {
        R d = MULADD(decay, x[i], g[i]);
        R mean = MULADD(beta1, m[i], rest1 * d), square = MULADD(beta2, v[i], rest2 * d * d);
        x[i] = flush(MULADD(keep, x[i], -rate * mean / (F(sqrt)(square) + epsilon)), least);
        m[i] = flush(mean, least);
        v[i] = flush(square, least2);
    }
}

#endif
