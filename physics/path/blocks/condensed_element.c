/* Elements of a path's Hessian without their inner nodes: S = A - C^T K^-1 C, K the inner block and
   C its coupling to both slices, bands by coordinate where L couples neighbours alone. */
#include "condensed_element.h"
#include "physics/linear/linear.h"

#include <string.h>

/* ---- the matrix ---- */

/* D^-1 H D^-1 of an element, between coordinates i and j of its nodes a and b. */
static double entry(const struct phys_block_tridiagonal *t, size_t e, size_t a, size_t i, size_t b,
                    size_t j)
{
    const struct phys_hessian *h = t->hessian;
    return phys_hessian_entry(h, t->first + e, a, i, b, j) * t->scale[i] * t->scale[j];
}

/* Node 0 or 1 of a condensed element: the slice before or behind. */
static size_t slice_node(const struct phys_block_tridiagonal *b, size_t side)
{
    return side * b->hessian->table.degree;
}

/* Row of coordinate i at inner node a, by coordinate. */
static size_t inner_row(const struct phys_block_tridiagonal *b, size_t a, size_t i)
{
    return i * (b->hessian->table.degree - 1) + a - 1;
}

static double *band_of(const struct phys_block_tridiagonal *b, size_t e)
{
    return b->band + b->parts * e * b->room;
}

static int *inner_pivots(const struct phys_block_tridiagonal *b, size_t e)
{
    return b->pivots + e * (b->dof + b->inner) + b->dof;
}

/* ---- inner nodes ---- */

static bool factor_inner(const struct phys_block_tridiagonal *b, size_t e, double damping)
{
    double *band = band_of(b, e);
    size_t degree = b->hessian->table.degree, first, end;
    memset(band, 0, b->parts * b->room * sizeof *band);
    for (size_t j = 0; j < b->dof; j++) {
        phys_hessian_coupled(b->hessian, j, &first, &end);
        for (size_t c = 1; c < degree; c++) {
            size_t column = inner_row(b, c, j);
            for (size_t a = 1; a < degree; a++)
                for (size_t i = first; i < end; i++)
                    band[b->parts * PHYS_BAND(b->width, inner_row(b, a, i), column)] =
                        entry(b, e, a, i, c, j);
            if (b->parts == 2)
                band[2 * PHYS_BAND(b->width, column, column) + 1] = -damping;
        }
    }
    return (b->parts == 1 ? phys_lapack_band_factor : phys_lapack_band_factor_complex)(
               b->inner, b->width, band, inner_pivots(b, e)) == 0;
}

static void solve_inner(const struct phys_block_tridiagonal *b, size_t e, double *x)
{
    (b->parts == 1 ? phys_lapack_band_solve : phys_lapack_band_solve_complex)(
        b->inner, b->width, band_of(b, e), inner_pivots(b, e), x);
}

/* Adds `factor` times column (side, j) of C to x [inner]. */
static void add_coupling(const struct phys_block_tridiagonal *b, size_t e, size_t side, size_t j,
                         const double *factor, double *x)
{
    size_t first, end;
    phys_hessian_coupled(b->hessian, j, &first, &end);
    for (size_t a = 1; a < b->hessian->table.degree; a++)
        for (size_t i = first; i < end; i++) {
            double c = entry(b, e, a, i, slice_node(b, side), j);
            for (size_t part = 0; part < b->parts; part++)
                x[b->parts * inner_row(b, a, i) + part] += c * factor[part];
        }
}

/* y -= column (side, j) of C times x [inner]. */
static void subtract_coupled(const struct phys_block_tridiagonal *b, size_t e, size_t side,
                             size_t j, const double *x, double *y)
{
    size_t first, end;
    phys_hessian_coupled(b->hessian, j, &first, &end);
    for (size_t a = 1; a < b->hessian->table.degree; a++)
        for (size_t i = first; i < end; i++) {
            double c = entry(b, e, a, i, slice_node(b, side), j);
            for (size_t part = 0; part < b->parts; part++)
                y[part] -= c * x[b->parts * inner_row(b, a, i) + part];
        }
}

/* Row r of K^-1 C: all real parts of its 2 dof columns, then all imaginary ones. Column 2 i + side
   is that of coordinate i. */
