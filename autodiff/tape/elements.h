/* Which element of one matrix an operation pairs with element (r, c) of another: the one rule of
   views, sums and lists of indices for direct evaluation, series and sparsity patterns. */
#ifndef AUTODIFF_TAPE_ELEMENTS_H
#define AUTODIFF_TAPE_ELEMENTS_H

#include "autodiff/internal.h"

/* Offset and strides, in elements, along rows and columns, or along lists of them. */
struct elements {
    size_t offset, row, col;
    const uint32_t *rows, *cols; /* NULL: r and c themselves */
};

static inline size_t element_at(const struct elements *e, size_t r, size_t c)
{
    return e->offset + (e->rows ? e->rows[r] : r) * e->row + (e->cols ? e->cols[c] : c) * e->col;
}

/* Element (r, c) of what n is broadcast to. */
static inline struct elements ad_broadcast_elements(const struct node *n)
{
    return (struct elements){.row = n->rows == 1 ? 0 : n->cols, .col = n->cols == 1 ? 0 : 1};
}

/* Whether n is its operand in another shape or order: slices, transposes, lists of rows. */
bool ad_is_view(const struct node *n);
/* Of a view: the element of the operand that is its element (r, c). */
struct elements ad_viewed_elements(const ad_tape *tape, const struct node *n);
/* Of a sum or a scatter: its element to which element (r, c) of the operand is added. */
struct elements ad_summed_elements(const ad_tape *tape, const struct node *n);

#endif
