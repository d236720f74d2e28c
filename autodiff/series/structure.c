/* Operations that move or sum elements, on series. */
#include "autodiff/tape/elements.h"
#include "internal.h"

/* Element (r, c) of an operand of `cols` columns. */
static jet element(const jet *x, size_t cols, size_t r, size_t c) { return x[r * cols + c]; }

static void view(const ad_tape *tape, const struct node *n, const jet *x, jet *y)
{
    const struct elements at = ad_viewed_elements(tape, n);
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            y[r * n->cols + c] = x[element_at(&at, r, c)];
}

static void add_to(struct jet_builder *b, jet *y, jet x) { *y = ad_jet_add(b, *y, x); }

static void sum_into(struct jet_builder *b, const ad_tape *tape, const struct node *n,
                     const struct node *in, const jet *x, jet *y)
{
    const struct elements to = ad_summed_elements(tape, n);
    for (size_t r = 0; r < in->rows; r++)
        for (size_t c = 0; c < in->cols; c++)
            add_to(b, &y[element_at(&to, r, c)], element(x, in->cols, r, c));
}

static void cumulative(struct jet_builder *b, const struct node *n, const jet *x, jet *y)
{
    const bool rows = n->aux & CUMSUM_ROWS, reversed = n->aux & CUMSUM_REVERSED;
    const size_t length = rows ? n->rows : n->cols, others = rows ? n->cols : n->rows,
                 step = rows ? n->cols : 1, next = rows ? 1 : n->cols;
    for (size_t k = 0; k < others; k++) {
        jet sum = ad_jet_number(b, 0);
        for (size_t j = 0; j < length; j++) {
            const size_t i = k * next + (reversed ? length - 1 - j : j) * step;
            add_to(b, &sum, x[i]);
            y[i] = sum;
        }
    }
}

static void place(struct jet_builder *b, const ad_tape *tape, const struct node *n, jet *const at[],
                  jet *y)
{
    const uint32_t *list = tape->lists + n->aux;
    for (size_t k = 0; k < list[0]; k++) {
        const uint32_t *part = list + 1 + 3 * k;
        const struct node *x = node_at(tape, part[0]);
        for (size_t r = 0; r < x->rows; r++)
            for (size_t c = 0; c < x->cols; c++)
                add_to(b, &y[(part[1] + r) * n->cols + part[2] + c],
                       element(at[part[0]], x->cols, r, c));
    }
}

/* y[i] = scale (x[i+1] - x[i]) along rows, the last column twice if in[2] says so; or its
   transpose. */
static void difference(struct jet_builder *b, const ad_tape *tape, const struct node *n,
                       const struct node *in, const jet *x, jet *y)
{
    const double scale = tape->numbers[n->aux];
    const bool adjoint = n->op == AD_OP_diff_adjoint;
    const size_t wide = adjoint ? n->cols : in->cols, narrow = adjoint ? in->cols : n->cols;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < narrow; c++) {
            const size_t i = r * wide + (c + 1 < wide ? c : wide - 2), o = r * narrow + c;
            if (adjoint) {
                add_to(b, &y[i + 1], ad_jet_scale(b, scale, x[o]));
                add_to(b, &y[i], ad_jet_scale(b, -scale, x[o]));
            } else {
                y[o] = ad_jet_scale(b, scale, ad_jet_sub(b, x[i + 1], x[i]));
            }
        }
}

static void matmul(struct jet_builder *b, const struct node *n, const struct node *in,
                   const struct node *second, const jet *x, const jet *z, jet *y)
{
    const bool tx = n->aux & 1, tz = n->aux >> 1 & 1;
    const size_t inner = tx ? in->rows : in->cols;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            for (size_t k = 0; k < inner; k++)
                add_to(b, &y[r * n->cols + c],
                       ad_jet_mul(b, tx ? element(x, in->cols, k, r) : element(x, in->cols, r, k),
                                  tz ? element(z, second->cols, c, k)
                                     : element(z, second->cols, k, c)));
}

bool ad_jet_structure(struct jet_builder *b, const ad_tape *tape, const struct node *n,
                      jet *const at[], jet *y)
{
    const struct node *in = node_at(tape, n->in[0]);
    const jet *x = at[n->in[0]];
    for (size_t k = 0; k < node_size(n); k++)
        y[k] = ad_jet_number(b, 0);
    if (ad_is_view(n)) {
        view(tape, n, x, y);
        return true;
    }
    switch (n->op) {
    case AD_OP_constant:
        for (size_t k = 0; k < node_size(n); k++)
            y[k] = ad_jet_number(b, tape->numbers[n->aux + k]);
        return true;
    case AD_OP_scatter:
    case AD_OP_scatter_cols:
    case AD_OP_sum:
    case AD_OP_sum_rows:
    case AD_OP_sum_cols:
        sum_into(b, tape, n, in, x, y);
        return true;
    case AD_OP_cumsum:
        cumulative(b, n, x, y);
        return true;
    case AD_OP_place:
        place(b, tape, n, at, y);
        return true;
    case AD_OP_diff:
    case AD_OP_diff_adjoint:
        difference(b, tape, n, in, x, y);
        return true;
    case AD_OP_matmul:
        matmul(b, n, in, node_at(tape, n->in[1]), x, at[n->in[1]], y);
        return true;
    default:
        return false;
    }
}
