/* Values and derivatives of scalar operations as numbers of type R, for sweeps.c. */
#define TERM1(op, x) value_##op(x)
#define TERM2(op, a, b) value_##op((R)(a), (R)(b))
#include "autodiff/terms.h"

#define ad_pow(a, b) power(a, (R)(b))
#define ad_value(x) (x)
/* b a^(b-1), 0 at base 0 where that is infinite; y log a, 0 at base 0. */
static inline R pow_base(R a, R b) { return a == 0 && b < 1 ? 0 : b * F(pow)(a, b - 1); }
static inline R pow_exponent(R a, R y) { return a == 0 ? 0 : y * F(log)(a); }

/* Elementwise operations come last in the table. */
static inline bool is_elementwise(const struct node *n) { return n->op >= AD_OP_copy; }
static inline bool is_scalar(const struct node *n)
{
    return is_elementwise(n) && n->rows == 1 && n->cols == 1;
}

/* A derivative of 0 is no dependence, whatever g is. */
#define IS_NONE(d) (__builtin_constant_p(d) && (d) == 0)

/* Adds g times the local derivatives to the adjoints of the operands. */
ALWAYS_INLINE void scalar_adjoint(unsigned op, R y, R g, R a, R b, R *ga, R *gb, R *gc)
{
    const R x = a;
    (void)x, (void)y, (void)b, (void)gb, (void)gc;
    switch (op) {
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
