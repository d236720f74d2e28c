/* Elements of views and sums (elements.h). */
#include "elements.h"

bool ad_is_view(const struct node *n)
{
    return n->op == AD_OP_gather || n->op == AD_OP_gather_cols || n->op == AD_OP_slice ||
           n->op == AD_OP_reshape || n->op == AD_OP_transpose || n->op == AD_OP_broadcast;
}

struct elements ad_viewed_elements(const ad_tape *tape, const struct node *n)
{
    const struct node *x = node_at(tape, n->in[0]);
    switch (n->op) {
    case AD_OP_slice:
        return (struct elements){(size_t)n->in[1] * x->cols + n->in[2], x->cols, 1, NULL, NULL};
    case AD_OP_reshape:
        return (struct elements){0, n->cols, 1, NULL, NULL};
    case AD_OP_transpose:
        return (struct elements){0, 1, x->cols, NULL, NULL};
    case AD_OP_gather:
        return (struct elements){0, x->cols, 1, tape->lists + n->aux + 1, NULL};
    case AD_OP_gather_cols:
        return (struct elements){0, x->cols, 1, NULL, tape->lists + n->aux + 1};
    default:
        return ad_broadcast_elements(x);
    }
}

struct elements ad_summed_elements(const ad_tape *tape, const struct node *n)
{
    struct elements e = ad_broadcast_elements(n);
    if (n->op == AD_OP_scatter)
        e.row = n->cols, e.rows = tape->lists + n->aux + 1;
    if (n->op == AD_OP_scatter_cols)
        e.col = 1, e.cols = tape->lists + n->aux + 1;
    return e;
}
