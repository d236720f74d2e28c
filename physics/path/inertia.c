/* Numbers of eigenvalues of the action's Hessian, by elimination in order of time (Sylvester's law
   of inertia). Eliminating the inner nodes of each element leaves a block tridiagonal matrix over
   the slices with blocks A_i and couplings B_i; then
       D_1 = A_1,   D_i+1 = A_i+1 - B_i^T D_i^-1 B_i,
   and the number of negative eigenvalues of the Hessian is that of all D_i and inner blocks
   together. The count up to D_i is the index of the path up to slice i + 1: where it increases
   there is a point conjugate to the start (Morse; Gelfand, Fomin, Calculus of Variations, section
   29). */
#include "inertia.h"
#include "autodiff/blas.h"
#include "autodiff/free.h"
#include "physics/io/grow.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDEST = 192 }; /* coordinates of an element that is not left to LAPACK */

/* ---- elements ---- */

/* Entry of an element's matrix in the order inner nodes, slice before, slice behind. */
static double entry(const struct phys_inertia *c, size_t e, size_t i, size_t j)
{
    const struct phys_hessian *h = c->hessian;
    size_t a = c->order[i], b = c->order[j];
    return phys_hessian_entry(h, e, a / h->dof, a % h->dof, b / h->dof, b % h->dof);
}

/* Of the mass of its inner nodes, and of half that of its slices. */
static double length_of(const struct phys_inertia *c, size_t e)
{
    return c->integral ? phys_hessian_length(c->hessian, e) : 1;
}

/* Of a slice, which ends one element and begins another. */
static double slice_mass(const struct phys_inertia *c, size_t i)
{
    double before = i > 0 ? length_of(c, i - 1) : 0;
    double after = i < c->hessian->elements ? length_of(c, i) : 0;
    return c->integral ? 0.5 * c->mass[0] * (before + after) : 1;
}

/* The matrix of an element in the order of c->order, by columns, in c->K; full columns of the
   Hessian hold the slice before, the inner nodes and the slice behind. */
static void fill_element(struct phys_inertia *c, size_t e)
{
    const struct phys_hessian *h = c->hessian;
    size_t m = c->inner, n = c->dof, all = m + 2 * n;
    for (size_t j = 0; h->width < n && j < all; j++)
        for (size_t i = j; i < all; i++)
            c->K[j * all + i] = entry(c, e, i, j);
    for (size_t j = 0; h->width == n && j < all; j++) {
        double *to = c->K + j * all;
        size_t column = c->order[j];
        const double *from = h->element + phys_hessian_place(h, e, 0, 0, column / n, column % n);
        memcpy(to, from + n, m * sizeof *to);
        memcpy(to + m, from, n * sizeof *to);
        memcpy(to + m + n, from + n + m, n * sizeof *to);
    }
}

/* condense without LAPACK, which takes longer for small elements. */
static bool reduce(struct phys_inertia *c, size_t e, double sigma, size_t *negative)
{
    size_t m = c->inner, n = c->side, all = m + n;
    double length = length_of(c, e);
    fill_element(c, e);
    for (size_t i = 0; i < m; i++)
        c->K[i * all + i] -= sigma * length * c->mass[c->order[i] / c->dof];
    if (phys_lapack_symmetric_reduce(all, m, c->K, c->pivots) != 0)
        return false;
    *negative = phys_lapack_symmetric_inertia(m, all, c->K, c->pivots, &c->log_determinant);
    for (size_t j = 0; j < n; j++)
        for (size_t i = j; i < n; i++)
            c->S[j * n + i] = c->S[i * n + j] = c->K[(m + j) * all + m + i];
    return true;
}

/* Puts the element without its inner nodes, shifted by -sigma there, into c->S. False: sigma is an
   eigenvalue of the inner block to the last bit; else `negative` of them are below it. */
