/* Block elimination of H - i m (block_tridiagonal.h): with A_e the blocks and C_e the coupling of
   block e - 1 to block e, D_0 = A_0,   D_e = A_e - C_e^T D_e-1^-1 C_e. As H is symmetric, the
   imaginary part of every D_e is -m or below, so that |D_e^-1| <= 1/m: no pivoting between blocks
   is needed. */
#include "block_tridiagonal.h"
#include "physics/linear/linear.h"

#include <stdlib.h>
#include <string.h>

bool phys_block_tridiagonal_new(struct phys_block_tridiagonal *b,
                                const struct phys_hessian *hessian, size_t hold,
                                const double *scale)
{
    size_t dof = hessian->dof, size = hessian->table.degree * dof;
    size_t count = hessian->elements - 2 * (hold - 1);
    *b = (struct phys_block_tridiagonal){.hessian = hessian,
                                         .scale = scale,
                                         .first = hold - 1,
                                         .count = count,
                                         .dof = dof,
                                         .size = size};
    if (count > SIZE_MAX / sizeof(double) / 2 / size / size)
        return false;
    b->factor = malloc(2 * count * size * size * sizeof *b->factor);
    b->pivots = malloc(count * size * sizeof *b->pivots);
    b->right = malloc(2 * count * size * sizeof *b->right);
    b->coupling = malloc(4 * size * size * sizeof *b->coupling);
    b->work = b->coupling ? b->coupling + 2 * size * size : NULL;
    return b->factor && b->pivots && b->right && b->coupling;
}

void phys_block_tridiagonal_free(struct phys_block_tridiagonal *b)
{
    free(b->factor);
    free(b->pivots);
    free(b->right);
    free(b->coupling);
}

/* ---- the matrix ---- */

static size_t rows(const struct phys_block_tridiagonal *b, size_t e)
{
    return e + 1 < b->count ? b->size : b->size - b->dof;
}

/* D^-1 H D^-1 of an element, between coordinates i and j of its nodes. */
static double entry(const struct phys_block_tridiagonal *b, size_t e, size_t i, size_t j)
{
    const struct phys_hessian *h = b->hessian;
    double value = h->element[((b->first + e) * h->side + j) * h->side + i];
    return value * b->scale[i % b->dof] * b->scale[j % b->dof];
}

/* A_e - i damping: its own element's part, and the first slice of the next element. */
static void fill(const struct phys_block_tridiagonal *b, size_t e, double damping, double *D)
{
    size_t n = rows(b, e), dof = b->dof, last = n - dof;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            D[2 * (j * n + i)] = entry(b, e, dof + i, dof + j);
            D[2 * (j * n + i) + 1] = i == j ? -damping : 0;
        }
    for (size_t j = 0; e + 1 < b->count && j < dof; j++)
        for (size_t i = 0; i < dof; i++)
            D[2 * ((last + j) * n + last + i)] += entry(b, e + 1, i, j);
}

/* C_e, for e > 0, with rows of zeros for all but the last slice of block e - 1. */
static void fill_coupling(const struct phys_block_tridiagonal *b, size_t e)
{
    size_t above = b->size - b->dof;
    memset(b->coupling, 0, 2 * b->size * rows(b, e) * sizeof *b->coupling);
    for (size_t j = 0; j < rows(b, e); j++)
        for (size_t i = 0; i < b->dof; i++)
            b->coupling[2 * (j * b->size + above + i)] = entry(b, e, i, b->dof + j);
}

/* ---- elimination ---- */

static double *factor_of(const struct phys_block_tridiagonal *b, size_t e)
{
    return b->factor + 2 * e * b->size * b->size;
}

static void solve_block(const struct phys_block_tridiagonal *b, size_t e, double *x)
{
    phys_lapack_complex_solve(rows(b, e), factor_of(b, e), b->pivots + e * b->size, 1, x);
}

bool phys_block_tridiagonal_factor(struct phys_block_tridiagonal *b, double damping)
{
    for (size_t e = 0; e < b->count && rows(b, e) > 0; e++) {
        double *D = factor_of(b, e);
        int *pivots = b->pivots + e * b->size;
        fill(b, e, damping, D);
        if (e > 0) {
            fill_coupling(b, e);
            phys_lapack_complex_eliminate(b->size, factor_of(b, e - 1), pivots - b->size, b->dof,
                                          rows(b, e), b->coupling, b->work, D);
        }
        if (phys_lapack_complex_factor(rows(b, e), D, pivots) != 0)
            return false;
    }
    return true;
}

/* y_e -= C_e^T x, x the last slice of the block before. */
static void couple_forward(const struct phys_block_tridiagonal *b, size_t e, const double *x,
                           double *y)
{
    for (size_t j = 0; j < rows(b, e); j++)
        for (size_t i = 0; i < b->dof; i++) {
            double c = entry(b, e, i, b->dof + j);
            y[2 * j] -= c * x[2 * i];
            y[2 * j + 1] -= c * x[2 * i + 1];
        }
}

/* y, the last slice of the block before, -= C_e x. */
static void couple_backward(const struct phys_block_tridiagonal *b, size_t e, const double *x,
                            double *y)
{
    for (size_t j = 0; j < rows(b, e); j++)
        for (size_t i = 0; i < b->dof; i++) {
            double c = entry(b, e, i, b->dof + j);
            y[2 * i] -= c * x[2 * j];
            y[2 * i + 1] -= c * x[2 * j + 1];
        }
}

/* y_e = b_e - C_e^T (D_e-1^-1 y_e-1), then x_e = D_e^-1 (y_e - C_e+1 x_e+1). */
void phys_block_tridiagonal_solve(struct phys_block_tridiagonal *b, double *x)
{
    size_t size = b->size, behind = 2 * (size - b->dof), n = (b->count - 1) * size + size - b->dof;
    double *y = b->right;
    for (size_t k = 0; k < n; k++) {
        y[2 * k] = x[k];
        y[2 * k + 1] = 0;
    }
    for (size_t e = 1; e < b->count && rows(b, e) > 0; e++) {
        memcpy(b->work, y + 2 * (e - 1) * size, 2 * size * sizeof *y);
        solve_block(b, e - 1, b->work);
        couple_forward(b, e, b->work + behind, y + 2 * e * size);
    }
    for (size_t e = b->count; e-- > 0;) {
        if (e + 1 < b->count)
            couple_backward(b, e + 1, y + 2 * (e + 1) * size, y + 2 * e * size + behind);
        if (rows(b, e) > 0)
            solve_block(b, e, y + 2 * e * size);
    }
    for (size_t k = 0; k < n; k++)
        x[k] = y[2 * k];
}
