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
    size_t column = (t->first + e) * h->side + b * t->dof + j;
    return h->element[column * h->side + a * t->dof + i] * t->scale[i] * t->scale[j];
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
    return b->band + 2 * e * b->room;
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
    memset(band, 0, 2 * b->room * sizeof *band);
    for (size_t j = 0; j < b->dof; j++) {
        phys_hessian_coupled(b->hessian, j, &first, &end);
        for (size_t c = 1; c < degree; c++) {
            size_t column = inner_row(b, c, j);
            for (size_t a = 1; a < degree; a++)
                for (size_t i = first; i < end; i++)
                    band[2 * PHYS_BAND(b->width, inner_row(b, a, i), column)] =
                        entry(b, e, a, i, c, j);
            band[2 * PHYS_BAND(b->width, column, column) + 1] = -damping;
        }
    }
    return phys_lapack_band_factor_complex(b->inner, b->width, band, inner_pivots(b, e)) == 0;
}

static void solve_inner(const struct phys_block_tridiagonal *b, size_t e, double *x)
{
    phys_lapack_band_solve_complex(b->inner, b->width, band_of(b, e), inner_pivots(b, e), x);
}

/* Adds `factor` times column (side, j) of C to x [inner]. */
static void add_coupling(const struct phys_block_tridiagonal *b, size_t e, size_t side, size_t j,
                         const double factor[2], double *x)
{
    size_t first, end;
    phys_hessian_coupled(b->hessian, j, &first, &end);
    for (size_t a = 1; a < b->hessian->table.degree; a++)
        for (size_t i = first; i < end; i++) {
            double c = entry(b, e, a, i, slice_node(b, side), j);
            x[2 * inner_row(b, a, i)] += c * factor[0];
            x[2 * inner_row(b, a, i) + 1] += c * factor[1];
        }
}

/* y -= column (side, j) of C times x [inner]. */
static void subtract_coupled(const struct phys_block_tridiagonal *b, size_t e, size_t side,
                             size_t j, const double *x, double y[2])
{
    size_t first, end;
    phys_hessian_coupled(b->hessian, j, &first, &end);
    for (size_t a = 1; a < b->hessian->table.degree; a++)
        for (size_t i = first; i < end; i++) {
            double c = entry(b, e, a, i, slice_node(b, side), j);
            y[0] -= c * x[2 * inner_row(b, a, i)];
            y[1] -= c * x[2 * inner_row(b, a, i) + 1];
        }
}

/* Row r of K^-1 C: all real parts of its 2 dof columns, then all imaginary ones. */
static double *row_of_solved(const struct phys_block_tridiagonal *b, size_t r)
{
    return b->solved + 4 * r * b->dof;
}

/* y -= c x, rows of n numbers; without `complex` both and c are real. */
static void subtract_row(size_t n, const double c[2], bool complex, const double *restrict x,
                         double *restrict y)
{
#pragma omp simd
    for (size_t k = 0; k < n; k++)
        y[k] -= c[0] * x[k];
    if (!complex)
        return;
#pragma omp simd
    for (size_t k = 0; k < n; k++) {
        y[k] += c[1] * x[n + k];
        y[n + k] -= c[0] * x[n + k] + c[1] * x[k];
    }
}

