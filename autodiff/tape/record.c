/* Records elementwise operations: broadcasting, and the identities of simplify.c. */
#include "autodiff/internal.h"

#include <limits.h>
#include <math.h>

/* Dimensions a and b broadcast to one; 0 if they do not fit. */
static uint32_t broadcast_dim(uint32_t a, uint32_t b)
{
    return a == b || b == 1 ? a : a == 1 ? b : 0;
}

static ad_var as_var(ad_tape *tape, ad_arg a)
{
    return a.is_number ? ad_number(tape, a.value) : a.var;
}

bool ad_broadcasts(unsigned op, size_t n, const ad_var x[], uint32_t *rows, uint32_t *cols)
{
    *rows = *cols = 1;
    for (size_t i = 0; i < n && *rows && *cols; i++) {
        const struct node *in = node_at(x[i].tape, x[i].id);
        *rows = broadcast_dim(*rows, in->rows);
        *cols = broadcast_dim(*cols, in->cols);
    }
    if (*rows && *cols)
        return ad_is_shape(*rows, *cols) || ad_shape_fits(x->tape, op, n, x, *rows, *cols);
    ad_refuse_operands(x->tape, AD_E_SHAPE, op, n, x, "shapes do not broadcast");
    return false;
}

ad_var ad_elementwise(ad_tape *tape, enum ad_op op, size_t n, const ad_var *in)
{
    struct node node = {.op = (uint16_t)op};
    if (tape->error.status != AD_OK || !ad_broadcasts(op, n, in, &node.rows, &node.cols))
        return ad_at(tape, 0);
    for (size_t i = 0; i < n; i++)
        node.in[i] = in[i].id;
    return ad_append(tape, node);
}

/* True if op is elementwise, takes n arguments, and their variables are of one tape. */
static bool takes(enum ad_op op, size_t n, const ad_arg args[], ad_var *none)
{
    ad_var vars[3];
    size_t n_vars = 0;
    bool known = (unsigned)op < AD_N_OPS;
    for (size_t k = 0; k < n; k++)
        if (!args[k].is_number)
            vars[n_vars++] = args[k].var;
    if (!ad_operands(op, n_vars, vars, none))
        return false;
    if (known && ad_ops[op].elementwise && ad_ops[op].arity == n)
        return true;
    if (!known)
        ad_refuse_operands(none->tape, AD_E_ARGUMENT, UINT_MAX, n_vars, vars,
                           "no operation has number %d", (int)op);
    else if (!ad_ops[op].elementwise)
        ad_refuse_operands(none->tape, AD_E_ARGUMENT, op, n_vars, vars,
                           "expected an elementwise operation");
    else
        ad_refuse_operands(none->tape, AD_E_ARGUMENT, op, n_vars, vars,
                           "got %zu arguments; expected %d", n, ad_ops[op].arity);
    return false;
}

/* Whether x is a scalar of this tape to which no identity of simplify.c applies. */
static inline bool is_plain(const ad_tape *tape, ad_var x)
{
    return x.tape == tape && ad_is_current(x) && (node_at(tape, x.id)->flags & NODE_PLAIN);
}

/* ad_append of a scalar, written where it stays, field by field: a copy of a whole node would wait
   for its parts. */
static inline ad_var push_scalar(ad_tape *tape, enum ad_op op, uint32_t a, uint32_t b)
{
    if (tape->n_nodes == tape->n_blocks * BLOCK_SIZE)
        return ad_append(tape,
                         (struct node){.op = (uint16_t)op, .rows = 1, .cols = 1, .in = {a, b}});
    const uint32_t id = (uint32_t)tape->n_nodes++;
    struct node *n = node_at(tape, id);
    n->op = (uint16_t)op;
    n->flags = op == AD_OP_square || op == AD_OP_tanh_slope ? 0 : NODE_PLAIN;
    n->rows = n->cols = 1;
    n->in[0] = a;
    n->in[1] = b;
    n->in[2] = n->aux = 0;
    tape->n_scalars += tape->n_scalars == id;
    return ad_at(tape, id);
}

/* Fast path for scalar programs: an operation on plain scalars of one tape without an error.
   Everything else, errors included, takes the general path. */
