/* Records operations that move or reduce values: leaves, sums, matmul, views, time differences.
   Errors of arguments are passed on. Index lists are in indices.c, extrema and softmax in
   reductions.c. */
#include "autodiff/internal.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- leaves ---- */

ad_var ad_input(ad_tape *tape, size_t rows, size_t cols, const char *label)
{
    if (!ad_shape_fits(tape, AD_OP_input, 0, NULL, rows, cols))
        return ad_refused(tape);
    ad_var x = ad_append(tape, (struct node){.op = AD_OP_input,
                                             .rows = (uint32_t)rows,
                                             .cols = (uint32_t)cols,
                                             .in = {tape->last_input}});
    tape->last_input = tape->error.status == AD_OK ? x.id : tape->last_input;
    return ad_label(x, label);
}

ad_var ad_hold(ad_var input)
{
    ad_var none;
    if (!ad_operands(AD_COMPOSITE_hold, 1, &input, &none))
        return none;
    struct node *n = node_at(input.tape, input.id);
    if (n->op != AD_OP_input)
        return ad_refuse_operands(input.tape, AD_E_ARGUMENT, AD_COMPOSITE_hold, 1, &input,
                                  "not an input");
    n->flags |= NODE_HELD;
    return input;
}

ad_var ad_const(ad_tape *tape, size_t rows, size_t cols, const double *values)
{
    if (!ad_shape_fits(tape, AD_OP_constant, 0, NULL, rows, cols))
        return ad_refused(tape);
    if (!values)
        return ad_refuse(tape, AD_E_ARGUMENT, "const: got no values (NULL)");
    uint32_t first = ad_append_numbers(tape, rows * cols, values);
    return ad_append(tape, (struct node){.op = AD_OP_constant,
                                         .rows = (uint32_t)rows,
                                         .cols = (uint32_t)cols,
                                         .aux = first});
}

ad_var ad_scalar(ad_tape *tape, double value) { return ad_const(tape, 1, 1, &value); }

ad_var ad_number(ad_tape *tape, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint32_t *recent = &tape->recent[bits * 0x9e3779b97f4a7c15u >> 58];
    static_assert(RECENT_NUMBERS == 1 << (64 - 58), "six bits of the hash");
    if (*recent < tape->n_nodes) {
        const struct node *n = node_at(tape, *recent);
        if ((n->flags & NODE_NUMBER) && !memcmp(&tape->numbers[n->aux], &value, sizeof value))
            return ad_at(tape, *recent);
    }
    ad_var x = ad_scalar(tape, value);
    if (tape->error.status == AD_OK) {
        node_at(tape, x.id)->flags |= NODE_NUMBER;
        *recent = x.id;
    }
    return x;
}

/* ---- sums ---- */

static ad_var reduce(ad_var x, enum ad_op op, bool rows, bool cols)
{
    ad_var none;
    if (!ad_operands(op, 1, &x, &none))
        return none;
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
    ad_var none;
    if (!ad_operands(AD_COMPOSITE_mean, 1, &x, &none))
        return none;
    return ad_mul(1.0 / (double)node_size(node_at(x.tape, x.id)), ad_sum(x));
}

ad_var ad_cumulative(ad_var x, unsigned flags)
{
    ad_var none;
    if (!ad_operands(AD_OP_cumsum, 1, &x, &none))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if ((flags & CUMSUM_ROWS ? n->rows : n->cols) == 1)
        return x;
    return ad_append(
        x.tape,
        (struct node){
            .op = AD_OP_cumsum, .rows = n->rows, .cols = n->cols, .in = {x.id}, .aux = flags});
}

ad_var ad_cumsum_rows(ad_var x) { return ad_cumulative(x, CUMSUM_ROWS); }

ad_var ad_cumsum_cols(ad_var x) { return ad_cumulative(x, 0); }

ad_var ad_dot(ad_var a, ad_var b)
{
    ad_var x[] = {a, b}, none;
    uint32_t rows, cols;
    if (!ad_operands(AD_COMPOSITE_dot, 2, x, &none) ||
        !ad_broadcasts(AD_COMPOSITE_dot, 2, x, &rows, &cols))
        return none;
    return ad_sum(ad_mul(a, b));
}

/* ---- matrices ---- */