static bool condense(struct phys_inertia *c, size_t e, double sigma, size_t *negative)
{
    size_t m = c->inner, n = c->side;
    double length = length_of(c, e);
    *negative = 0;
    if (m > 0 && m + n <= WIDEST)
        return reduce(c, e, sigma, negative);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            c->S[j * n + i] = entry(c, e, m + i, m + j);
    if (m == 0)
        return true;
    for (size_t j = 0; j < m; j++)
        for (size_t i = 0; i < m; i++)
            c->K[j * m + i] =
                entry(c, e, i, j) - (i == j ? sigma * length * c->mass[c->order[i] / c->dof] : 0);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < m; i++)
            c->C[j * m + i] = entry(c, e, i, m + j);
    if (phys_lapack_symmetric_factor(m, c->K, c->pivots, c->work) != 0)
        return false;
    *negative = phys_lapack_symmetric_inertia(m, m, c->K, c->pivots, &c->log_determinant);
    double *solved = c->C + n * m;
    for (size_t k = 0; k < n * m; k++)
        solved[k] = -c->C[k];
    phys_lapack_symmetric_solve(m, c->K, c->pivots, n, solved);
    ad_blas_gemm(AD_F64, false, true, n, n, m, solved, m, c->C, m, true, c->S, n);
    return true;
}

/* ---- the chain ---- */

/* A block of a condensed element: slices a and b, 0 or 1. */
static double block(const struct phys_inertia *c, const double *S, size_t a, size_t b, size_t i,
                    size_t j)
{
    return S[(b * c->dof + j) * c->side + a * c->dof + i];
}

static double dot(size_t n, const double *x, const double *y)
{
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t k = 0; k < n; k++)
        sum += x[k] * y[k];
    return sum;
}

/* Y = D^-1 B for the B of the element in c->S, by columns; X = B^T Y. D is factored. */
static void eliminate(struct phys_inertia *c)
{
    size_t n = c->dof;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            c->Y[j * n + i] = block(c, c->S, 0, 1, i, j);
    phys_lapack_symmetric_solve(n, c->D, c->pivots, n, c->Y);
    const double *B = c->S + n * c->side;
    for (size_t k = 0; n <= PHYS_SMALL && k < n * n; k++)
        c->X[k] = dot(n, c->Y + k / n * n, B + k % n * c->side);
    if (n > PHYS_SMALL)
        ad_blas_gemm(AD_F64, false, true, n, n, n, c->Y, n, B, c->side, false, c->X, n);
}

/* `more` points conjugate to the start between slices i and i + 1. */
static void note_conjugate(struct phys_inertia *c, size_t i, size_t more,
                           struct phys_spectrum *spectrum)
{
    double from = phys_hessian_slice_time(c->hessian, i);
    double half = 0.5 * (phys_hessian_slice_time(c->hessian, i + 1) - from);
    for (size_t *n = &spectrum->n_conjugate; more > 0 && !c->lost; more--)
        if (phys_grow(&spectrum->conjugate, *n, sizeof *spectrum->conjugate))
            spectrum->conjugate[(*n)++] = (struct phys_conjugate){from + half, half};
        else
            c->lost = true;
}

/* D of slice i, from the elements before and after it and the blocks eliminated so far. */
static bool next_block(struct phys_inertia *c, size_t i, double sigma)
{
    size_t n = c->dof;
    double mass = slice_mass(c, i);
    for (size_t b = 0; b < n; b++)
        for (size_t a = 0; a < n; a++)
            c->D[b * n + a] = block(c, c->before, 1, 1, a, b) + block(c, c->S, 0, 0, a, b) -
                              c->X[b * n + a] - (a == b ? sigma * mass : 0);
    return phys_lapack_symmetric_factor(n, c->D, c->pivots, c->work) == 0;
}

/* The slice eliminated last also leaves its share with the first one, where that moves, and couples
   it to the next. */
static void eliminate_first(struct phys_inertia *c)
{
    size_t n = c->dof;
    double *F = c->first, *solved = F + n * n, *next = solved + n * n;
    memcpy(solved, F, n * n * sizeof *F);
    phys_lapack_symmetric_solve(n, c->D, c->pivots, n, solved);
    for (size_t k = 0; k < n * n; k++) {
        c->W[k] -= dot(n, F + k % n * n, solved + k / n * n);
        next[k] = -dot(n, c->Y + k % n * n, F + k / n * n);
    }
    memcpy(F, next, n * n * sizeof *F);
}

/* What all slices between leave of the first and the last, in the directions that are free; the
   others get a positive block of their own, whatever sigma. */
