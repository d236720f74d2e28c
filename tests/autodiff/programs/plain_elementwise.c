/* Operations element by element, and what rounding makes of them (plain.h). */
#include "plain_parts.h"

#include "tests/autodiff/references.h"

#include <float.h>

static double operate(enum ad_op op, const double x[3])
{
    switch (op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        return name##_reference(x[0], x[1], x[2]);
#define AD_BINARY(name, value, da, db, lo, hi) AD_UNARY(name, value, da, lo, hi)
#define AD_TERNARY(name, value, da, db, dc, lo, hi) AD_UNARY(name, value, da, lo, hi)
#include "autodiff/ops.def"
    default:
        return NAN;
    }
}

/* Of the operation alone, in units: 0 where it only chooses; libmvec has functions to 4 ulp. */
static double roundings(enum ad_op op)
{
    switch (op) {
    case AD_OP_copy:
    case AD_OP_detach:
    case AD_OP_neg:
    case AD_OP_abs:
    case AD_OP_sign:
    case AD_OP_step:
    case AD_OP_relu:
    case AD_OP_min:
    case AD_OP_max:
    case AD_OP_lt:
    case AD_OP_le:
    case AD_OP_eq:
    case AD_OP_ne:
    case AD_OP_select:
        return 0;
    case AD_OP_add:
    case AD_OP_sub:
    case AD_OP_mul:
    case AD_OP_mul0:
    case AD_OP_div:
    case AD_OP_square:
    case AD_OP_sqrt:
    case AD_OP_recip:
    case AD_OP_recip0:
        return 1;
    case AD_OP_powi:
        return 12;
    default:
        return 8;
    }
}

static double own_error(const struct plain *p, enum ad_op op, const double x[3], double y)
{
    double n = roundings(op), least = p->tape->type == AD_F32 ? FLT_MIN : DBL_MIN, size = fabs(y);
    bool product = op == AD_OP_mul || op == AD_OP_mul0;
    bool exact = n == 0 || (y == 0 && (op == AD_OP_add || op == AD_OP_sub || op == AD_OP_recip0 ||
                                       (product && (x[0] == 0 || x[1] == 0)) || x[0] == 0));
    if (op == AD_OP_tanh_slope) /* 1 - x^2 cancels */
        size = 1 + x[0] * x[0];
    if (op == AD_OP_mul_tanh_slope)
        size = fabs(x[0]) * (1 + x[1] * x[1]);
    return exact ? 0 : n * plain_unit(p) * size + (size < least / plain_unit(p) ? least : 0);
}

/* An operand that is anything, where that makes no difference. */
static bool is_left_out(enum ad_op op, const double x[3], const double e[3], int k)
{
    if (op == AD_OP_select && k > 0 && e[0] == 0)
        return (k == 1) != (x[0] != 0);
    return op == AD_OP_mul0 && x[1 - k] == 0 && e[1 - k] == 0;
}

/* What is special lies between the ends: equal operands, a condition of 0, a pole. */
static bool is_inside(enum ad_op op, const double x[3], const double e[3])
{
    switch (op) {
    case AD_OP_eq:
    case AD_OP_ne:
        return e[0] + e[1] > 0 && fabs(x[0] - x[1]) <= e[0] + e[1];
    case AD_OP_select:
    case AD_OP_recip:
    case AD_OP_recip0:
    case AD_OP_powi:
    case AD_OP_pow:
        return e[0] > 0 && fabs(x[0]) <= e[0];
    case AD_OP_div:
        return e[1] > 0 && fabs(x[1]) <= e[1];
    default:
        return false;
    }
}

/* The largest change of the result at the ends of the operands' intervals, of one alone and of all.
   atan2 turns on the sign of a zero, which no bound knows. */
static double sensitivity(enum ad_op op, int arity, const double x[3], const double e[3], double y)
{
    double error = 0;
    if (op == AD_OP_atan2 && fabs(x[0]) <= e[0] && x[1] <= e[1])
        return 7;
    if (is_inside(op, x, e))
        return op == AD_OP_select                 ? fabs(x[1] - x[2]) + e[1] + e[2]
               : op == AD_OP_eq || op == AD_OP_ne ? 1
                                                  : INFINITY;
    for (int corner = 1; corner < (arity == 1 ? 3 : arity == 2 ? 9 : 27); corner++) {
        double at[3] = {x[0], x[1], x[2]};
        bool moved = false;
        for (int k = 0, digits = corner; k < arity; k++, digits /= 3) {
            if (isinf(e[k]) && !is_left_out(op, x, e, k))
                return INFINITY;
            if (isinf(e[k]) || digits % 3 == 0)
                continue;
            at[k] += digits % 3 == 1 ? e[k] : -e[k];
            moved = moved || e[k] != 0;
        }
        double change = moved ? fabs(operate(op, at) - y) : 0;
        error = isnan(change) ? INFINITY : fmax(error, change);
    }
    return error;
}

void plain_elementwise(struct plain *p, uint32_t id, const struct node *n)
{
    enum ad_op op = (enum ad_op)n->op;
    int arity = ad_ops[op].arity;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            double x[3] = {0}, e[3] = {0};
            for (int k = 0; k < arity; k++) {
                size_t at = plain_element(node_at(p->tape, n->in[k]), r, c);
                x[k] = p->value[n->in[k]][at];
                e[k] = p->error[n->in[k]][at];
            }
            double y = operate(op, x), error = own_error(p, op, x, y);
            if (e[0] != 0 || e[1] != 0 || e[2] != 0 || op == AD_OP_atan2)
                error += sensitivity(op, arity, x, e, y);
            p->value[id][r * n->cols + c] = y;
            p->error[id][r * n->cols + c] = error;
        }
}
