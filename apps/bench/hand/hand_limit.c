/* Gradients of the action at the limit of AVX-512, by intrinsics: one pass over the slices, eight
   to a register, nothing stored between; reciprocals and roots from the instructions for 14 bits
   and a polynomial; sine and cosine of an angle with one reduction. Functions and layout are those
   of hand_kernels.c; the momenta of the slice before come from a shifted register or from the path.
 */
#include "hand.h"

#include <stdbool.h>

#if defined __x86_64__ && !defined AD_ONLY_BASE

#include <immintrin.h>

#define AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,avx512bw,fma")))
#define INLINE AVX512 static inline __attribute__((always_inline))

typedef __m512d V;

enum { LANES = 8 };

#define ALL(c) _mm512_set1_pd(c)
#define ADD _mm512_add_pd
#define SUB _mm512_sub_pd
#define MUL _mm512_mul_pd
#define FMA _mm512_fmadd_pd   /* a b + c */
#define FNMA _mm512_fnmadd_pd /* c - a b */
#define FMS _mm512_fmsub_pd   /* a b - c */

INLINE __mmask8 lanes(int left) { return left >= LANES ? 0xff : (__mmask8)((1 << left) - 1); }

/* With e = 1 - s y^2, under 2^-12.9: y (1 + e/2 + 3/8 e^2 + ...); relative error under 1.7e-16. */
INLINE V inverse_root(V s)
{
    V y = _mm512_rsqrt14_pd(s), e = FNMA(MUL(s, y), y, ALL(1));
    V p = FMA(FMA(FMA(e, ALL(35.0 / 128), ALL(5.0 / 16)), e, ALL(3.0 / 8)), e, ALL(0.5));
    return FMA(MUL(y, e), p, y);
}

/* With e = 1 - a y, under 2^-14: y (1 + (e + e^2) (1 + e^2)). */
INLINE V inverse(V a)
{
    V y = _mm512_rcp14_pd(a), e = FNMA(a, y, ALL(1)), p = FMA(e, e, e);
    return FMA(y, FMA(p, MUL(e, e), p), y);
}

INLINE V polynomial(V z, int n, const double c[])
{
    V p = ALL(c[0]);
#pragma GCC unroll 8
    for (int k = 1; k < n; k++)
        p = FMA(p, z, ALL(c[k]));
    return p;
}

/* x = k pi/2 + r; the polynomials of fdlibm, absolute error 1.8e-16 for |x| < 1e5. */
INLINE void sine_cosine(V x, V *s, V *c)
{
    static const double S[] = {1.58969099521155010221e-10, -2.50507602534068634195e-08,
                               2.75573137070700676789e-06, -1.98412698298579493134e-04,
                               8.33333333332248946124e-03, -1.66666666666666324348e-01};
    static const double C[] = {-1.13596475577881948265e-11, 2.08757232129817482790e-09,
                               -2.75573143513506633035e-07, 2.48015872894767294178e-05,
                               -1.38888888888741095749e-03, 4.16666666666666019037e-02};
    const __m512i two = _mm512_set1_epi64(2), one = _mm512_set1_epi64(1);
    V k = _mm512_roundscale_pd(MUL(x, ALL(0x1.45f306dc9c883p-1)), 0);
    V r = FNMA(k, ALL(0x1.1a62633145c07p-54), FNMA(k, ALL(0x1.921fb54442d18p0), x)), z = MUL(r, r);
    V a = FMA(MUL(polynomial(z, 6, S), z), r, r);
    V b = FMA(MUL(polynomial(z, 6, C), z), z, FNMA(ALL(0.5), z, ALL(1)));
    __m512i n = _mm512_cvtpd_epi64(k);
    __mmask8 odd = _mm512_test_epi64_mask(n, one);
    __m512i sign_s = _mm512_slli_epi64(_mm512_and_si512(n, two), 62);
    __m512i sign_c = _mm512_slli_epi64(_mm512_and_si512(_mm512_add_epi64(n, one), two), 62);
    *s = _mm512_xor_pd(_mm512_mask_blend_pd(odd, a, b), _mm512_castsi512_pd(sign_s));
    *c = _mm512_xor_pd(_mm512_mask_blend_pd(odd, b, a), _mm512_castsi512_pd(sign_c));
}

/* ---- kinetic energy of unit masses: with x_{-1} = x_0 and x_n = x_{n-2} all slices but n-2 have
        dT/dx_i = ((x_i - x_{i-1}) - (x_{i+1} - x_i)) / dt^2 ---- */