static double *row_of_solved(const struct phys_block_tridiagonal *b, size_t r)
{
    return b->solved + 2 * b->parts * r * b->dof;
}

/* Columns of row r that are needed, as S is symmetric: those up to what a row that may be swapped
   with r couples. In the first sweep the others are zero yet. */
static size_t columns_at(const struct phys_block_tridiagonal *b, size_t r)
{
    size_t last = (r + b->width) / (b->hessian->table.degree - 1) + b->reach;
    return 2 * (last < b->dof ? last + 1 : b->dof);
}

/* y -= c x, over `n` columns of rows of `all`; without `complex` both and c are real. */
static void subtract_row(size_t n, size_t all, const double *c, bool complex,
                         const double *restrict x, double *restrict y)
{
    if (!complex) {
#pragma omp simd
        for (size_t k = 0; k < n; k++)
            y[k] -= c[0] * x[k];
        return;
    }
#pragma omp simd
    for (size_t k = 0; k < n; k++) {
        y[k] -= c[0] * x[k] - c[1] * x[all + k];
        y[all + k] -= c[0] * x[all + k] + c[1] * x[k];
    }
}

static void divide_row(size_t n, size_t all, const double *c, bool complex, double *x)
{
    for (size_t k = 0; !complex && k < n; k++)
        x[k] /= c[0];
    if (!complex)
        return;
    double size = c[0] * c[0] + c[1] * c[1], re = c[0] / size, im = c[1] / size;
    for (size_t k = 0; k < n; k++) {
        double x_re = x[k], x_im = x[all + k];
        x[k] = re * x_re + im * x_im;
        x[all + k] = re * x_im - im * x_re;
    }
}

static void swap_rows(size_t n, double *x, double *y)
{
    for (size_t k = 0; k < n; k++) {
        double swap = x[k];
        x[k] = y[k];
        y[k] = swap;
    }
}

/* C becomes K^-1 C, from the factors P L U of LAPACK, all columns at a time. */
static void solve_couplings(const struct phys_block_tridiagonal *b, size_t e, bool complex)
{
    const double *band = band_of(b, e);
    const int *pivots = inner_pivots(b, e);
    size_t all = 2 * b->dof, w = b->width;
    for (size_t j = 0; j < b->inner; j++) {
        size_t n = columns_at(b, j);
        if ((size_t)pivots[j] != j + 1)
            swap_rows(b->parts * all, row_of_solved(b, j), row_of_solved(b, (size_t)pivots[j] - 1));
        for (size_t i = j + 1; i < b->inner && i <= j + w; i++)
            subtract_row(n, all, band + b->parts * PHYS_BAND(w, i, j), complex, row_of_solved(b, j),
                         row_of_solved(b, i));
    }
    for (size_t j = b->inner; j-- > 0;) {
        size_t n = columns_at(b, j);
        divide_row(n, all, band + b->parts * PHYS_BAND(w, j, j), complex, row_of_solved(b, j));
        for (size_t i = j > 2 * w ? j - 2 * w : 0; i < j; i++) {
            const double *c = band + b->parts * PHYS_BAND(w, i, j);
            if (c[0] != 0 || (complex && c[1] != 0))
                subtract_row(columns_at(b, i), all, c, complex, row_of_solved(b, j),
                             row_of_solved(b, i));
        }
    }
}

static void fill_couplings(const struct phys_block_tridiagonal *b, size_t e)
{
    size_t first, end;
    memset(b->solved, 0, 2 * b->parts * b->dof * b->inner * sizeof *b->solved);
    for (size_t k = 0; k < 2 * b->dof; k++) {
        phys_hessian_coupled(b->hessian, k / 2, &first, &end);
        for (size_t a = 1; a < b->hessian->table.degree; a++)
            for (size_t i = first; i < end; i++)
                row_of_solved(b, inner_row(b, a, i))[k] =
                    entry(b, e, a, i, slice_node(b, k % 2), k / 2);
    }
}

