/* The expressions of ops.def as numbers of type R, for sweeps.c: what they record elsewhere is
   computed here. */

/* a^b for whole |b| <= 32, the products of kernels.c. */
static R power(R a, R b)
{
    int n = (int)F(fabs)(b);
    R result = 1, square = a;
    for (; n; n >>= 1, square *= square)
        if (n & 1)
            result *= square;
    return b < 0 ? 1 / result : result;
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
#define ad_add(a, b) ((R)(a) + (R)(b))
#define ad_sub(a, b) ((R)(a) - (R)(b))
#define ad_mul(a, b) ((R)(a) * (R)(b))
#define ad_pow(a, b) power(a, (R)(b))
#define ad_hypot(a, b) F(hypot)(a, b)
#define ad_lt(a, b) ((R)((a) < (b)))
#define ad_le(a, b) ((R)((a) <= (b)))
#define ad_eq(a, b) ((R)((a) == (R)(b)))
#define ad_ne(a, b) ((R)((a) != (R)(b)))
#define ad_neg(x) (-(x))
#define ad_square(x) square(x)
#define ad_recip(x) (1 / (x))
#define ad_recip0(x) recip0(x)
#define ad_sign(x) sign(x)
#define ad_step(x) ((R)((x) > 0))
#define ad_sqrt(x) F(sqrt)(x)
#define ad_exp(x) F(exp)(x)
#define ad_sin(x) F(sin)(x)
#define ad_cos(x) F(cos)(x)
#define ad_sinh(x) F(sinh)(x)
#define ad_cosh(x) F(cosh)(x)
#define ad_sigmoid(x) (1 / (1 + F(exp)(-(x))))
#define ad_tanh_slope(x) (1 - square(x))
#define ad_value(x) (x)

static inline R square(R x) { return x * x; }
static inline R recip0(R x) { return x == 0 ? 0 : 1 / x; }
static inline R sign(R x) { return (R)(x > 0) - (R)(x < 0); }
/* b a^(b-1), 0 at base 0 where that is infinite; y log a, 0 at base 0. */
static inline R pow_base(R a, R b) { return a == 0 && b < 1 ? 0 : b * F(pow)(a, b - 1); }
static inline R pow_exponent(R a, R y) { return a == 0 ? 0 : y * F(log)(a); }

/* Into the sweeps: a call costs as much as the operation. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))

/* Elementwise operations come last in the table. */
static inline bool is_elementwise(const struct node *n) { return n->op >= AD_OP_copy; }
static inline bool is_scalar(const struct node *n)
{
    return is_elementwise(n) && n->rows == 1 && n->cols == 1;
}

ALWAYS_INLINE R scalar_value(const struct node *n, R a, R b, R c)
{
    const R x = a;
    (void)x, (void)b, (void)c;
    switch (n->op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        return (R)(value);
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name:                                                                             \
        return (R)(value);
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    case AD_OP_##name:                                                                             \
        return (R)(value);
#include "autodiff/ops.def"
    default:
        return 0;
    }
}

/* A derivative of 0 is no dependence, whatever g is. */
#define IS_NONE(d) (__builtin_constant_p(d) && (d) == 0)

/* Adds g times the local derivatives to the adjoints of the operands. */
ALWAYS_INLINE void scalar_adjoint(const struct node *n, R y, R g, R a, R b, R *ga, R *gb, R *gc)
{
    const R x = a;
    (void)x, (void)y, (void)b, (void)gb, (void)gc;
    switch (n->op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        if (!IS_NONE(dx))                                                                          \
            *ga += g * (R)(dx);                                                                    \
        break;
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name: {                                                                           \
        const R to_a = (R)(da), to_b = (R)(db);                                                    \
        *ga += g * to_a;                                                                           \
        *gb += g * to_b;                                                                           \
    } break;
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    case AD_OP_##name: {                                                                           \
        const R to_b = (R)(db), to_c = (R)(dc);                                                    \
        *gb += g * to_b;                                                                           \
        *gc += g * to_c;                                                                           \
    } break;
#include "autodiff/ops.def"
    default:
        break;
    }
}