/* dt^2 dT/dx of eight slices; adds the squares of the steps. */
INLINE V inertia(int n, const double *x, int i, V *at, V *squares)
{
    V before, after;
    __mmask8 m = lanes(n - i);
    if (i > 0 && i + LANES < n) {
        before = _mm512_loadu_pd(x + i - 1);
        *at = _mm512_loadu_pd(x + i);
        after = _mm512_loadu_pd(x + i + 1);
    } else if (i == 0) {
        before = _mm512_mask_loadu_pd(ALL(x[0]), 0xfe, x - 1);
        *at = _mm512_loadu_pd(x);
        after = _mm512_loadu_pd(x + 1);
    } else {
        before = _mm512_maskz_loadu_pd(m, x + i - 1);
        *at = _mm512_maskz_loadu_pd(m, x + i);
        after = _mm512_mask_loadu_pd(ALL(x[n - 2]), (__mmask8)(m >> 1), x + i + 1);
    }
    V next = SUB(after, *at);
    *squares = _mm512_mask3_fmadd_pd(next, next, *squares, m);
    return SUB(SUB(*at, before), next);
}

static void mend(int n, int dof, double scale, const double *x, double *g)
{
    for (int k = 0; k < dof; k++)
        g[k * n + n - 2] -= scale * (x[k * n + n - 1] - x[k * n + n - 2]);
}

/* ---- three bodies ---- */

INLINE double threebody_of(int n, const double *x, double *g)
{
    enum { DOF = 6 };
    const double weight = 1.0 / (3 * n), i2 = weight / (0.5 * 0.5), strength = 1.3e-4 * weight;
    const V eps = ALL(1e-6);
    V T = ALL(0), U = ALL(0);
    for (int i = 0; i < n; i += LANES) {
        __mmask8 m = lanes(n - i);
        V p[DOF], h[DOF], u = ALL(0);
#pragma GCC unroll 6
        for (int k = 0; k < DOF; k++)
            h[k] = MUL(ALL(i2), inertia(n, x + k * n, i, &p[k], &T));
#pragma GCC unroll 3
        for (int a = 0; a < DOF; a += 2)
#pragma GCC unroll 3
            for (int b = a + 2; b < DOF; b += 2) {
                V dx = SUB(p[a], p[b]), dy = SUB(p[a + 1], p[b + 1]);
                V s = FMA(dx, dx, FMA(dy, dy, eps)), ir = inverse_root(s);
                V near = inverse(FMA(s, ir, eps));
                V f = MUL(MUL(ALL(strength), near), MUL(near, ir));
                u = ADD(u, near);
                h[a] = FNMA(f, dx, h[a]);
                h[a + 1] = FNMA(f, dy, h[a + 1]);
                h[b] = FMA(f, dx, h[b]);
                h[b + 1] = FMA(f, dy, h[b + 1]);
            }
        U = _mm512_mask_add_pd(U, m, U, u);
#pragma GCC unroll 6
        for (int k = 0; k < DOF; k++)
            _mm512_mask_storeu_pd(g + k * n + i, m, h[k]);
    }
    mend(n, DOF, i2, x, g);
    return 0.5 * i2 * _mm512_reduce_add_pd(T) + strength * _mm512_reduce_add_pd(U);
}

/* ---- double pendulum: cos(a - b) and its sine come from those of a and b ---- */

/* The register a lane further, after the last lane of the one before. */
INLINE V shift(V now, V before)
{
    return _mm512_castsi512_pd(
        _mm512_alignr_epi64(_mm512_castpd_si512(now), _mm512_castpd_si512(before), LANES - 1));
}

/* Slices and the ones after; behind the last goes on as it came. */
INLINE void load_steps(int n, const double *x, int i, V *at, V *after)
{
    __mmask8 m = lanes(n - i);
    bool inside = i + LANES < n;
    V end = ALL(2 * x[n - 1] - x[n - 2]);
    *at = _mm512_maskz_loadu_pd(m, x + i);
    *after = _mm512_mask_loadu_pd(end, inside ? 0xff : (__mmask8)(m >> 1), x + i + 1);
}

