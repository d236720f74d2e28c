/* Recording of elementwise operations: broadcasting, and the few identities worth knowing early
   (numbers that are neutral, powers that are products). */
#include "../internal.h"

#include <math.h>
#include <stdlib.h>

/* Dimensions a and b broadcast to one; 0 if they do not fit. */
static uint32_t broadcast_dim(uint32_t a, uint32_t b)
{
    return a == b || b == 1 ? a : a == 1 ? b : 0;
}

static ad_var refuse(ad_tape *tape, enum ad_op op, ad_var a, ad_var b)
{
    return ad_refuse(tape, AD_E_SHAPE, "%s: shapes %zu x %zu and %zu x %zu do not broadcast",
                     ad_op_name(op), ad_rows(a), ad_cols(a), ad_rows(b), ad_cols(b));
}

/* The tape of an operation's arguments; an error is kept in the first tape found. */
static ad_tape *common_tape(enum ad_op op, size_t n, const ad_arg *args)
{
    ad_tape *tape = NULL;
    for (size_t i = 0; i < n; i++) {
        if (!args[i].var.tape)
            continue;
        if (tape && tape != args[i].var.tape)
            ad_fail(&tape->error, AD_E_TAPE, "%s: variables of different tapes", ad_op_name(op));
        else
            tape = args[i].var.tape;
    }
    return tape;
}

static ad_var as_var(ad_tape *tape, ad_arg a)
{
    return a.var.tape ? a.var : ad_scalar(tape, a.value);
}

static bool as_number(ad_arg a, double *value)
{
    if (a.var.tape)
        return ad_constant_value(a.var, value);
    *value = a.value;
    return true;
}

static ad_var elementwise(ad_tape *tape, enum ad_op op, size_t n, const ad_var *in)
{
    struct node node = {.op = (uint16_t)op, .rows = 1, .cols = 1};
    for (size_t i = 0; i < n; i++) {
        const struct node *x = node_at(tape, in[i].id);
        node.in[i] = in[i].id;
        uint32_t rows = broadcast_dim(node.rows, x->rows), cols = broadcast_dim(node.cols, x->cols);
        if (!rows || !cols)
            return refuse(tape, op, in[0], in[i]);
        node.rows = rows;
        node.cols = cols;
    }
    return ad_append(tape, node);
}

ad_var ad_unary(enum ad_op op, ad_var x)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if (op == AD_OP_neg && n->op == AD_OP_neg)
        return (ad_var){x.tape, n->in[0]};
    double value;
    if (op == AD_OP_neg && ad_constant_value(x, &value))
        return ad_scalar(x.tape, -value);
    return elementwise(x.tape, op, 1, &x);
}

ad_var ad_scale(ad_var x, double c)
{
    double inner;
    const struct node *n = node_at(x.tape, x.id);
    if (n->op == AD_OP_mul && ad_constant_value((ad_var){x.tape, n->in[1]}, &inner))
        return ad_scale((ad_var){x.tape, n->in[0]}, c * inner);
    if (n->op == AD_OP_neg)
        return ad_scale((ad_var){x.tape, n->in[0]}, -c);
    if (c == 1)
        return x;
    if (c == -1)
        return ad_neg(x);
    return elementwise(x.tape, AD_OP_mul, 2, (ad_var[]){x, ad_scalar(x.tape, c)});
}

static bool is_power_of_two(double c)
{
    int exponent;
    return isfinite(c) && fabs(frexp(c, &exponent)) == 0.5 && abs(exponent) < 100;
}

/* x^c; false where only pow itself will do. */
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
        *y = elementwise(x.tape, AD_OP_powi, 2, (ad_var[]){x, ad_scalar(x.tape, c)});
    else
        return false;
    return true;
}

