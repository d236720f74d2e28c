/* Reciprocals, square roots, sine and cosine for f64 and AVX-512, as machine code computes them
   (native/vectors.c): vsqrtpd and vdivpd take 16 to 32 cycles a vector, and libmvec reduces an
   argument for its sine and again for its cosine. Lanes do not depend on each other: a lane that
   the fast way does not serve takes the slow one alone. */
#include <immintrin.h>

enum { LANES512 = 8 };
#define ALL512(x) _mm512_set1_pd(x)

/* Reciprocals are NaN where the fast way does not serve. */
static inline __mmask8 nan512(__m512d y) { return _mm512_cmp_pd_mask(y, y, _CMP_UNORD_Q); }

static inline __m512d quotient512(__m512d x)
{
    const __m512d y = _mm512_rcp14_pd(x), e = _mm512_fnmadd_pd(x, y, ALL512(1));
    return _mm512_fmadd_pd(y, _mm512_fmadd_pd(_mm512_fmadd_pd(e, e, e), e, e), y);
}

static inline __m512d recip512(__m512d x)
{
    const __m512d y = quotient512(x);
    const __mmask8 slow = nan512(y);
    return slow ? _mm512_mask_div_pd(y, slow, ALL512(1), x) : y;
}

static inline __m512d recip0512(__m512d x)
{
    const __m512d y = quotient512(x);
    const __mmask8 slow = nan512(y);
    if (!slow)
        return y;
    const __mmask8 some = _mm512_cmp_pd_mask(x, _mm512_setzero_pd(), _CMP_NEQ_UQ);
    return _mm512_maskz_mov_pd(some, _mm512_mask_div_pd(y, slow, ALL512(1), x));
}

/* A root is corrected by its exact remainder; numbers from 2^-900 to 2^1000. */
static inline __m512d sqrt512(__m512d x)
{
    const __m512d y = _mm512_rsqrt14_pd(x);
    const __m512d e = _mm512_fnmadd_pd(_mm512_mul_pd(x, y), y, ALL512(1));
    const __m512d series = _mm512_fmadd_pd(ALL512(0.375), e, ALL512(0.5));
    const __m512d near = _mm512_fmadd_pd(_mm512_mul_pd(y, e), series, y);
    const __m512d root = _mm512_mul_pd(x, near), rest = _mm512_fnmadd_pd(root, root, x);
    const __m512d right = _mm512_fmadd_pd(rest, _mm512_mul_pd(ALL512(0.5), near), root);
    const __m512i least = _mm512_castpd_si512(ALL512(0x1p-900));
    const __m512i span = _mm512_sub_epi64(_mm512_castpd_si512(ALL512(0x1p1000)), least);
    const __m512i over = _mm512_sub_epi64(_mm512_castpd_si512(x), least);
    const __mmask8 slow = _mm512_cmpgt_epu64_mask(over, span);
    return slow ? _mm512_mask_sqrt_pd(right, slow, x) : right;
}

struct circle512 {
    __m512d sin, cos;
};

static inline __m512d polynomial512(__m512d z, const double c[6])
{
    __m512d p = ALL512(c[5]);
    for (int k = 5; k-- > 0;)
        p = _mm512_fmadd_pd(p, z, ALL512(c[k]));
    return p;
}

static __attribute__((noinline)) void far512(__m512d x, __mmask8 which, struct circle512 *y)
{
    double arguments[LANES512], sines[LANES512], cosines[LANES512];
    _mm512_storeu_pd(arguments, x);
    _mm512_storeu_pd(sines, y->sin);
    _mm512_storeu_pd(cosines, y->cos);
    for (int k = 0; k < LANES512; k++)
        if (which >> k & 1) {
            sines[k] = sin(arguments[k]);
            cosines[k] = cos(arguments[k]);
        }
    y->sin = _mm512_loadu_pd(sines);
    y->cos = _mm512_loadu_pd(cosines);
}