static inline bool record_plain(enum ad_op op, uint8_t n, ad_var a, ad_var b, ad_var *y)
{
    ad_tape *tape = a.tape;
    if (!is_plain(tape, a) || !is_plain(tape, b) || tape->error.status != AD_OK ||
        (unsigned)op >= AD_N_OPS || !ad_ops[op].elementwise || ad_ops[op].arity != n ||
        op == AD_OP_neg || op == AD_OP_powi)
        return false;
    *y = push_scalar(tape, op, a.id, n > 1 ? b.id : 0);
    return true;
}

/* The same of a plain scalar and a number that simplify.c makes nothing of: no neutral one, no
   factor of a product, no divisor. */
static inline bool record_number(enum ad_op op, ad_var x, double c, bool left, ad_var *y)
{
    ad_tape *tape = x.tape;
    if (!is_plain(tape, x) || tape->error.status != AD_OK)
        return false;
    const bool product = op == AD_OP_mul;
    if (product ? fabs(c) == 1 || node_at(tape, x.id)->op == AD_OP_mul
                : c == 0 || (op != AD_OP_add && op != AD_OP_sub))
        return false;
    const uint32_t number = ad_number(tape, c).id;
    left = left && op == AD_OP_sub;
    *y = push_scalar(tape, op, left ? number : x.id, left ? x.id : number);
    return true;
}

/* powi needs an integer exponent that is known when recording. */
static bool is_whole_power(ad_arg b)
{
    double value = b.value;
    return (b.is_number || ad_constant_value(b.var, &value)) && value == floor(value) &&
           fabs(value) <= 32;
}

ad_var ad_unary(enum ad_op op, ad_var x)
{
    ad_var none, y;
    if (record_plain(op, 1, x, x, &y))
        return y;
    if (!takes(op, 1, (ad_arg[]){ad_arg_var(x)}, &none))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if (op == AD_OP_neg && n->op == AD_OP_neg)
        return ad_at(x.tape, n->in[0]);
    double value;
    if (op == AD_OP_neg && ad_constant_value(x, &value))
        return ad_scalar(x.tape, -value);
    return ad_elementwise(x.tape, op, 1, &x);
}

ad_var ad_binary_vars(enum ad_op op, ad_var a, ad_var b)
{
    ad_var y;
    return record_plain(op, 2, a, b, &y) ? y : ad_binary(op, ad_arg_var(a), ad_arg_var(b));
}

ad_var ad_binary_right(enum ad_op op, ad_var a, double b)
{
    ad_var y;
    return record_number(op, a, b, false, &y) ? y : ad_binary(op, ad_arg_var(a), ad_arg_number(b));
}

ad_var ad_binary_left(enum ad_op op, double a, ad_var b)
{
    ad_var y;
    return record_number(op, b, a, true, &y) ? y : ad_binary(op, ad_arg_number(a), ad_arg_var(b));
}

ad_var ad_binary(enum ad_op op, ad_arg a, ad_arg b)
{
    ad_var none, y;
    if (!takes(op, 2, (ad_arg[]){a, b}, &none))
        return none;
    ad_tape *tape = none.tape;
    if (op == AD_OP_powi && !is_whole_power(b))
        return ad_refuse_operands(tape, AD_E_ARGUMENT, op, 0, NULL,
                                  "the power is no whole number from -32 to 32");
    if (ad_simplify_numbers(tape, op, a, b, &y))
        return y;
    ad_var in[] = {as_var(tape, a), as_var(tape, b)};
    uint32_t rows, cols; /* a simplified form would be refused under another name */
    if (!ad_broadcasts(op, 2, in, &rows, &cols))
        return ad_at(tape, 0);
    return ad_simplify(op, in[0], in[1], &y) ? y : ad_elementwise(tape, op, 2, in);
}

ad_var ad_ternary(enum ad_op op, ad_arg a, ad_arg b, ad_arg c)
{
    ad_var none;
    if (!takes(op, 3, (ad_arg[]){a, b, c}, &none))
        return none;
    ad_tape *tape = none.tape;
    return ad_elementwise(tape, op, 3,
                          (ad_var[]){as_var(tape, a), as_var(tape, b), as_var(tape, c)});
}
