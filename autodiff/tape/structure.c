/* Recording of what moves or reduces values: leaves, sums, matmul, views, time difference. Each
   passes a failure of its arguments through. */
#include "autodiff/internal.h"

#include <math.h>

/* ---- leaves ---- */

bool ad_shape_fits(ad_tape *tape, const char *op, size_t rows, size_t cols)
{
    if (tape->error.status != AD_OK)
        return false;
    if (rows && cols && rows < UINT32_MAX && cols < UINT32_MAX && rows <= ((size_t)1 << 46) / cols)
        return true;
    ad_fail(&tape->error, AD_E_SHAPE, "%s: %zu x %zu is empty or too large", op, rows, cols);
    return false;
}

ad_var ad_input(ad_tape *tape, size_t rows, size_t cols, const char *label)
{
    if (!ad_shape_fits(tape, "input", rows, cols))
        return (ad_var){tape, 0};
    ad_var x = ad_append(
        tape, (struct node){.op = AD_OP_input, .rows = (uint32_t)rows, .cols = (uint32_t)cols});
    return ad_label(x, label);
}

ad_var ad_hold(ad_var input)
{
    if (input.tape->error.status == AD_OK) {
        struct node *n = node_at(input.tape, input.id);
        if (n->op != AD_OP_input)
            return ad_refuse(input.tape, AD_E_ARGUMENT, "hold: %s is not an input",
                             ad_op_name((enum ad_op)n->op));
        n->flags |= NODE_HELD;
    }
    return input;
}

ad_var ad_const(ad_tape *tape, size_t rows, size_t cols, const double *values)
{
    if (!ad_shape_fits(tape, "constant", rows, cols))
        return (ad_var){tape, 0};
    uint32_t first = ad_append_numbers(tape, rows * cols, values);
    return ad_append(tape, (struct node){.op = AD_OP_constant,
                                         .rows = (uint32_t)rows,
                                         .cols = (uint32_t)cols,
                                         .aux = first});
}

ad_var ad_scalar(ad_tape *tape, double value) { return ad_const(tape, 1, 1, &value); }

/* ---- sums ---- */

static ad_var reduce(ad_var x, enum ad_op op, bool rows, bool cols)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if ((!rows || n->rows == 1) && (!cols || n->cols == 1))
        return x;
    return ad_append(x.tape, (struct node){.op = (uint16_t)op,
                                           .rows = rows ? 1 : n->rows,
                                           .cols = cols ? 1 : n->cols,
                                           .in = {x.id}});
}

ad_var ad_sum(ad_var x) { return reduce(x, AD_OP_sum, true, true); }

ad_var ad_sum_rows(ad_var x) { return reduce(x, AD_OP_sum_rows, true, false); }

ad_var ad_sum_cols(ad_var x) { return reduce(x, AD_OP_sum_cols, false, true); }

ad_var ad_mean(ad_var x)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    return ad_mul(1.0 / (double)node_size(node_at(x.tape, x.id)), ad_sum(x));
}

ad_var ad_dot(ad_var a, ad_var b) { return ad_sum(ad_mul(a, b)); }

/* ---- matrices ---- */

ad_var ad_matmul(ad_var a, bool transpose_a, ad_var b, bool transpose_b)
{
    if (ad_failed(a) || ad_failed(b))
        return (ad_var){a.tape ? a.tape : b.tape, 0};
    if (a.tape != b.tape)
        return ad_refuse(a.tape, AD_E_TAPE, "matmul: variables of different tapes");
    const struct node *x = node_at(a.tape, a.id), *y = node_at(b.tape, b.id);
    uint32_t rows = transpose_a ? x->cols : x->rows, inner_a = transpose_a ? x->rows : x->cols;
    uint32_t cols = transpose_b ? y->rows : y->cols, inner_b = transpose_b ? y->cols : y->rows;
    if (inner_a != inner_b)
        return ad_refuse(a.tape, AD_E_SHAPE, "matmul: %u x %u times %u x %u", rows, inner_a,
                         inner_b, cols);
    return ad_append(a.tape,
                     (struct node){.op = AD_OP_matmul,
                                   .rows = rows,
                                   .cols = cols,
                                   .in = {a.id, b.id},
                                   .aux = (uint32_t)transpose_a | (uint32_t)transpose_b << 1});
}

ad_var ad_transpose(ad_var x)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if (n->op == AD_OP_transpose)
        return (ad_var){x.tape, n->in[0]};
    if (n->rows == 1 || n->cols == 1)
        return ad_reshape(x, n->cols, n->rows);
    return ad_append(
        x.tape,
        (struct node){.op = AD_OP_transpose, .rows = n->cols, .cols = n->rows, .in = {x.id}});
}

/* ---- views ---- */