static bool count_ends(struct phys_inertia *c, double sigma, size_t *more)
{
    size_t n = c->dof, side = c->side;
    double *E = c->ends, *unit = E + side * side;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            E[j * side + i] = c->W[j * n + i] - (i == j ? sigma * slice_mass(c, 0) : 0);
            E[j * side + n + i] = E[(n + i) * side + j] = c->first[j * n + i];
            E[(n + j) * side + n + i] = block(c, c->S, 1, 1, i, j) - c->X[j * n + i] -
                                        (i == j ? sigma * slice_mass(c, c->hessian->elements) : 0);
        }
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t j = 0; j < side; j++)
            phys_end_space_project(c->free, c->hessian->order, E + j * side);
        for (size_t j = 0; j < side; j++)
            for (size_t i = 0; i < j; i++) {
                double swap = E[j * side + i];
                E[j * side + i] = E[i * side + j];
                E[i * side + j] = swap;
            }
    }
    for (size_t j = 0; j < side; j++) {
        memset(unit, 0, side * sizeof *unit);
        unit[j] = 1;
        phys_end_space_project(c->free, c->hessian->order, unit);
        for (size_t i = 0; i < side; i++)
            E[j * side + i] += c->largest * ((i == j) - unit[i]);
    }
    if (phys_lapack_symmetric_factor(side, E, c->pivots, c->work) != 0)
        return false;
    *more = phys_lapack_symmetric_inertia(side, side, E, c->pivots, &c->log_determinant);
    return true;
}

/* Number of eigenvalues of the Hessian below sigma, in `total`, and conjugate points in a spectrum
   to keep those in. False: sigma is an eigenvalue of some part to the last bit. Any number where it
   is stopped. */
static bool eliminate_all(struct phys_inertia *c, double sigma, size_t *total,
                          struct phys_spectrum *spectrum)
{
    const struct phys_hessian *h = c->hessian;
    size_t n = c->dof, more = 0;
    c->log_determinant = 0;
    if (!condense(c, 0, sigma, total))
        return false;
    for (size_t k = 0; h->ends && k < n * n; k++) {
        c->W[k] = block(c, c->S, 0, 0, k % n, k / n);
        c->first[k] = block(c, c->S, 1, 0, k % n, k / n);
    }
    memset(c->X, 0, n * n * sizeof *c->X);
    if (spectrum)
        note_conjugate(c, 0, *total, spectrum);
    for (size_t i = 1; i < h->elements && !phys_hessian_stopped(c->hessian); i++) {
        double *swap = c->before;
        c->before = c->S;
        c->S = swap;
        if (!condense(c, i, sigma, &more) || !next_block(c, i, sigma))
            return false;
        more += phys_lapack_symmetric_inertia(n, n, c->D, c->pivots, &c->log_determinant);
        eliminate(c);
        if (h->ends)
            eliminate_first(c);
        if (spectrum)
            note_conjugate(c, i, more, spectrum);
        *total += more;
    }
    if (h->ends && !count_ends(c, sigma, &more))
        return false;
    *total += h->ends ? more : 0;
    return true;
}

/* ---- in order of places ---- */

enum { MANY = 1000 }; /* coordinates, of which a block of a slice takes long */

/* Whether a band that goes by place, then by node, is less work than blocks of slices. */
static bool is_wide(const struct phys_hessian *h)
{
    double nodes = (double)h->elements * (double)h->table.degree;
    return h->dof > MANY && !h->ends && (double)h->around * nodes < (double)h->dof / 2;
}

static double node_mass(const struct phys_inertia *c, size_t node)
{
    size_t degree = c->hessian->table.degree, e = node / degree;
    return node % degree ? length_of(c, e) * c->mass[node % degree] : slice_mass(c, e);
}