INLINE double dblpend_of(int n, const double *x, double *g)
{
    const double weight = 1.0 / n;
    const V inv = ALL(1 / 0.06), w = ALL(weight), w_dt = ALL(weight / 0.06);
    const double *y = x + n;
    double *h = g + n, last_a[LANES], last_b[LANES];
    V sum = ALL(0), pa = ALL(0), pb = ALL(0);
    for (int i = 0; i < n; i += LANES) {
        __mmask8 m = lanes(n - i);
        V a, b, next_a, next_b, sa, ca, sb, cb;
        load_steps(n, x, i, &a, &next_a);
        load_steps(n, y, i, &b, &next_b);
        V u = MUL(SUB(next_a, a), inv), v = MUL(SUB(next_b, b), inv), uv = MUL(u, v);
        sine_cosine(a, &sa, &ca);
        sine_cosine(b, &sb, &cb);
        V c = FMA(ca, cb, MUL(sa, sb)), t = MUL(uv, FMS(sa, cb, MUL(ca, sb)));
        V kinetic = FMA(uv, c, FMA(u, u, MUL(MUL(ALL(0.5), v), v)));
        sum = _mm512_mask_add_pd(sum, m, sum, FMA(ALL(2), ca, ADD(kinetic, cb)));
        V now_a = MUL(w_dt, FMA(v, c, ADD(u, u))), now_b = MUL(w_dt, FMA(u, c, v));
        _mm512_mask_storeu_pd(g + i, m, FNMA(w, FMA(ALL(2), sa, t), SUB(shift(now_a, pa), now_a)));
        _mm512_mask_storeu_pd(h + i, m, FMA(w, SUB(t, sb), SUB(shift(now_b, pb), now_b)));
        pa = now_a;
        pb = now_b;
    }
    _mm512_storeu_pd(last_a, pa); /* the last step counts twice */
    _mm512_storeu_pd(last_b, pb);
    double a = last_a[(n - 1) % LANES], b = last_b[(n - 1) % LANES];
    g[n - 1] += 2 * a;
    g[n - 2] -= a;
    h[n - 1] += 2 * b;
    h[n - 2] -= b;
    return weight * _mm512_reduce_add_pd(sum);
}

/* ---- Lennard-Jones gas: one body at a time against the others ---- */

INLINE double gas_of(int n, const double *x, double *g)
{
    enum { DOF = 100 };
    const double weight = 1.0 / (DOF / 2 * n), i2 = weight / (0.2 * 0.2), strength = 1e-4 * weight;
    V T = ALL(0);
    double U = 0;
    for (int i = 0; i < n; i += LANES) {
        __mmask8 m = lanes(n - i);
        V q[DOF], f[DOF], sum = ALL(0);
        for (int k = 0; k < DOF; k++)
            f[k] = MUL(ALL(i2), inertia(n, x + k * n, i, &q[k], &T));
        for (int a = 0; a < DOF; a += 2) {
            V at = q[a], at_y = q[a + 1], fx = f[a], fy = f[a + 1];
            for (int b = a + 2; b < DOF; b += 2) {
                V dx = SUB(at, q[b]), dy = SUB(at_y, q[b + 1]);
                V r = inverse(FMA(dx, dx, FMA(dy, dy, ALL(1e-6)))), u = MUL(r, ALL(0.04 * 0.04));
                V u3 = MUL(u, MUL(u, u)), v = FMS(u3, u3, u3);
                V force = MUL(MUL(ALL(6 * strength), r), FMA(u3, u3, v));
                sum = ADD(sum, v);
                fx = FMA(force, dx, fx);
                fy = FMA(force, dy, fy);
                f[b] = FNMA(force, dx, f[b]);
                f[b + 1] = FNMA(force, dy, f[b + 1]);
            }
            f[a] = fx;
            f[a + 1] = fy;
        }
        for (int k = 0; k < DOF; k++)
            _mm512_mask_storeu_pd(g + k * n + i, m, f[k]);
        U += strength * _mm512_mask_reduce_add_pd(m, sum);
    }
    mend(n, DOF, i2, x, g);
    return 0.5 * i2 * _mm512_reduce_add_pd(T) - U;
}

/* Each for HAND_SLICES, and for any number. */
#define FOR(scene)                                                                                 \
    AVX512 static double scene(const double *x, double *g)                                         \
    {                                                                                              \
        return scene##_of(HAND_SLICES, x, g);                                                      \
    }                                                                                              \
    AVX512 static double scene##_long(int n, const double *x, double *g)                           \
    {                                                                                              \
        return scene##_of(n, x, g);                                                                \
    }
FOR(threebody)
FOR(dblpend)
FOR(gas)

static bool is_here(void)
{
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
}

hand_gradient *hand_limit(int scene)
{
    static hand_gradient *const limits[HAND_N] = {
        [HAND_THREEBODY] = threebody, [HAND_DBLPEND] = dblpend, [HAND_GAS] = gas};
    return is_here() && limits[scene] ? limits[scene] : hand_build(0)[scene].gradient;
}

hand_long_gradient *hand_long_limit(int scene)
{
    static hand_long_gradient *const limits[HAND_N] = {
        [HAND_THREEBODY] = threebody_long, [HAND_DBLPEND] = dblpend_long, [HAND_GAS] = gas_long};
    return is_here() ? limits[scene] : NULL;
}

#else

hand_gradient *hand_limit(int scene) { return hand_build(0)[scene].gradient; }

hand_long_gradient *hand_long_limit(int scene)
{
    (void)scene;
    return NULL;
}

#endif
