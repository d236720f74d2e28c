/* Recording of elementwise operations: broadcasting, and what simplify.c knows. */
#include "autodiff/internal.h"

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

ad_var ad_elementwise(ad_tape *tape, enum ad_op op, size_t n, const ad_var *in)
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
    return ad_elementwise(x.tape, op, 1, &x);
}

ad_var ad_binary(enum ad_op op, ad_arg a, ad_arg b)
{
    ad_tape *tape = common_tape(op, 2, (ad_arg[]){a, b});
    if (!tape || tape->error.status != AD_OK)
        return (ad_var){tape, 0};
    ad_var y;
    if (ad_simplify_numbers(tape, op, a, b, &y))
        return y;
    ad_var in[] = {as_var(tape, a), as_var(tape, b)};
    return ad_simplify(op, in[0], in[1], &y) ? y : ad_elementwise(tape, op, 2, in);
}

ad_var ad_ternary(enum ad_op op, ad_arg a, ad_arg b, ad_arg c)
{
    ad_tape *tape = common_tape(op, 3, (ad_arg[]){a, b, c});
    if (!tape || tape->error.status != AD_OK)
        return (ad_var){tape, 0};
    return ad_elementwise(tape, op, 3,
                          (ad_var[]){as_var(tape, a), as_var(tape, b), as_var(tape, c)});
}
