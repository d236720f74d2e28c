/* Elementwise operations on series. Products, quotients and powers have recurrences of their own
   (Griewank and Walther, Evaluating Derivatives, 2nd edition, section 13.2); what is piecewise
   takes the branch at the point; of all others k y_k = sum_j j x_j d_(k-j), where d is the series
   of the local derivative in ops.def. Its expressions are recorded operations elsewhere; here they
   are read as series. */
#include "internal.h"

#include <math.h>

typedef double R;
#define F(name) name

/* ---- derivative expressions of the table, as series of the builder `to` ---- */

static jet of_number(struct jet_builder *to, double number) { return ad_jet_number(to, number); }
static jet of_jet(struct jet_builder *to, jet x)
{
    (void)to;
    return x;
}
#define J(e) _Generic((e), double : of_number, jet : of_jet)(to, e)

static jet unary(struct jet_builder *to, enum ad_op op, jet x)
{
    return ad_jet_elementwise(to, op, (jet[3]){x, x, x});
}
static jet binary(struct jet_builder *to, enum ad_op op, jet x, jet y)
{
    return ad_jet_elementwise(to, op, (jet[3]){x, y, y});
}

#define TERM1(op, x) unary(to, AD_OP_##op, J(x))
#define TERM2(op, x, y) binary(to, AD_OP_##op, J(x), J(y))
#include "autodiff/terms.h"
/* of powers, whose recurrences need no derivative */
#define ad_pow(x, c) (x)
#define pow_base(x, y) (x)
#define pow_exponent(x, y) (x)

double ad_jet_value(enum ad_op op, double a, double b, double c)
{
    const bool turns = op == AD_OP_sin || op == AD_OP_cos;
    return turns ? ad_jet_circle(a, op == AD_OP_cos) : value_of(op, a, b, c);
}

/* What a unary operation y of x, or a binary one of a and b, changes by. */
static void derivatives(struct jet_builder *to, enum ad_op op, jet a, jet b, jet y, jet d[2])
{
    const jet x = a;
    (void)x, (void)b, (void)y;
    switch (op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        d[0] = J(dx);                                                                              \
        break;
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name:                                                                             \
        d[0] = J(da);                                                                              \
        d[1] = J(db);                                                                              \
        break;
#include "autodiff/ops.def"
    default:
        break;
    }
}

/* ---- rules ---- */

/* An operand of the kind, or for what has no recurrence of its own, the integral. */
static jet node_of(struct jet_builder *to, enum jet_kind kind, enum ad_op op, const jet x[3])
{
    const bool two = ad_ops[op].arity > 1, integral = kind == JET_INTEGRAL;
    const jet none = {JET_NONE};
    jet d[2] = {none, none}, e[2] = {none, none};
    bool is_new;
    if (integral)
        e[0] = ad_jet_slope(to, x[0]);
    if (integral && two)
        e[1] = ad_jet_slope(to, x[1]);
    jet y = ad_jet_make(to,
                        (struct jet){.kind = (uint16_t)kind,
                                     .op = (uint16_t)op,
                                     .a = x[0].id,
                                     .b = two ? x[1].id : JET_NONE,
                                     .da = JET_NONE,
                                     .db = JET_NONE,
                                     .ea = e[0].id,
                                     .eb = e[1].id},
                        &is_new);
    if (!is_new || !integral)
        return y;
    /* the derivative may contain y and what is under way: sine and cosine */
    derivatives(to, op, x[0], x[1], y, d);
    to->series->jets[y.id].da = d[0].id;
    to->series->jets[y.id].db = d[1].id;
    return y;
}

static jet numbers(struct jet_builder *to, enum ad_op op, const double c[3])
{
    return ad_jet_number(to, ad_jet_value(op, c[0], c[1], c[2]));
}

/* A condition, which holds where x is NaN, too. */
static jet or_nan(struct jet_builder *to, jet condition, jet x)
{
    return ad_jet_add(to, condition, ad_ne(x, x));
}

/* Kinds of their own, for those without one here; the rest are integrals. */
static const uint8_t kinds[AD_N_OPS] = {
    [AD_OP_mul0] = JET_PRODUCT0,  [AD_OP_recip0] = JET_RECIP0, [AD_OP_sign] = JET_PIECEWISE,
    [AD_OP_step] = JET_PIECEWISE, [AD_OP_lt] = JET_PIECEWISE,  [AD_OP_le] = JET_PIECEWISE,
    [AD_OP_eq] = JET_PIECEWISE,   [AD_OP_ne] = JET_PIECEWISE,
};

jet ad_jet_elementwise(struct jet_builder *to, enum ad_op op, const jet in[3])
{
    const jet x = in[0], y = in[1];
    double c[3] = {0};
    bool all = true;
    for (size_t k = 0; k < ad_ops[op].arity; k++)
        all = ad_jet_is_number(to, in[k], &c[k]) && all;
    if (all)
        return numbers(to, op, c);
    switch (op) {
    case AD_OP_copy:
    case AD_OP_detach:
        return x;
    case AD_OP_neg:
        return ad_jet_scale(to, -1, x);
    case AD_OP_add:
        return ad_jet_add(to, x, y);
    case AD_OP_sub:
        return ad_jet_sub(to, x, y);
    case AD_OP_mul:
        return ad_jet_mul(to, x, y);
    case AD_OP_div:
        return ad_jet_div(to, x, y);
    case AD_OP_recip:
        return ad_jet_recip(to, x);
    case AD_OP_square:
        return ad_jet_square(to, x);
    case AD_OP_cube:
        return ad_jet_power(to, x, 3);
    case AD_OP_sqrt:
        return ad_jet_power(to, x, 0.5);
    case AD_OP_tanh_slope:
        return ad_jet_sub(to, ad_jet_number(to, 1), ad_jet_square(to, x));
    case AD_OP_mul_tanh_slope:
        return ad_jet_mul(to, x, unary(to, AD_OP_tanh_slope, y));
    case AD_OP_mul0:
        if (ad_jet_is_number(to, x, c) || ad_jet_is_number(to, y, c))
            return ad_jet_mul(to, x, y);
        break;
    case AD_OP_pow:
    case AD_OP_powi:
        if (ad_jet_is_number(to, y, c))
            return ad_jet_power(to, x, c[0]);
        return ad_exp(ad_jet_mul(to, y, unary(to, AD_OP_log, x)));
    case AD_OP_abs:
        return ad_jet_select(to, ad_step(x), x, ad_jet_scale(to, -1, x));
    case AD_OP_relu:
        return ad_jet_select(to, or_nan(to, ad_step(x), x), x, ad_jet_number(to, 0));
    case AD_OP_min:
        return ad_jet_select(to, or_nan(to, ad_le(x, y), x), x, y);
    case AD_OP_max:
        return ad_jet_select(to, or_nan(to, ad_le(y, x), x), x, y);
    case AD_OP_select:
        return ad_jet_select(to, x, y, in[2]);
    default:
        break;
    }
    return node_of(to, kinds[op] ? kinds[op] : JET_INTEGRAL, op, in);
}
