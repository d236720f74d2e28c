/* Algebraic identities applied when recording: neutral elements, constant folding, powers as
   products, signs moved into sums, and forms with shorter gradients.

   Each node saved here saves two or more in every gradient. Measured on gradients of actions: signs
   save 15 to 30 %, scaling up to half, cubes and quotients 10 % of a Lennard-Jones gas, slopes of
   tanh 4 % of a training step. */
#include "autodiff/internal.h"

#include <math.h>
#include <stdlib.h>

/* ---- of a value and a constant ---- */

ad_var ad_scale(ad_var x, double c)
{
    double inner;
    const struct node *n = node_at(x.tape, x.id);
    if (n->op == AD_OP_mul && ad_constant_value(ad_at(x.tape, n->in[1]), &inner))
        return ad_scale(ad_at(x.tape, n->in[0]), c * inner);
    if (n->op == AD_OP_neg)
        return ad_scale(ad_at(x.tape, n->in[0]), -c);
    if (c == 1)
        return x;
    if (c == -1)
        return ad_neg(x);
    return ad_elementwise(x.tape, AD_OP_mul, 2, (ad_var[]){x, ad_number(x.tape, c)});
}

static bool is_power_of_two(double c)
{
    int exponent;
    return isfinite(c) && fabs(frexp(c, &exponent)) == 0.5 && abs(exponent) < 100;
}

/* x^c; false where it has to stay pow. */
static bool power(ad_var x, double c, ad_var *y)
{
    if (c == 0)
        *y = ad_broadcast(ad_scalar(x.tape, 1), ad_rows(x), ad_cols(x));
    else if (c == 1)
        *y = x;
    else if (c == 2)
        *y = ad_square(x);
    else if (c == 3)
        *y = ad_cube(x);
    else if (c == -1)
        *y = ad_recip(x);
    else if (c == 0.5)
        *y = ad_sqrt(x);
    else if (c == floor(c) && fabs(c) <= 32)
        *y = ad_elementwise(x.tape, AD_OP_powi, 2, (ad_var[]){x, ad_number(x.tape, c)});
    else
        return false;
    return true;
}

/* op(x, c) for a number c on the right. */
static bool simplify_right(enum ad_op op, ad_var x, double c, ad_var *y)
{
    switch (op) {
    case AD_OP_add:
    case AD_OP_sub:
        *y = x;
        return c == 0;
    case AD_OP_mul:
        *y = ad_scale(x, c);
        return true;
    case AD_OP_div:
        if (!is_power_of_two(c))
            return false;
        *y = ad_scale(x, 1 / c);
        return true;
    case AD_OP_pow:
        return power(x, c, y);
    default:
        return false;
    }
}

/* op(c, x) for a number c on the left. */
static bool simplify_left(enum ad_op op, double c, ad_var x, ad_var *y)
{
    if (op == AD_OP_add || op == AD_OP_mul)
        return simplify_right(op, x, c, y);
    if (op == AD_OP_sub && c == 0) {
        *y = ad_neg(x);
        return true;
    }
    return false;
}

static bool fold(ad_tape *tape, enum ad_op op, double a, double b, ad_var *y)
{
    if (op == AD_OP_add)
        *y = ad_scalar(tape, a + b);
    else if (op == AD_OP_sub)
        *y = ad_scalar(tape, a - b);
    else if (op == AD_OP_mul)
        *y = ad_scalar(tape, a * b);
    else if (op == AD_OP_div)
        *y = ad_scalar(tape, a / b);
    else
        return false;
    return true;
}

static bool as_number(ad_arg a, double *value)
{
    *value = a.value;
    return a.is_number || ad_constant_value(a.var, value);
}

bool ad_simplify_numbers(ad_tape *tape, enum ad_op op, ad_arg a, ad_arg b, ad_var *y)
{
    double ca, cb;
    bool number_a = as_number(a, &ca), number_b = as_number(b, &cb);
    return (number_a && number_b && fold(tape, op, ca, cb, y)) ||
           (number_b && !a.is_number && simplify_right(op, a.var, cb, y)) ||
           (number_a && !b.is_number && simplify_left(op, ca, b.var, y));
}

/* ---- of any two values ---- */

/* Sums of negated terms are differences. */
static bool signs(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    const struct node *na = node_at(a.tape, a.id), *nb = node_at(b.tape, b.id);
    if ((op == AD_OP_add || op == AD_OP_sub) && nb->op == AD_OP_neg) {
        ad_var c = ad_at(b.tape, nb->in[0]);
        *y = op == AD_OP_add ? ad_sub(a, c) : ad_add(a, c);
        return true;
    }
    if (op == AD_OP_add && na->op == AD_OP_neg) {
        *y = ad_sub(b, ad_at(a.tape, na->in[0]));
        return true;
    }
    return false;
}

/* x^2 x becomes cube(x), whose gradient has one path to x instead of two. */
static bool cube(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    const struct node *na = node_at(a.tape, a.id), *nb = node_at(b.tape, b.id);
    bool first = na->op == AD_OP_square && na->in[0] == b.id;
    bool second = nb->op == AD_OP_square && nb->in[0] == a.id;
    if (op != AD_OP_mul || !(first || second))
        return false;
    *y = ad_cube(first ? b : a);
    return true;
}

/* c/x for a constant c of any shape becomes c recip(x): the gradient needs 1/x as well. */
static bool quotient(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    if (op != AD_OP_div || node_at(a.tape, a.id)->op != AD_OP_constant)
        return false;
    *y = ad_mul(a, ad_recip(b));
    return true;
}

/* g (1 - t^2) with t = tanh x becomes one operation, so that the slope is never stored. */
static bool slope(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    const struct node *na = node_at(a.tape, a.id), *nb = node_at(b.tape, b.id);
    if (op != AD_OP_mul || (na->op != AD_OP_tanh_slope && nb->op != AD_OP_tanh_slope))
        return false;
    bool first = nb->op != AD_OP_tanh_slope;
    ad_var t = ad_at(a.tape, first ? na->in[0] : nb->in[0]);
    *y = ad_elementwise(a.tape, AD_OP_mul_tanh_slope, 2, (ad_var[]){first ? b : a, t});
    return true;
}

bool ad_simplify(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    static bool (*const identities[])(enum ad_op, ad_var, ad_var, ad_var *) = {signs, slope, cube,
                                                                               quotient};
    for (size_t k = 0; k < LENGTH(identities); k++)
        if (identities[k](op, a, b, y))
            return true;
    return false;
}
