/* With K the inner block of an element and C its coupling to both slices, P (K C; C^T A) P^T = L D
   L^T stops after K: what is left is A - C^T K^-1 C, of which the band is the sum. */
#include "reduced_elements.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDEST = 192 };            /* coordinates of an element: large ones are LAPACK's */
static const double GROWTH = 1e6; /* of its entries: the inner nodes alone are nearly singular */

bool phys_reduced_serves(const struct phys_hessian *h)
{
    return h->table.degree > 1 && h->width == h->dof && h->side <= WIDEST &&
           PHYS_BAND_ROWS(2 * h->dof) * (h->elements + 1) * h->dof < INT_MAX;
}

bool phys_reduced_new(struct phys_reduced *r, const struct phys_hessian *hessian, size_t hold,
                      const double *scale)
{
    size_t dof = hessian->dof, count = hessian->elements - 2 * (hold - 1), side = hessian->side;
    size_t slices = (count + 1) * dof, rows = PHYS_BAND_ROWS(2 * dof - 1);
    *r = (struct phys_reduced){.hessian = hessian,
                               .scale = scale,
                               .first = hold - 1,
                               .count = count,
                               .dof = dof,
                               .inner = side - 2 * dof,
                               .side = side,
                               .lead = hessian->free[0] || hessian->free[1] ? dof : 0};
    r->element = malloc((count * side * side + rows * slices + slices + side) * sizeof(double));
    r->pivots = malloc((count * r->inner + slices) * sizeof *r->pivots);
    if (!r->element || !r->pivots) {
        phys_reduced_free(r); /* the next factor tries again */
        return false;
    }
    r->band = r->element + count * side * side;
    r->slices = r->band + rows * slices;
    r->work = r->slices + slices;
    r->band_pivots = r->pivots + count * r->inner;
    return true;
}

void phys_reduced_free(struct phys_reduced *r)
{
    AD_FREE(r->element, r->pivots);
    *r = (struct phys_reduced){0};
}

/* Whether coordinate u % dof of slice u / dof moves. */
static bool moves(const struct phys_reduced *r, size_t u)
{
    size_t slice = u / r->dof;
    const bool *free = r->hessian->free[slice > 0];
    return (slice > 0 && slice < r->count) || (free && free[r->hessian->order[u % r->dof]]);
}

static double *inner_of(const struct phys_reduced *r, size_t e, double *x)
{
    return x + r->lead + e * (r->inner + r->dof);
}

/* Unknown u of the slices, which moves. */
static double *slice_unknown(const struct phys_reduced *r, size_t u, double *x)
{
    return inner_of(r, u / r->dof, x) + u % r->dof - r->dof;
}

/* ---- factors ---- */

/* The matrix of element e by columns; its largest entry. */
static double fill(const struct phys_reduced *r, size_t e, double *to)
{
    const struct phys_hessian *h = r->hessian;
    size_t n = r->dof, degree = h->table.degree;
    double most = 0;
    for (size_t b = 0; b <= degree; b++)
        for (size_t j = 0; j < n; j++) {
            size_t column = b == 0 ? r->inner + j : b < degree ? (b - 1) * n + j : r->side - n + j;
            const double *from = h->element + phys_hessian_place(h, r->first + e, 0, 0, b, j);
            double *inner = to + column * r->side, *before = inner + r->inner;
            for (size_t a = 0; a <= degree; a++) {
                double *at = a == 0 ? before : a < degree ? inner + (a - 1) * n : before + n;
                for (size_t i = 0; i < n; i++) {
                    at[i] = from[a * n + i] * r->scale[i] * r->scale[j];
                    most = fabs(at[i]) > most ? fabs(at[i]) : most;
                }
            }
        }
    return most;
}

/* Adds what is left of element e to the band; whether it is not too large. */
static bool add(const struct phys_reduced *r, size_t e, double largest)
{
    const double *from = r->element + e * r->side * r->side + r->inner * (r->side + 1);
    size_t width = 2 * r->dof - 1, first = e * r->dof;
    bool small = true;
    for (size_t j = 0; j <= width; j++)
        for (size_t i = 0; i <= width; i++) {
            double entry = from[i < j ? i * r->side + j : j * r->side + i];
            small = small && fabs(entry) <= GROWTH * largest;
            if (moves(r, first + i) && moves(r, first + j))
                r->band[PHYS_BAND(width, first + i, first + j)] += entry;
        }
    return small;
}

bool phys_reduced_factor(struct phys_reduced *r)
{
    size_t width = 2 * r->dof - 1, n = (r->count + 1) * r->dof;
    memset(r->band, 0, PHYS_BAND_ROWS(width) * n * sizeof *r->band);
    for (size_t e = 0; e < r->count; e++) {
        double *element = r->element + e * r->side * r->side, largest = fill(r, e, element);
        if (phys_lapack_symmetric_reduce(r->side, r->inner, element, r->pivots + e * r->inner) ||
            !add(r, e, largest))
            return false;
    }
    for (size_t u = 0; u < n; u++)
        if (!moves(r, u))
            r->band[PHYS_BAND(width, u, u)] = 1;
    return phys_lapack_band_factor(n, width, r->band, r->band_pivots) == 0;
}

/* ---- solving ---- */

void phys_reduced_solve(struct phys_reduced *r, double *x)
{
    size_t n = (r->count + 1) * r->dof, each = 2 * r->dof;
    double *inner, *ends = r->work + r->inner;
    for (size_t u = 0; u < n; u++)
        r->slices[u] = moves(r, u) ? *slice_unknown(r, u, x) : 0;
    for (size_t e = 0; e < r->count; e++) {
        memcpy(r->work, inner = inner_of(r, e, x), r->inner * sizeof *x);
        memset(ends, 0, each * sizeof *x);
        phys_lapack_symmetric_forward(r->side, r->inner, r->element + e * r->side * r->side,
                                      r->pivots + e * r->inner, r->work);
        memcpy(inner, r->work, r->inner * sizeof *x);
        for (size_t k = 0; k < each; k++)
            if (moves(r, e * r->dof + k))
                r->slices[e * r->dof + k] += ends[k];
    }
    phys_lapack_band_solve(n, each - 1, r->band, r->band_pivots, r->slices);
    for (size_t e = 0; e < r->count; e++) {
        memcpy(r->work, inner = inner_of(r, e, x), r->inner * sizeof *x);
        memcpy(ends, r->slices + e * r->dof, each * sizeof *x);
        phys_lapack_symmetric_backward(r->side, r->inner, r->element + e * r->side * r->side,
                                       r->pivots + e * r->inner, r->work);
        memcpy(inner, r->work, r->inner * sizeof *x);
    }
    for (size_t u = 0; u < n; u++)
        if (moves(r, u))
            *slice_unknown(r, u, x) = r->slices[u];
}