/* As eliminate_all, of all unknowns as one band; conjugate points are not known. */
static bool eliminate_places(struct phys_inertia *c, double sigma, size_t *total)
{
    const struct phys_hessian *h = c->hessian;
    size_t degree = h->table.degree, nodes = h->elements * degree - 1, first, end;
    size_t n = h->dof * nodes, width = h->reach * nodes + degree, rows = width + 1;
    bool memory = false, regular = true;
    *total = 0;
    double *band = calloc(n, rows * sizeof *band);
    for (size_t b = 0; band && b < h->elements * h->side; b++) {
        size_t e = b / h->side, node = b % h->side / h->dof, j = b % h->dof;
        size_t column = j * nodes + e * degree + node - 1;
        phys_hessian_coupled(h, j, &first, &end);
        for (size_t a = 0; a <= degree; a++)
            for (size_t i = first; i < end; i++) {
                size_t row = i * nodes + e * degree + a - 1, at = e * degree + a;
                if (row >= column && at > 0 && at <= nodes && e * degree + node > 0 &&
                    e * degree + node <= nodes)
                    band[column * rows + row - column] += phys_hessian_entry(h, e, a, i, node, j);
            }
    }
    for (size_t k = 0; band && k < n; k++)
        band[k * rows] -= sigma * node_mass(c, k % nodes + 1);
    if (band)
        regular = phys_band_inertia(n, width, band, total, &memory);
    c->lost = !memory;
    free(band);
    return regular || c->lost;
}

/* A pivot that is zero to the last bit is passed by a shift below rounding. */
size_t phys_inertia_below(struct phys_inertia *c, double sigma, struct phys_spectrum *spectrum)
{
    size_t total;
    if (spectrum)
        spectrum->unknown_conjugate = c->wide;
    while (!(c->wide ? eliminate_places(c, sigma, &total)
                     : eliminate_all(c, sigma, &total, spectrum))) {
        sigma -= DBL_EPSILON * c->scale;
        if (spectrum)
            spectrum->n_conjugate = 0;
    }
    return total;
}

/* ---- construction ---- */

static double largest_entry(const struct phys_hessian *h)
{
    double most = 0;
    for (size_t k = 0; k < phys_hessian_size(h); k++)
        most = fabs(h->element[k]) > most ? fabs(h->element[k]) : most;
    return most;
}

bool phys_inertia_new(struct phys_inertia *c, struct phys_hessian *h,
                      const struct phys_end_space *ends)
{
    size_t n = h->dof, m = (h->table.degree - 1) * n;
    *c = (struct phys_inertia){.hessian = h,
                               .free = ends,
                               .dof = n,
                               .inner = m,
                               .side = 2 * n,
                               .largest = largest_entry(h),
                               .wide = is_wide(h)};
    if (c->wide)
        return true;
    size_t larger = m > 2 * n ? m : 2 * n;
    c->K =
        malloc((m * m + 4 * n * m + 12 * n * n + 11 * n * n + 2 * n + 64 * larger) * sizeof *c->K);
    c->pivots = malloc(larger * sizeof *c->pivots);
    c->order = malloc((m + 2 * n) * sizeof *c->order);
    if (!c->K || !c->pivots || !c->order)
        return false;
    size_t nodes = h->table.degree - 1; /* by coordinate where L couples neighbours alone */
    for (size_t k = 0; k < m + 2 * n; k++)
        c->order[k] = k >= m + n      ? k
                      : k >= m        ? k - m
                      : h->width == n ? n + k
                                      : (1 + k % nodes) * n + k / nodes;
    c->C = c->K + m * m;
    c->S = c->C + 4 * n * m + 4 * n * n; /* behind a whole element */
    c->before = c->S + 4 * n * n;
    c->D = c->before + 4 * n * n;
    c->X = c->D + n * n;
    c->Y = c->X + n * n;
    c->W = c->Y + n * n;
    c->first = c->W + n * n;
    c->ends = c->first + 3 * n * n;
    c->work = c->ends + 4 * n * n + 2 * n;
    return true;
}

void phys_inertia_free(struct phys_inertia *c) { AD_FREE(c->K, c->pivots, c->order); }

void phys_inertia_masses(struct phys_inertia *c, bool integral)
{
    const struct phys_rule_table *table = &c->hessian->table;
    double least = (double)INFINITY, shortest = (double)INFINITY;
    c->integral = integral;
    for (size_t e = 0; e < c->hessian->elements; e++)
        shortest = fmin(shortest, length_of(c, e));
    memset(c->mass, 0, sizeof c->mass);
    for (size_t k = 0; k <= table->degree; k++)
        for (size_t j = 0; j < table->points; j++)
            c->mass[k % table->degree] += c->hessian->dt * table->weight[j] * table->q[j][k];
    for (size_t k = 0; k < table->degree; k++) {
        c->mass[k] = integral ? c->mass[k] : 1;
        least = fmin(least, c->mass[k]);
    }
    c->scale = c->largest / (least * shortest);
}
