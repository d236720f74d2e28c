/* Block elimination of H - i m (block_tridiagonal.h). Within an element the inner nodes K are
   eliminated, S = A - C^T K^-1 C, C their coupling to both slices, which leaves blocks A_s and
   couplings B_s over the slices; then D_1 = A_1, D_s = A_s - B_s^T D_s-1^-1 B_s. K and C are bands
   by coordinate where L couples neighbours alone. As H is symmetric, the imaginary part of every K
   and D_s is -m or below, so that their inverses are at most 1/m: no pivoting between blocks is
   needed. */
#include "autodiff/free.h"
#include "condensed_element.h"
#include "physics/linear/linear.h"

#include <stdlib.h>
#include <string.h>

static size_t inner_width(const struct phys_hessian *h)
{
    size_t inner = h->table.degree - 1;
    return inner ? h->reach * inner + inner - 1 : 0;
}

double phys_block_tridiagonal_cost(const struct phys_hessian *h)
{
    double n = (double)h->dof, w = (double)inner_width(h), m = (double)(h->table.degree - 1) * n;
    /* Real blocks count as complex ones, too: a band also pivots between slices. */
    return 4 * (double)h->elements * (6 * n * n * n + 6 * n * m * w + 2 * m * w * w);
}

double phys_block_tridiagonal_bytes(const struct phys_hessian *h)
{
    double n = (double)h->dof, m = (double)(h->table.degree - 1) * n;
    double rows = (double)PHYS_BAND_ROWS(inner_width(h));
    return sizeof(double) * (double)h->elements * (4 * n * n + 2 * rows * m);
}

bool phys_block_tridiagonal_new(struct phys_block_tridiagonal *b,
                                const struct phys_hessian *hessian, size_t hold,
                                const double *scale)
{
    size_t dof = hessian->dof, size = hessian->table.degree * dof, inner = size - dof;
    size_t count = hessian->elements - 2 * (hold - 1);
    *b = (struct phys_block_tridiagonal){.hessian = hessian,
                                         .scale = scale,
                                         .first = hold - 1,
                                         .count = count,
                                         .dof = dof,
                                         .inner = inner,
                                         .reach = hessian->reach,
                                         .width = inner_width(hessian)};
    b->room = PHYS_BAND_ROWS(b->width) * inner;
    size_t slices = 2 * count * dof * dof, condensed = 2 * (dof * dof + 2 * dof * inner);
    if (count > SIZE_MAX / sizeof(double) / 8 / (b->room + dof * dof))
        return false;
    b->slice =
        malloc((2 * slices + 2 * count * b->room + condensed + 4 * dof * dof) * sizeof *b->slice);
    b->right = malloc(2 * (count + 1) * size * sizeof *b->right);
    b->pivots = malloc(count * size * sizeof *b->pivots);
    if (!b->slice || !b->right || !b->pivots) {
        phys_block_tridiagonal_free(b); /* the next factor tries again */
        return false;
    }
    b->coupling = b->slice + slices;
    b->band = b->coupling + slices;
    b->condensed = b->band + 2 * count * b->room;
    b->solved = b->condensed + 2 * dof * dof;
    b->work = b->solved + 4 * dof * inner;
    return true;
}

void phys_block_tridiagonal_free(struct phys_block_tridiagonal *b)
{
    AD_FREE(b->slice, b->right, b->pivots);
    *b = (struct phys_block_tridiagonal){0};
}

/* ---- slices ---- */

static double *slice_of(const struct phys_block_tridiagonal *b, size_t s)
{
    return b->slice + b->parts * s * b->dof * b->dof;
}

static double *coupling_of(const struct phys_block_tridiagonal *b, size_t s)
{
    return b->coupling + b->parts * s * b->dof * b->dof;
}

static int *slice_pivots(const struct phys_block_tridiagonal *b, size_t s)
{
    return b->pivots + s * (b->dof + b->inner);
}

/* Completes D of slice s from the element behind it, condensed, and factors it. */
static bool factor_slice(const struct phys_block_tridiagonal *b, size_t s, double damping)
{
    size_t n = b->dof;
    double *D = slice_of(b, s), *A = b->condensed;
    for (size_t k = 0; k < b->parts * n * n; k++)
        D[k] += A[k];
    for (size_t k = 0; damping > 0 && k < n; k++)
        D[2 * (k * n + k) + 1] -= damping;
    return phys_lapack_block_factor(damping > 0, n, D, slice_pivots(b, s)) == 0;
}

/* Slice s lies between elements s and s + 1. */
bool phys_block_tridiagonal_factor(struct phys_block_tridiagonal *b, double damping)
{
    b->parts = damping > 0 ? 2 : 1;
    size_t n = b->dof, bytes = b->parts * n * n * sizeof *b->slice;
    for (size_t e = 0; e < b->count; e++) {
        if (!phys_condense(b, e, damping, b->condensed, coupling_of(b, e), slice_of(b, e)) ||
            (e > 0 && !factor_slice(b, e - 1, damping)))
            return false;
        if (e == 0 || e + 1 == b->count)
            continue;
        memcpy(b->condensed, coupling_of(b, e), bytes);
        phys_lapack_block_eliminate(damping > 0, n, slice_of(b, e - 1), slice_pivots(b, e - 1), n,
                                    b->condensed, b->work, slice_of(b, e));
    }
    return true;
}

/* ---- solving ---- */

/* y -= B x, or B^T x. */
static void subtract_slice(const struct phys_block_tridiagonal *b, size_t s, bool transpose,
                           const double *x, double *y)
{
    phys_lapack_block_subtract(b->parts == 2, transpose, b->dof, coupling_of(b, s), x, y);
}

static void solve_slice(const struct phys_block_tridiagonal *b, size_t s, double *x)
{
    phys_lapack_block_solve(b->parts == 2, b->dof, slice_of(b, s), slice_pivots(b, s), x);
}

/* y_s = b_s - B_s^T (D_s-1^-1 y_s-1), then x_s = D_s^-1 (y_s - B_s+1 x_s+1). */
static void solve_slices(const struct phys_block_tridiagonal *b, double *y)
{
    size_t slices = b->count - 1;
    for (size_t s = 1; s < slices; s++) {
        memcpy(b->work, phys_at_slice(y, b, s - 1), b->parts * b->dof * sizeof *y);
        solve_slice(b, s - 1, b->work);
        subtract_slice(b, s, true, b->work, phys_at_slice(y, b, s));
    }
    for (size_t s = slices; s-- > 0;) {
        if (s + 1 < slices)
            subtract_slice(b, s + 1, false, phys_at_slice(y, b, s + 1), phys_at_slice(y, b, s));
        solve_slice(b, s, phys_at_slice(y, b, s));
    }
}

void phys_block_tridiagonal_solve(struct phys_block_tridiagonal *b, double *x)
{
    size_t n = b->count * (b->dof + b->inner) - b->dof;
    double *y = b->right;
    memset(y, 0, b->parts * n * sizeof *y);
    for (size_t k = 0; k < n; k++)
        y[b->parts * k] = x[k];
    for (size_t e = 0; b->inner && e < b->count; e++)
        phys_condense_right(b, e, y);
    solve_slices(b, y);
    for (size_t e = 0; b->inner && e < b->count; e++)
        phys_condensed_expand(b, e, y);
    for (size_t k = 0; k < n; k++)
        x[k] = y[b->parts * k];
}