/* Reduction, polynomials and signs are explained in native/vectors.c. */
static inline struct circle512 circle512(__m512d x)
{
    static const double S[] = {-1.66666666666666324348e-01, 8.33333333332248946124e-03,
                               -1.98412698298579493134e-04, 2.75573137070700676789e-06,
                               -2.50507602534068634195e-08, 1.58969099521155010221e-10};
    static const double C[] = {4.16666666666666019037e-02, -1.38888888888741095749e-03,
                               2.48015872894767294178e-05, -2.75573143513506633035e-07,
                               2.08757232129817482790e-09, -1.13596475577881948265e-11};
    const __m512d up = ALL512(0x1.8p52), half = ALL512(0x1.1a626331p-54);
    const __m512d t = _mm512_fmadd_pd(x, ALL512(0x1.45f306dc9c883p-1), up);
    const __m512d k = _mm512_sub_pd(t, up);
    const __m512d near = _mm512_fnmadd_pd(k, ALL512(0x1.921fb54442d18p0), x);
    const __m512d r = _mm512_fnmadd_pd(k, half, near), z = _mm512_mul_pd(r, r);
    const __m512d low = _mm512_fmadd_pd(k, half, _mm512_sub_pd(r, near));
    const __m512d off = _mm512_fmadd_pd(k, ALL512(0x1.1701b839a252p-88), low);
    const __m512d zr = _mm512_mul_pd(z, r);
    const __m512d s = _mm512_sub_pd(r, _mm512_fnmadd_pd(zr, polynomial512(z, S), off));
    const __m512d rest = _mm512_fmadd_pd(zr, polynomial512(z, C), off);
    const __m512d c = _mm512_fnmadd_pd(r, _mm512_fmsub_pd(ALL512(0.5), r, rest), ALL512(1));
    const __m512i n = _mm512_castpd_si512(t), minus = _mm512_castpd_si512(ALL512(-0.0));
    const __m512i turned = _mm512_slli_epi64(n, 62);
    const __mmask8 odd = _mm512_test_epi64_mask(n, _mm512_set1_epi64(1));
    const __m512i sine = _mm512_castpd_si512(_mm512_mask_mov_pd(s, odd, c));
    const __m512i cosine =
        _mm512_castpd_si512(_mm512_mask_xor_pd(c, odd, s, _mm512_castsi512_pd(minus)));
    enum { A_XOR_B_AND_C = 0x78 };
    struct circle512 y = {
        _mm512_castsi512_pd(_mm512_ternarylogic_epi64(sine, turned, minus, A_XOR_B_AND_C)),
        _mm512_castsi512_pd(_mm512_ternarylogic_epi64(cosine, turned, minus, A_XOR_B_AND_C))};
    const __mmask8 far = _mm512_cmp_pd_mask(_mm512_abs_pd(x), ALL512(1e5), _CMP_NLT_UQ);
    if (far)
        far512(x, far, &y);
    return y;
}
static inline __m512d sin512(__m512d x) { return circle512(x).sin; }
static inline __m512d cos512(__m512d x) { return circle512(x).cos; }

/* The rest of a row. Fewer than `least` lanes are sooner done by plain loops. */
static inline __mmask8 rest512(size_t n) { return (__mmask8)((1u << n % LANES512) - 1); }

#define KERNEL512(name, least)                                                                     \
    static void name##_512(size_t n, void *o, const void *pa, const void *pb, const void *pc)      \
    {                                                                                              \
        const double *a = pa;                                                                      \
        double *y = o;                                                                             \
        size_t i = 0;                                                                              \
        if (n < least) {                                                                           \
            name##_0(n, o, pa, pb, pc);                                                            \
            return;                                                                                \
        }                                                                                          \
        for (; i + LANES512 <= n; i += LANES512)                                                   \
            _mm512_storeu_pd(y + i, name##512(_mm512_loadu_pd(a + i)));                            \
        if (i < n)                                                                                 \
            _mm512_mask_storeu_pd(y + i, rest512(n),                                               \
                                  name##512(_mm512_mask_loadu_pd(ALL512(1), rest512(n), a + i)));  \
    }
KERNEL512(recip, LANES512)
KERNEL512(recip0, LANES512)
KERNEL512(sqrt, LANES512)
KERNEL512(sin, 2)
KERNEL512(cos, 2)

static void circle(size_t n, void *sines, void *cosines, const void *pa)
{
    double *s = sines, *c = cosines;
    const double *a = pa;
    size_t i = 0;
    if (n == 1) {
        const double x = *a; /* which a result may overwrite */
        *s = sin(x);
        *c = cos(x);
        return;
    }
    for (; i + LANES512 <= n; i += LANES512) {
        const struct circle512 y = circle512(_mm512_loadu_pd(a + i));
        _mm512_storeu_pd(s + i, y.sin);
        _mm512_storeu_pd(c + i, y.cos);
    }
    if (i < n) {
        const struct circle512 y = circle512(_mm512_mask_loadu_pd(ALL512(1), rest512(n), a + i));
        _mm512_mask_storeu_pd(s + i, rest512(n), y.sin);
        _mm512_mask_storeu_pd(c + i, rest512(n), y.cos);
    }
}

/* In the table of kernels below: */
#define recip_0 recip_512
#define recip0_0 recip0_512
#define sqrt_0 sqrt_512
#define sin_0 sin_512
#define cos_0 cos_512
