/* Joints of segments (segment.h), by Schur complements: K the block of what is eliminated, C that
   beside the ends, g the gradients,
       A - C^T K^-1 C,   g_ends - C^T K^-1 g_K,   x_K = -K^-1 g_K - K^-1 C x_ends.
   The gradient is one more row of the matrix, which the elimination carries along. Negative
   eigenvalues of a matrix are those of K and of the complement together (Haynsworth, Linear
   Algebra Appl. 1, 1968). */
#include "segment.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"

#include <stdlib.h>
#include <string.h>

bool phys_joints_new(struct phys_joints *j, size_t dof, size_t most)
{
    size_t all = dof + most + phys_segment_side(dof);
    *j = (struct phys_joints){.dof = dof, .most = most};
    j->work = malloc(all * all * sizeof *j->work);
    j->pivots = malloc((dof + most + 1) * sizeof *j->pivots);
    j->place[0] = malloc(2 * all * sizeof *j->place[0]);
    if (!j->work || !j->pivots || !j->place[0])
        return false;
    j->place[1] = j->place[0] + all;
    return true;
}

void phys_joints_free(struct phys_joints *j) { AD_FREE(j->work, j->pivots, j->place[0]); }

/* Unknowns of the work: middle slice and inner ones, then slices before and behind, gradient. */
static void place_rows(struct phys_joints *j, size_t middle, size_t inner)
{
    size_t n = j->dof, ends = middle + inner, *left = j->place[0], *right = j->place[1];
    for (size_t k = 0; k < n; k++) {
        left[k] = ends + k;
        left[n + k] = k;
        right[k] = middle ? k : ends + k;
        right[n + inner + k] = ends + n + k;
    }
    for (size_t k = 0; k < inner; k++)
        right[n + k] = middle + k;
    left[2 * n] = right[2 * n + inner] = ends + 2 * n;
}

/* Adds the lower triangle of a [rows x rows]. */
static void add(const double *a, size_t rows, const size_t *place, size_t all, double *work)
{
    for (size_t c = 0; c < rows; c++)
        for (size_t r = c; r < rows; r++) {
            size_t i = place[r], k = place[c];
            work[i >= k ? k * all + i : i * all + k] += a[c * rows + r];
        }
}

void phys_segment_join(struct phys_joints *j, const double *left, const double *right,
                       const double *counts, size_t inner, double *whole, double *solved)
{
    size_t side = phys_segment_side(j->dof), middle = left ? j->dof : 0, n = middle + inner;
    size_t all = n + side, negative, zero;
    const double *before = left ? left + side * side : NULL;
    double determinant = 0, *total = phys_segment_counts(j->dof, whole);
    place_rows(j, middle, inner);
    memset(j->work, 0, all * all * sizeof *j->work);
    if (left)
        add(left, side, j->place[0], all, j->work);
    add(right, side + inner, j->place[1], all, j->work);
    for (size_t k = 0; k < n; k++)
        j->work[k * all + k] -= j->shift;
    zero = phys_lapack_symmetric_reduce(all, n, j->work, j->pivots) != 0;
    negative = phys_lapack_symmetric_inertia(n, all, j->work, j->pivots, &determinant);
    phys_lapack_symmetric_eliminated(all, n, j->work, j->pivots, solved);
    for (size_t c = 0; c < side; c++)
        memcpy(whole + c * side + c, j->work + (n + c) * all + n + c, (side - c) * sizeof *whole);
    total[0] = (before ? before[0] : 0) + (counts ? counts[0] : 0) + (double)negative;
    total[1] = (before ? before[1] : 0) + (counts ? counts[1] : 0) + (double)zero;
}

void phys_segment_expand(size_t dof, size_t n, const double *solved, const double *ends, double *x)
{
    const double *by_gradient = solved + 2 * dof * n;
    for (size_t k = 0; k < n; k++)
        x[k] = -by_gradient[k];
    for (size_t c = 0; c < 2 * dof; c++)
        for (size_t k = 0; k < n; k++)
            x[k] -= solved[c * n + k] * ends[c];
}