ad_var ad_matmul(ad_var a, bool transpose_a, ad_var b, bool transpose_b)
{
    ad_var in[] = {a, b}, none;
    if (!ad_operands(AD_OP_matmul, 2, in, &none))
        return none;
    const struct node *x = node_at(a.tape, a.id), *y = node_at(b.tape, b.id);
    uint32_t rows = transpose_a ? x->cols : x->rows, inner_a = transpose_a ? x->rows : x->cols;
    uint32_t cols = transpose_b ? y->rows : y->cols, inner_b = transpose_b ? y->cols : y->rows;
    if (inner_a != inner_b)
        return ad_refuse_operands(a.tape, AD_E_SHAPE, AD_OP_matmul, 2, in, "%u x %u times %u x %u",
                                  rows, inner_a, inner_b, cols);
    if (!ad_shape_fits(a.tape, AD_OP_matmul, 2, in, rows, cols))
        return none;
    if (rows == 1 && cols == 1 && inner_a == 1)
        return ad_mul(a, b);
    return ad_append(a.tape,
                     (struct node){.op = AD_OP_matmul,
                                   .rows = rows,
                                   .cols = cols,
                                   .in = {a.id, b.id},
                                   .aux = (uint32_t)transpose_a | (uint32_t)transpose_b << 1});
}

ad_var ad_transpose(ad_var x)
{
    ad_var none;
    if (!ad_operands(AD_OP_transpose, 1, &x, &none))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if (n->op == AD_OP_transpose)
        return ad_at(x.tape, n->in[0]);
    if (n->rows == 1 || n->cols == 1)
        return ad_reshape(x, n->cols, n->rows);
    return ad_append(
        x.tape,
        (struct node){.op = AD_OP_transpose, .rows = n->cols, .cols = n->rows, .in = {x.id}});
}

/* ---- views ---- */

static ad_var slice(ad_var x, size_t row, size_t col, size_t rows, size_t cols)
{
    ad_var none;
    if (!ad_operands(AD_OP_slice, 1, &x, &none))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if (!rows || !cols || row > n->rows || rows > n->rows - row || col > n->cols ||
        cols > n->cols - col)
        return ad_refuse_operands(x.tape, AD_E_SHAPE, AD_OP_slice, 1, &x,
                                  "%zu x %zu from (%zu, %zu)", rows, cols, row, col);
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
    ad_var none;
    if (!ad_operands(AD_OP_reshape, 1, &x, &none) ||
        !ad_shape_fits(x.tape, AD_OP_reshape, 1, &x, rows, cols))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if (rows * cols != node_size(n))
        return ad_refuse_operands(x.tape, AD_E_SHAPE, AD_OP_reshape, 1, &x, "to %zu x %zu", rows,
                                  cols);
    if (rows == n->rows && cols == n->cols)
        return x;
    return ad_append(x.tape, (struct node){.op = AD_OP_reshape,
                                           .rows = (uint32_t)rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id}});
}

ad_var ad_broadcast(ad_var x, size_t rows, size_t cols)
{
    ad_var none;
    if (!ad_operands(AD_OP_broadcast, 1, &x, &none) ||
        !ad_shape_fits(x.tape, AD_OP_broadcast, 1, &x, rows, cols))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if ((n->rows != rows && n->rows != 1) || (n->cols != cols && n->cols != 1))
        return ad_refuse_operands(x.tape, AD_E_SHAPE, AD_OP_broadcast, 1, &x, "to %zu x %zu", rows,
                                  cols);
    if (rows == n->rows && cols == n->cols)
        return x;
    return ad_append(x.tape, (struct node){.op = AD_OP_broadcast,
                                           .rows = (uint32_t)rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id}});
}

/* ---- time difference ---- */

static ad_var difference(ad_var x, enum ad_op op, double scale, bool repeat, size_t cols)
{
    if (!isfinite(scale))
        return ad_refuse_operands(x.tape, AD_E_ARGUMENT, op, 1, &x, "scale %g", scale);
    uint32_t number = ad_append_numbers(x.tape, 1, &scale);
    return ad_append(x.tape, (struct node){.op = (uint16_t)op,
                                           .rows = node_at(x.tape, x.id)->rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id, 0, repeat},
                                           .aux = number});
}

ad_var ad_diff(ad_var x, double scale, bool repeat)
{
    ad_var none;
    if (!ad_operands(AD_OP_diff, 1, &x, &none))
        return none;
    if (ad_cols(x) < 2)
        return ad_refuse_operands(x.tape, AD_E_SHAPE, AD_OP_diff, 1, &x, "needs two columns");
    return difference(x, AD_OP_diff, scale, repeat, ad_cols(x) - !repeat);
}

ad_var ad_diff_adjoint(ad_var u, double scale, bool repeat, size_t cols)
{
    ad_var none;
    if (!ad_operands(AD_OP_diff_adjoint, 1, &u, &none) ||
        !ad_shape_fits(u.tape, AD_OP_diff_adjoint, 1, &u, ad_rows(u), cols))
        return none;
    if (cols < 2 || ad_cols(u) != cols - !repeat)
        return ad_refuse_operands(u.tape, AD_E_SHAPE, AD_OP_diff_adjoint, 1, &u,
                                  "columns do not match");
    return difference(u, AD_OP_diff_adjoint, scale, repeat, cols);
}
