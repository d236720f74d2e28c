/* Records operations that move rows or columns by index lists. */
#include "autodiff/internal.h"

static bool is_of_columns(enum ad_op op)
{
    return op == AD_OP_gather_cols || op == AD_OP_scatter_cols;
}

/* op of the list at[0..n-1], each entry below `limit`: `length` rows or columns. */
static ad_var indexed(ad_var x, enum ad_op op, size_t n, const uint32_t at[], size_t limit,
                      size_t length)
{
    bool columns = is_of_columns(op);
    size_t rows = columns ? ad_rows(x) : length, cols = columns ? length : ad_cols(x);
    if (!ad_shape_fits(x.tape, op, 1, &x, rows, cols))
        return ad_refused(x.tape);
    if (n && !at)
        return ad_refuse_operands(x.tape, AD_E_ARGUMENT, op, 1, &x, "got no list of %s (NULL)",
                                  columns ? "columns" : "rows");
    for (size_t k = 0; k < n; k++)
        if (at[k] >= limit)
            return ad_refuse_operands(x.tape, AD_E_SHAPE, op, 1, &x, "entry %zu names %s %u of %zu",
                                      k, columns ? "column" : "row", at[k], limit);
    uint32_t list = ad_append_list(x.tape, n, at);
    return ad_append(x.tape, (struct node){.op = (uint16_t)op,
                                           .rows = (uint32_t)rows,
                                           .cols = (uint32_t)cols,
                                           .in = {x.id},
                                           .aux = list});
}

ad_var ad_gather_rows(ad_var x, size_t n, const uint32_t rows[])
{
    ad_var none;
    if (!ad_operands(AD_OP_gather, 1, &x, &none))
        return none;
    return indexed(x, AD_OP_gather, n, rows, ad_rows(x), n);
}

ad_var ad_gather_cols(ad_var x, size_t n, const uint32_t cols[])
{
    ad_var none;
    if (!ad_operands(AD_OP_gather_cols, 1, &x, &none))
        return none;
    return indexed(x, AD_OP_gather_cols, n, cols, ad_cols(x), n);
}

ad_var ad_scatter_rows(ad_var x, const uint32_t rows[], size_t height)
{
    ad_var none;
    if (!ad_operands(AD_OP_scatter, 1, &x, &none))
        return none;
    const struct node *n = node_at(x.tape, x.id);
    if (n->op == AD_OP_neg) /* scatter first: fewer elements to negate */
        return ad_neg(ad_scatter_rows(ad_at(x.tape, n->in[0]), rows, height));
    return indexed(x, AD_OP_scatter, ad_rows(x), rows, height, height);
}

ad_var ad_scatter_cols(ad_var x, const uint32_t cols[], size_t width)
{
    ad_var none;
    if (!ad_operands(AD_OP_scatter_cols, 1, &x, &none))
        return none;
    return indexed(x, AD_OP_scatter_cols, ad_cols(x), cols, width, width);
}