/* Both arguments are numbers on the tape. */
static bool fold(enum ad_op op, double a, double b, double *y)
{
    switch (op) {
    case AD_OP_add:
        *y = a + b;
        return true;
    case AD_OP_sub:
        *y = a - b;
        return true;
    case AD_OP_mul:
        *y = a * b;
        return true;
    case AD_OP_div:
        *y = a / b;
        return true;
    default:
        return false;
    }
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

/* Sums of negated terms are differences. */
static bool simplify_signs(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    const struct node *na = node_at(a.tape, a.id), *nb = node_at(b.tape, b.id);
    if ((op == AD_OP_add || op == AD_OP_sub) && nb->op == AD_OP_neg) {
        ad_var c = {b.tape, nb->in[0]};
        *y = op == AD_OP_add ? ad_sub(a, c) : ad_add(a, c);
        return true;
    }
    if (op == AD_OP_add && na->op == AD_OP_neg) {
        *y = ad_sub(b, ((ad_var){a.tape, na->in[0]}));
        return true;
    }
    return false;
}

/* x^2 x is one operation: its gradient has one path to x instead of two. */
static bool simplify_cube(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    const struct node *na = node_at(a.tape, a.id), *nb = node_at(b.tape, b.id);
    bool first = na->op == AD_OP_square && na->in[0] == b.id;
    bool second = nb->op == AD_OP_square && nb->in[0] == a.id;
    if (op != AD_OP_mul || !(first || second))
        return false;
    *y = ad_cube(first ? b : a);
    return true;
}

/* c/x for a constant c of any shape: the gradient needs 1/x as well. */
static bool simplify_quotient(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    if (op != AD_OP_div || node_at(a.tape, a.id)->op != AD_OP_constant)
        return false;
    *y = ad_mul(a, ad_recip(b));
    return true;
}

/* A factor 1 - t^2 with tanh t is one operation with its product: nothing is stored for it. */
static bool simplify_slope(enum ad_op op, ad_var a, ad_var b, ad_var *y)
{
    const struct node *na = node_at(a.tape, a.id), *nb = node_at(b.tape, b.id);
    if (op != AD_OP_mul || (na->op != AD_OP_tanh_slope && nb->op != AD_OP_tanh_slope))
        return false;
    bool first = nb->op != AD_OP_tanh_slope;
    ad_var t = {a.tape, first ? na->in[0] : nb->in[0]};
    *y = elementwise(a.tape, AD_OP_mul_tanh_slope, 2, (ad_var[]){first ? b : a, t});
    return true;
}

ad_var ad_binary(enum ad_op op, ad_arg a, ad_arg b)
{
    ad_tape *tape = common_tape(op, 2, (ad_arg[]){a, b});
    if (!tape || tape->error.status != AD_OK)
        return (ad_var){tape, 0};
    double ca, cb;
    bool number_a = as_number(a, &ca), number_b = as_number(b, &cb);
    double folded;
    if (number_a && number_b && fold(op, ca, cb, &folded))
        return ad_scalar(tape, folded);
    ad_var y;
    if (number_b && a.var.tape && simplify_right(op, a.var, cb, &y))
        return y;
    if (number_a && b.var.tape && simplify_left(op, ca, b.var, &y))
        return y;
    a.var = as_var(tape, a);
    b.var = as_var(tape, b);
    if (simplify_signs(op, a.var, b.var, &y) || simplify_slope(op, a.var, b.var, &y) ||
        simplify_cube(op, a.var, b.var, &y) || simplify_quotient(op, a.var, b.var, &y))
        return y;
    return elementwise(tape, op, 2, (ad_var[]){a.var, b.var});
}

ad_var ad_ternary(enum ad_op op, ad_arg a, ad_arg b, ad_arg c)
{
    ad_tape *tape = common_tape(op, 3, (ad_arg[]){a, b, c});
    if (!tape || tape->error.status != AD_OK)
        return (ad_var){tape, 0};
    return elementwise(tape, op, 3, (ad_var[]){as_var(tape, a), as_var(tape, b), as_var(tape, c)});
}
