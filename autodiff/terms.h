/* The expressions of ops.def read otherwise than as recorded operations. The includer has a type R
   of numbers with F(name), its math functions, and says what an operation within a derivative is:
   TERM1(op, x), TERM2(op, a, b), and pow_base, pow_exponent, ad_pow, ad_value of powers. */
#include "internal.h"

/* Into loops: a call costs as much as the operation. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))

/* a^b for whole |b| <= 32, the products of kernels.c. */
static inline R power(R a, R b)
{
    int n = (int)F(fabs)(b);
    R result = 1, square = a;
    for (; n; n >>= 1, square *= square)
        if (n & 1)
            result *= square;
    return b < 0 ? 1 / result : result;
}

/* value_NAME: the values of the table. */
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    ALWAYS_INLINE R value_##name(R x) { return (R)(value); }
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    ALWAYS_INLINE R value_##name(R a, R b) { return (R)(value); }
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    ALWAYS_INLINE R value_##name(R a, R b, R c) { return (R)(value); }
#include "ops.def"

ALWAYS_INLINE R value_of(unsigned op, R a, R b, R c)
{
    switch (op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        return value_##name(a);
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name:                                                                             \
        return value_##name(a, b);
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    case AD_OP_##name:                                                                             \
        return value_##name(a, b, c);
#include "ops.def"
    default:
        return 0;
    }
}

#undef ad_add
#undef ad_sub
#undef ad_mul
#undef ad_pow
#undef ad_hypot
#undef ad_lt
#undef ad_le
#undef ad_eq
#undef ad_ne
#define ad_add(a, b) TERM2(add, a, b)
#define ad_sub(a, b) TERM2(sub, a, b)
#define ad_mul(a, b) TERM2(mul, a, b)
#define ad_hypot(a, b) TERM2(hypot, a, b)
#define ad_lt(a, b) TERM2(lt, a, b)
#define ad_le(a, b) TERM2(le, a, b)
#define ad_eq(a, b) TERM2(eq, a, b)
#define ad_ne(a, b) TERM2(ne, a, b)
#define ad_neg(x) TERM1(neg, x)
#define ad_square(x) TERM1(square, x)
#define ad_recip(x) TERM1(recip, x)
#define ad_recip0(x) TERM1(recip0, x)
#define ad_sign(x) TERM1(sign, x)
#define ad_step(x) TERM1(step, x)
#define ad_sqrt(x) TERM1(sqrt, x)
#define ad_exp(x) TERM1(exp, x)
#define ad_sin(x) TERM1(sin, x)
#define ad_cos(x) TERM1(cos, x)
#define ad_sinh(x) TERM1(sinh, x)
#define ad_cosh(x) TERM1(cosh, x)
#define ad_sigmoid(x) TERM1(sigmoid, x)
#define ad_tanh_slope(x) TERM1(tanh_slope, x)