/* Row i of a slice of the condensed element in b->work, over columns 2 j + side of j <= i. */
static void condense_row(const struct phys_block_tridiagonal *b, size_t e, size_t side, size_t i,
                         bool complex)
{
    size_t all = 2 * b->dof, n = 2 * (i + 1), first, end;
    memset(b->work, 0, b->parts * all * sizeof *b->work);
    phys_hessian_coupled(b->hessian, i, &first, &end);
    for (size_t k = 2 * first; k < n; k++)
        b->work[k] = entry(b, e, slice_node(b, side), i, slice_node(b, k % 2), k / 2);
    for (size_t a = 1; a < b->hessian->table.degree; a++)
        for (size_t d = first; d < end; d++) {
            const double c[] = {entry(b, e, a, d, slice_node(b, side), i), 0};
            subtract_row(n, all, c, complex, row_of_solved(b, inner_row(b, a, d)), b->work);
        }
}

/* Columns of `side` of the row in b->work up to column i, to column i of a block. */
static void put(const struct phys_block_tridiagonal *b, size_t side, size_t i, double *block)
{
    const double *re = b->work + side, *im = re + 2 * b->dof;
    double *to = block + b->parts * i * b->dof;
    for (size_t j = 0; b->parts == 1 && j <= i; j++)
        to[j] = re[2 * j];
    for (size_t j = 0; b->parts == 2 && j <= i; j++) {
        to[2 * j] = re[2 * j];
        to[2 * j + 1] = im[2 * j];
    }
}

/* The entries below the diagonal of a block of n columns from those above of another, a tile of
   both at a time, so that each stays in the cache. */
static void mirror(size_t n, size_t parts, const double *above, double *below)
{
    enum { TILE = 16 };
    for (size_t from = 0; from < n; from += TILE)
        for (size_t j = 0; j < n; j++) /* a column */
            for (size_t i = from > j ? from : j + 1; i < n && i < from + TILE; i++) {
                const double *entry_above = above + parts * (i * n + j);
                double *entry_below = below + parts * (j * n + i);
                entry_below[0] = entry_above[0];
                if (parts == 2)
                    entry_below[1] = entry_above[1];
            }
}

bool phys_condense(const struct phys_block_tridiagonal *b, size_t e, double damping, double *before,
                   double *both, double *behind)
{
    if (b->inner && !factor_inner(b, e, damping))
        return false;
    fill_couplings(b, e);
    solve_couplings(b, e, damping > 0);
    for (size_t side = 0; side < 2; side++) {
        double *own = side ? behind : before;
        for (size_t i = 0; i < b->dof; i++) {
            condense_row(b, e, side, i, damping > 0);
            put(b, side, i, own);
            put(b, !side, i, side ? both : behind); /* which is room until it is its turn */
        }
        mirror(b->dof, b->parts, own, own);
        if (side == 0)
            mirror(b->dof, b->parts, behind, both);
    }
    return true;
}

/* ---- right sides ---- */

void phys_condense_right(const struct phys_block_tridiagonal *b, size_t e, double *y)
{
    double *x = phys_inner_of(y, b, e), *by_row = b->solved, *slice;
    for (size_t k = 0; k < b->inner; k++)
        memcpy(by_row + b->parts * inner_row(b, 1 + k / b->dof, k % b->dof), x + b->parts * k,
               b->parts * sizeof *by_row);
    solve_inner(b, e, by_row);
    memcpy(x, by_row, b->parts * b->inner * sizeof *x);
    for (size_t side = 0; side < 2; side++)
        if ((slice = phys_slice_beside(y, b, e, side)) != NULL)
            for (size_t j = 0; j < b->dof; j++)
                subtract_coupled(b, e, side, j, x, slice + b->parts * j);
}

void phys_condensed_expand(const struct phys_block_tridiagonal *b, size_t e, double *y)
{
    double *x = phys_inner_of(y, b, e), *by_row = b->solved, *slice;
    memset(by_row, 0, b->parts * b->inner * sizeof *by_row);
    for (size_t side = 0; side < 2; side++)
        if ((slice = phys_slice_beside(y, b, e, side)) != NULL)
            for (size_t j = 0; j < b->dof; j++)
                add_coupling(b, e, side, j, slice + b->parts * j, by_row);
    solve_inner(b, e, by_row);
    for (size_t k = 0; k < b->parts * b->inner; k++)
        by_row[k] = x[k] - by_row[k];
    for (size_t k = 0; k < b->inner; k++)
        memcpy(x + b->parts * k, by_row + b->parts * inner_row(b, 1 + k / b->dof, k % b->dof),
               b->parts * sizeof *x);
}
