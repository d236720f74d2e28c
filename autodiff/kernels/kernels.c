/* The loops over lanes. The build compiles this file once per element type and instruction set:
   AD_KERNEL_F32 or AD_KERNEL_F64, and AD_KERNEL_ISA (base, avx2, avx512).

   glibc declares its vector functions only under -ffast-math, so they are declared here again as
   having vector variants (sin and the like take 1 to 2 ns per value that way, with errors of up to
   4 ulp). Each function has a loop of its own: gcc would fuse sin and cos of one argument and lose
   both vector versions. */
#include "kernels.h"
#include "autodiff/blas.h"

#include <float.h>
#include <math.h>
#include <string.h>

#ifdef AD_KERNEL_F32
typedef float R;
#define F(name) name##f
#define TYPE AD_F32
#define TYPE_NAME f32
#else
typedef double R;
#define F(name) name
#define TYPE AD_F64
#define TYPE_NAME f64
#endif

#define PASTE(a, b, c, d) a##b##c##d
#define EXPAND(a, b, c, d) PASTE(a, b, c, d)
#define TEXT(a) #a
#define EXPAND_TEXT(a) TEXT(a)

#if defined(__GLIBC__) && defined(__x86_64__) && !defined(__clang__)
#define PARAMETERS_1 (R)
#define PARAMETERS_2 (R, R)
#define VECTOR_22(name, arity) _Pragma("omp declare simd notinbranch") R F(name) PARAMETERS_##arity;
#if __GLIBC_PREREQ(2, 35)
#define VECTOR_35 VECTOR_22
#else
#define VECTOR_35(name, arity)
#endif
#define VECTOR_NEVER(name, arity)
#define AD_VECTOR(name, arity, since) VECTOR_##since(name, arity)
#include "autodiff/ops.def"
#endif

/* a^b for whole |b| <= 32, by squaring; all six bits, so that lanes stay together. */
static inline R power(R a, R b)
{
    int n = (int)F(fabs)(b);
    R result = 1, square = a;
#pragma GCC unroll 6
    for (int bit = 0; bit < 6; bit++) {
        result = n >> bit & 1 ? result * square : result;
        square *= square;
    }
    return b < 0 ? 1 / result : result;
}

#define LANES _Pragma("omp simd") for (size_t i = 0; i < n; i++)

/* An operand has a value for EACH lane, or ONE for all. */
#define BEFORE_EACH(x, p) const R *each_##x = p;
#define BEFORE_ONE(x, p) const R x = *(const R *)(p);
#define LANE_EACH(x) const R x = each_##x[i];
#define LANE_ONE(x)

#define KERNEL(name, value, before, lane)                                                          \
    static void name(size_t n, void *o, const void *pa, const void *pb, const void *pc)            \
    {                                                                                              \
        (void)pb, (void)pc;                                                                        \
        R *y = o;                                                                                  \
        before LANES { lane y[i] = value; }                                                        \
    }