static void divide_row(size_t n, const double c[2], double *x)
{
    double size = c[0] * c[0] + c[1] * c[1], re = c[0] / size, im = c[1] / size;
    for (size_t k = 0; k < n; k++) {
        double x_re = x[k], x_im = x[n + k];
        x[k] = re * x_re + im * x_im;
        x[n + k] = re * x_im - im * x_re;
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
    size_t n = 2 * b->dof, w = b->width;
    for (size_t j = 0; j < b->inner; j++) {
        if ((size_t)pivots[j] != j + 1)
            swap_rows(2 * n, row_of_solved(b, j), row_of_solved(b, (size_t)pivots[j] - 1));
        for (size_t i = j + 1; i < b->inner && i <= j + w; i++)
            subtract_row(n, band + 2 * PHYS_BAND(w, i, j), complex, row_of_solved(b, j),
                         row_of_solved(b, i));
    }
    for (size_t j = b->inner; j-- > 0;) {
        divide_row(n, band + 2 * PHYS_BAND(w, j, j), row_of_solved(b, j));
        for (size_t i = j > 2 * w ? j - 2 * w : 0; i < j; i++) {
            const double *c = band + 2 * PHYS_BAND(w, i, j);
            if (c[0] != 0 || c[1] != 0)
                subtract_row(n, c, complex, row_of_solved(b, j), row_of_solved(b, i));
        }
    }
}

static void fill_couplings(const struct phys_block_tridiagonal *b, size_t e)
{
    size_t first, end;
    memset(b->solved, 0, 4 * b->dof * b->inner * sizeof *b->solved);
    for (size_t k = 0; k < 2 * b->dof; k++) {
        phys_hessian_coupled(b->hessian, k % b->dof, &first, &end);
        for (size_t a = 1; a < b->hessian->table.degree; a++)
            for (size_t i = first; i < end; i++)
                row_of_solved(b, inner_row(b, a, i))[k] =
                    entry(b, e, a, i, slice_node(b, k / b->dof), k % b->dof);
    }
}

/* Row i of a slice of the condensed element, for all columns of both slices, in b->work. */
static void condense_row(const struct phys_block_tridiagonal *b, size_t e, size_t side, size_t i,
                         bool complex)
{
    size_t n = 2 * b->dof, first, end;
    for (size_t other = 0; other < 2; other++)
        for (size_t j = 0; j < b->dof; j++)
            b->work[other * b->dof + j] =
                entry(b, e, slice_node(b, side), i, slice_node(b, other), j);
    memset(b->work + n, 0, n * sizeof *b->work);
    phys_hessian_coupled(b->hessian, i, &first, &end);
    for (size_t a = 1; a < b->hessian->table.degree; a++)
        for (size_t d = first; d < end; d++) {
            const double c[] = {entry(b, e, a, d, slice_node(b, side), i), 0};
            subtract_row(n, c, complex, row_of_solved(b, inner_row(b, a, d)), b->work);
        }
}

bool phys_condense(const struct phys_block_tridiagonal *b, size_t e, double damping)
{
    size_t n = b->dof;
    if (b->inner && !factor_inner(b, e, damping))
        return false;
    fill_couplings(b, e);
    solve_couplings(b, e, damping > 0);
    for (size_t side = 0; side < 2; side++)
        for (size_t i = 0; i < n; i++) {
            condense_row(b, e, side, i, damping > 0);
            for (size_t other = side; other < 2; other++)
                for (size_t j = 0; j < n; j++) {
                    double *s = phys_condensed_block(b, side, other) + 2 * (j * n + i);
                    s[0] = b->work[other * n + j];
                    s[1] = b->work[(2 + other) * n + j];
                }
        }
    return true;
}

/* ---- right sides ---- */

void phys_condense_right(const struct phys_block_tridiagonal *b, size_t e, double *y)
{
    double *x = phys_inner_of(y, b, e), *by_row = b->solved, *slice;
    for (size_t k = 0; k < b->inner; k++)
        memcpy(by_row + 2 * inner_row(b, 1 + k / b->dof, k % b->dof), x + 2 * k,
               2 * sizeof *by_row);
    solve_inner(b, e, by_row);
    memcpy(x, by_row, 2 * b->inner * sizeof *x);
    for (size_t side = 0; side < 2; side++)
        if ((slice = phys_slice_beside(y, b, e, side)) != NULL)
            for (size_t j = 0; j < b->dof; j++)
                subtract_coupled(b, e, side, j, x, slice + 2 * j);
}

void phys_condensed_expand(const struct phys_block_tridiagonal *b, size_t e, double *y)
{
    double *x = phys_inner_of(y, b, e), *by_row = b->solved, *slice;
    memset(by_row, 0, 2 * b->inner * sizeof *by_row);
    for (size_t side = 0; side < 2; side++)
        if ((slice = phys_slice_beside(y, b, e, side)) != NULL)
            for (size_t j = 0; j < b->dof; j++)
                add_coupling(b, e, side, j, slice + 2 * j, by_row);
    solve_inner(b, e, by_row);
    for (size_t k = 0; k < 2 * b->inner; k++)
        by_row[k] = x[k] - by_row[k];
    for (size_t k = 0; k < b->inner; k++)
        memcpy(x + 2 * k, by_row + 2 * inner_row(b, 1 + k / b->dof, k % b->dof), 2 * sizeof *x);
}
