/* One step of each optimiser over all elements. Included by kernels.c alone, and so built for every
   element type R and instruction set. */
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __FMA__
#define MULADD(a, b, c) F(fma)(a, b, c)
#else
#define MULADD(a, b, c) ((a) * (b) + (c))
#endif

/* Square root. The root and the quotient of Adam share the divider, 5 cycles an f64 element at any
   vector width. With 8 lanes the multipliers are faster: y near 1/sqrt(v) from halving the exponent
   (off by 3.5 %), then twice the binomial series of (1 - r)^(-1/2), r = 1 - v y^2, which leaves r^4
   and then r^3: 7e-16 at worst. Subnormal v come out too small, far below any epsilon. */
static inline R root(R v)
{
#if defined(__AVX512F__) && defined(AD_KERNEL_F64)
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    bits = 0x5fe6eb50c7b537a9u - (bits >> 1);
    R y;
    memcpy(&y, &bits, sizeof y);
    R s = v * y, r = fma(-s, y, 1.0);
    y = fma(y * r, fma(r, fma(r, 0.3125, 0.375), 0.5), y);
    s = v * y;
    r = fma(-s, y, 1.0);
    s = fma(s * r, fma(r, 0.375, 0.5), s);
    return v <= DBL_MAX ? s : v; /* infinity, NaN */
#else
    return F(sqrt)(v);
#endif
}

static void sgd(size_t n, void *px, const void *pg, void *pv, const struct ad_step *step)
{
    const R rate = (R)step->rate, keep = (R)step->keep, decay = (R)step->decay;
    const R momentum = (R)step->momentum, *restrict g = pg;
    R *restrict x = px, *restrict v = pv;
#pragma omp simd
    for (size_t i = 0; i < n; i++) {
        v[i] = MULADD(momentum, v[i], MULADD(decay, x[i], g[i]));
        x[i] = MULADD(keep, x[i], -rate * v[i]);
    }
}

static void adam(size_t n, void *px, const void *pg, void *pm, void *pv, const struct ad_step *step)
{
    const R rate = (R)step->rate, keep = (R)step->keep, decay = (R)step->decay;
    const R beta1 = (R)step->beta1, beta2 = (R)step->beta2, epsilon = (R)step->epsilon;
    const R rest1 = (R)(1 - step->beta1), rest2 = (R)(1 - step->beta2), *restrict g = pg;
    R *restrict x = px, *restrict m = pm, *restrict v = pv;
#pragma omp simd
    for (size_t i = 0; i < n; i++) {
        R d = MULADD(decay, x[i], g[i]);
        m[i] = MULADD(beta1, m[i], rest1 * d);
        v[i] = MULADD(beta2, v[i], rest2 * d * d);
        x[i] = MULADD(keep, x[i], -rate * m[i] / (root(v[i]) + epsilon));
    }
}