#define UNARY(name, value, A) KERNEL(name, value, BEFORE_##A(x, pa), LANE_##A(x))
#define BINARY(name, value, A, B)                                                                  \
    KERNEL(name, value, BEFORE_##A(a, pa) BEFORE_##B(b, pb), LANE_##A(a) LANE_##B(b))
#define TERNARY(name, value, A, B, C)                                                              \
    KERNEL(name, value, BEFORE_##A(a, pa) BEFORE_##B(b, pb) BEFORE_##C(c, pc),                     \
           LANE_##A(a) LANE_##B(b) LANE_##C(c))

#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    UNARY(name##_0, value, EACH)                                                                   \
    UNARY(name##_1, value, ONE)
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    BINARY(name##_0, value, EACH, EACH)                                                            \
    BINARY(name##_1, value, ONE, EACH)                                                             \
    BINARY(name##_2, value, EACH, ONE)                                                             \
    BINARY(name##_3, value, ONE, ONE)
#define ALL_TERNARY(name, value)                                                                   \
    TERNARY(name##_0, value, EACH, EACH, EACH)                                                     \
    TERNARY(name##_1, value, ONE, EACH, EACH)                                                      \
    TERNARY(name##_2, value, EACH, ONE, EACH)                                                      \
    TERNARY(name##_3, value, ONE, ONE, EACH)                                                       \
    TERNARY(name##_4, value, EACH, EACH, ONE)                                                      \
    TERNARY(name##_5, value, ONE, EACH, ONE)                                                       \
    TERNARY(name##_6, value, EACH, ONE, ONE)                                                       \
    TERNARY(name##_7, value, ONE, ONE, ONE)
#define AD_TERNARY(name, value, da, db, dc, lo, hi) ALL_TERNARY(name, value)
#include "autodiff/ops.def"

/* Rounded twice, as one operation after the other: clang would contract them. */
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif
ALL_TERNARY(product_plus, a *b + c)
ALL_TERNARY(product_minus, a *b - c)
ALL_TERNARY(minus_product, c - a * b)
#ifdef __clang__
#pragma STDC FP_CONTRACT DEFAULT
#endif

static double sum(size_t n, const void *pa)
{
    const R *a = pa;
    R s = 0;
#pragma omp simd reduction(+ : s)
    for (size_t i = 0; i < n; i++)
        s += a[i];
    return (double)s;
}

static void diff(size_t n, void *o, const void *pa, double scale)
{
    const R *a = pa, s = (R)scale;
    R *y = o;
    LANES y[i] = s * (a[i + 1] - a[i]);
}

static void collect(size_t count, void *o, size_t n, const double *partial)
{
    R *y = o;
    for (size_t k = 0; k < count; k++) {
        double s = 0;
        for (size_t i = 0; i < n; i++)
            s += partial[i * count + k];
        y[k] = (R)s;
    }
}

static bool nonfinite(size_t n, const void *pa, size_t *lane)
{
    const R *a = pa;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(a[i])) {
            *lane = i;
            return true;
        }
    return false;
}

static void transpose(size_t rows, size_t cols, void *o, size_t ldo, const void *pa, size_t lda)
{
    enum { TILE = 16 };
    const R *a = pa;
    R *y = o;
    for (size_t r = 0; r < rows; r += TILE)
        for (size_t c = 0; c < cols; c += TILE)
            for (size_t i = r; i < rows && i < r + TILE; i++)
                for (size_t j = c; j < cols && j < c + TILE; j++)
                    y[j * ldo + i] = a[i * lda + j];
}

static void gather(size_t n, void *o, const void *pa, const uint32_t *list)
{
    const R *a = pa;
    R *y = o;
    LANES y[i] = a[list[i]];
}

static void scatter(size_t n, void *o, const void *pa, const uint32_t *list)
{
    const R *a = pa;
    R *y = o;
    for (size_t i = 0; i < n; i++)
        y[list[i]] += a[i];
}

static void cumsum(size_t n, void *o, const void *pa, bool reversed)
{
    const R *a = pa;
    R *y = o;
    double s = 0;
    for (size_t k = 0; k < n; k++) {
        size_t i = reversed ? n - 1 - k : k;
        s += (double)a[i];
        y[i] = (R)s;
    }
}

static void from_double(size_t n, void *o, const double *a)
{
    R *y = o;
    LANES y[i] = (R)a[i];
}

static void to_double(size_t n, double *o, const void *pa)
{
    const R *a = pa;
    LANES o[i] = (double)a[i];
}

#include "optim_step.h"
#include "small_systems.h"

#include "large_systems.h"

/* Without OpenMP these files are the oracle of those with it: plain loops. */
#if defined(__AVX512DQ__) && defined(AD_KERNEL_F64) && defined(_OPENMP)
#include "functions512.h"
#define SIN_AND_COS circle
#else
#define SIN_AND_COS NULL
#endif

extern const struct ad_kernels EXPAND(ad_kernels_, TYPE_NAME, _, AD_KERNEL_ISA);
const struct ad_kernels EXPAND(ad_kernels_, TYPE_NAME, _, AD_KERNEL_ISA) = {
    .isa = EXPAND_TEXT(AD_KERNEL_ISA),
    .op =
        {
#define AD_UNARY(name, value, dx, lo, hi) [AD_OP_##name] = {name##_0, name##_1},
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    [AD_OP_##name] = {name##_0, name##_1, name##_2, name##_3},
#define OF_TERNARY(name)                                                                           \
    {                                                                                              \
        name##_0, name##_1, name##_2, name##_3, name##_4, name##_5, name##_6, name##_7             \
    }
#define AD_TERNARY(name, value, da, db, dc, lo, hi) [AD_OP_##name] = OF_TERNARY(name),
#include "autodiff/ops.def"
        },
    .product_sum = {[PRODUCT_PLUS] = OF_TERNARY(product_plus),
                    [PLUS_PRODUCT] = OF_TERNARY(product_plus),
                    [PRODUCT_MINUS] = OF_TERNARY(product_minus),
                    [MINUS_PRODUCT] = OF_TERNARY(minus_product)},
    .sin_and_cos = SIN_AND_COS,
    .sum = sum,
    .diff = diff,
    .collect = collect,
    .nonfinite = nonfinite,
    .transpose = transpose,
    .gather = gather,
    .scatter = scatter,
    .cumsum = cumsum,
    .factor = factor,
    .solve = solve,
    .logdet = logdet,
    .from_double = from_double,
    .to_double = to_double,
    .sgd = sgd,
    .adam = adam,
};