static ad_var slice(ad_var x, size_t row, size_t col, size_t rows, size_t cols)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if (!rows || !cols || row > n->rows || rows > n->rows - row || col > n->cols ||
        cols > n->cols - col)
        return ad_refuse(x.tape, AD_E_SHAPE, "slice: %zu x %zu from (%zu, %zu), of a %u x %u value",
                         rows, cols, row, col, n->rows, n->cols);
    if (rows == n->rows && cols == n->cols)
        return x;
    return ad_append(x.tape, (struct node){.op = AD_OP_slice,
                                           .rows = (uint32_t)rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id, (uint32_t)row, (uint32_t)col}});
}

ad_var ad_slice_rows(ad_var x, size_t first, size_t count)
{
    return slice(x, first, 0, count, ad_cols(x));
}

ad_var ad_slice_cols(ad_var x, size_t first, size_t count)
{
    return slice(x, 0, first, ad_rows(x), count);
}

ad_var ad_row(ad_var x, size_t row) { return ad_slice_rows(x, row, 1); }

ad_var ad_col(ad_var x, size_t col) { return ad_slice_cols(x, col, 1); }

ad_var ad_reshape(ad_var x, size_t rows, size_t cols)
{
    if (ad_failed(x) || !ad_shape_fits(x.tape, "reshape", rows, cols))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if (rows * cols != node_size(n))
        return ad_refuse(x.tape, AD_E_SHAPE, "reshape: to %zu x %zu, of a %u x %u value", rows,
                         cols, n->rows, n->cols);
    if (rows == n->rows && cols == n->cols)
        return x;
    return ad_append(x.tape, (struct node){.op = AD_OP_reshape,
                                           .rows = (uint32_t)rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id}});
}

ad_var ad_broadcast(ad_var x, size_t rows, size_t cols)
{
    if (ad_failed(x) || !ad_shape_fits(x.tape, "broadcast", rows, cols))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if ((n->rows != rows && n->rows != 1) || (n->cols != cols && n->cols != 1))
        return ad_refuse(x.tape, AD_E_SHAPE, "broadcast: to %zu x %zu, of a %u x %u value", rows,
                         cols, n->rows, n->cols);
    if (rows == n->rows && cols == n->cols)
        return x;
    return ad_append(x.tape, (struct node){.op = AD_OP_broadcast,
                                           .rows = (uint32_t)rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id}});
}

static ad_var indexed(ad_var x, enum ad_op op, size_t n, const uint32_t rows[], size_t limit,
                      size_t height)
{
    if (ad_failed(x) || !ad_shape_fits(x.tape, ad_op_name(op), n, height))
        return (ad_var){x.tape, 0};
    for (size_t k = 0; k < n; k++)
        if (rows[k] >= limit)
            return ad_refuse(x.tape, AD_E_SHAPE, "%s: entry %zu names row %u of %zu",
                             ad_op_name(op), k, rows[k], limit);
    uint32_t list = ad_append_list(x.tape, n, rows);
    return ad_append(x.tape, (struct node){.op = (uint16_t)op,
                                           .rows = (uint32_t)height,
                                           .cols = node_at(x.tape, x.id)->cols,
                                           .in = {x.id},
                                           .aux = list});
}

ad_var ad_gather_rows(ad_var x, size_t n, const uint32_t rows[])
{
    return indexed(x, AD_OP_gather, n, rows, ad_rows(x), n);
}

ad_var ad_scatter_rows(ad_var x, const uint32_t rows[], size_t height)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    const struct node *n = node_at(x.tape, x.id);
    if (n->op == AD_OP_neg) /* adding up first leaves less to negate */
        return ad_neg(ad_scatter_rows((ad_var){x.tape, n->in[0]}, rows, height));
    return indexed(x, AD_OP_scatter, ad_rows(x), rows, height, height);
}

/* ---- time difference ---- */

static ad_var difference(ad_var x, enum ad_op op, double scale, bool repeat, size_t cols)
{
    if (!isfinite(scale))
        return ad_refuse(x.tape, AD_E_ARGUMENT, "%s: scale %g", ad_op_name(op), scale);
    uint32_t number = ad_append_numbers(x.tape, 1, &scale);
    return ad_append(x.tape, (struct node){.op = (uint16_t)op,
                                           .rows = node_at(x.tape, x.id)->rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id, 0, repeat},
                                           .aux = number});
}

ad_var ad_diff(ad_var x, double scale, bool repeat)
{
    if (ad_failed(x))
        return (ad_var){x.tape, 0};
    if (ad_cols(x) < 2)
        return ad_refuse(x.tape, AD_E_SHAPE, "diff: needs two columns, of a %zu x %zu value",
                         ad_rows(x), ad_cols(x));
    return difference(x, AD_OP_diff, scale, repeat, ad_cols(x) - !repeat);
}

ad_var ad_diff_adjoint(ad_var u, double scale, bool repeat, size_t cols)
{
    if (ad_failed(u))
        return (ad_var){u.tape, 0};
    if (cols < 2 || ad_cols(u) != cols - !repeat)
        return ad_refuse(u.tape, AD_E_SHAPE,
                         "diff_adjoint: columns do not match, of a %zu x %zu value", ad_rows(u),
                         ad_cols(u));
    return difference(u, AD_OP_diff_adjoint, scale, repeat, cols);
}
