/* Newton and Levenberg steps by banded LU (newton_system.h), by blocks, or by fronts.

   Levenberg's step for |g|^2 solves (H^2 + m^2) x = -H g. H^2 has twice the bandwidth and the
   square of the condition number, but for symmetric H (H^2 + m^2)^-1 H = Re (H - i m)^-1, so one
   complex elimination of H - i m gives it. D scales each coordinate by its kinetic stiffness, so
   that a sun weighs no more than a planet. */
#include "newton_system.h"
#include "autodiff/free.h"
#include "autodiff/blas.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum ad_status phys_newton_system_new(struct phys_newton_system *band, struct phys_hessian *hessian,
                                      size_t hold, struct ad_error *error)
{
    size_t degree = hessian->table.degree, dof = hessian->dof;
    size_t last = (hessian->elements + 1 - hold) * degree; /* first node held at the end */
    *band = (struct phys_newton_system){.hessian = hessian, .hold = hold};
    band->first = ((hold - 1) * degree + 1) * dof;
    band->n = last * dof - band->first;
    band->free = hessian->ends;
    band->folded = band->free && hessian->ends->n_relations > 0;
    if (phys_end_space_new(&band->ends, hessian->ends, dof, error) != AD_OK)
        return error->status;
    if (band->free) { /* all nodes, of which held() are left out */
        band->first = 0;
        band->n = (hessian->elements * degree + 1) * dof;
    }
    band->right = malloc(3 * band->n * sizeof *band->right);
    band->pivots = malloc(band->n * sizeof *band->pivots);
    band->scale = malloc(dof * sizeof *band->scale);
    band->free_part = malloc((band->folded ? 2 * dof + 1 : 1) * 2 * dof * sizeof(double));
    if (!band->right || !band->pivots || !band->scale || !band->free_part)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu unknowns", band->n);
    return AD_OK;
}

void phys_newton_system_free(struct phys_newton_system *band)
{
    AD_FREE(band->matrix, band->right, band->pivots, band->scale, band->free_part, band->held);
    phys_end_space_free(&band->ends);
    phys_block_tridiagonal_free(&band->blocks);
    phys_reduced_free(&band->reduced);
    phys_dissected_free(&band->dissected);
}

/* ---- unknowns ---- */

/* Where unknown u lies in a path [degree*dof x slices]. */
static size_t place(const struct phys_newton_system *band, size_t u)
{
    const struct phys_hessian *h = band->hessian;
    size_t degree = h->table.degree, node = (band->first + u) / h->dof,
           d = h->order[(band->first + u) % h->dof];
    return (node % degree * h->dof + d) * (h->elements + 1) + node / degree;
}

/* Whether unknown u is one of an end where coordinates move; then also which of them, [2 dof]. */
static bool at_end(const struct phys_newton_system *band, size_t u, size_t *k)
{
    size_t dof = band->hessian->dof;
    *k = u < dof ? u : 2 * dof + u - band->n;
    return band->free && (u < dof || u + dof >= band->n);
}

/* The unknown that is coordinate k, [2 dof], of the ends. */
static size_t end_unknown(const struct phys_newton_system *band, size_t k)
{
    return k < band->hessian->dof ? k : band->n - 2 * band->hessian->dof + k;
}

/* Whether it is one of an end that is given. */
static bool held(const struct phys_newton_system *band, size_t u)
{
    const struct phys_hessian *h = band->hessian;
    size_t k;
    return at_end(band, u, &k) && !phys_end_moves(h->ends, u >= h->dof, h->order[u % h->dof]);
}

/* Of x [n] the part that may move. */
static void project(const struct phys_newton_system *band, double *x)
{
    const size_t dof = band->hessian->dof;
    double *ends = band->free_part + (band->folded ? 4 * dof * dof : 0);
    if (!band->free)
        return;
    memcpy(ends, x, dof * sizeof *x);
    memcpy(ends + dof, x + band->n - dof, dof * sizeof *x);
    phys_end_space_project(&band->ends, band->hessian->order, ends);
    memcpy(x, ends, dof * sizeof *x);
    memcpy(x + band->n - dof, ends + dof, dof * sizeof *x);
}

static double scale(const struct phys_newton_system *band, size_t u)
{
    return band->scale[(band->first + u) % band->hessian->dof];
}

void phys_newton_system_scale(struct phys_newton_system *band)
{
    for (size_t k = 0; k < band->hessian->dof; k++) {
        double s = band->hessian->stiffness[band->hessian->order[k]];
        band->scale[k] = s > 0 ? 1 / sqrt(s) : 1;
    }
    phys_end_space_scale(&band->ends, band->hessian->order, band->scale);
    size_t n = 2 * band->hessian->dof;
    for (size_t k = 0; band->folded && k < n; k++) {
        double *column = memset(band->free_part + k * n, 0, n * sizeof *column);
        column[k] = 1;
        phys_end_space_project(&band->ends, band->hessian->order, column);
    }
}

/* ---- solving ---- */

/* Takes what needs the fewest operations: one band, node by node or, for chains of many
   coordinates, by coordinate; or blocks. A damped band is complex. */
static void choose_band(struct phys_newton_system *band)
{
    const struct phys_hessian *h = band->hessian;
    size_t by_node = (h->table.degree + 1) * h->dof - 1;
    size_t by_coordinate = h->reach * (band->n / h->dof) + h->table.degree;
    band->by_coordinate = by_coordinate < by_node && !band->folded;
    band->width = band->folded          ? (2 * h->table.degree + 2) * h->dof - 1
                  : band->by_coordinate ? by_coordinate
                                        : by_node;
    double width = (double)band->width, blocks = phys_block_tridiagonal_cost(h);
    band->operations = (band->damping > 0 ? 8 : 2) * (double)band->n * width * width;
    band->by_blocks =
        !band->free && ((band->damping > 0 && !band->by_coordinate) || blocks < band->operations);
    band->operations = band->by_blocks ? blocks : band->operations;
}

/* Small blocks, and their sums, take longer than products of as many operations ... */
static const double SLOWER = 1.5;
static const double WORTH = 3e7; /* ... which are to be so many before they are counted */

static bool make_fronts(struct phys_newton_system *band)
{
    if (band->dissected.hessian || band->no_fronts)
        return !band->no_fronts;
    band->held = band->free ? malloc(band->n * sizeof *band->held) : NULL;
    band->no_fronts = (band->free && !band->held) ||
                      !phys_dissected_new(&band->dissected, band->hessian, band->first, band->n);
    for (size_t u = 0; band->held && u < band->n; u++)
        band->held[u] = held(band, u);
    return !band->no_fronts;
}

static void choose_order(struct phys_newton_system *band)
{
    choose_band(band);
    band->by_fronts =
        !band->folded && band->operations > WORTH &&
        phys_dissected_serves(band->hessian, band->n) && make_fronts(band) &&
        SLOWER * (band->damping > 0 ? 4 : 1) * band->dissected.fronts.operations < band->operations;
}

double phys_newton_system_bytes(struct phys_newton_system *band)
{
    struct phys_hessian *h = band->hessian;
    const size_t reach = h->reach;
    h->reach = h->around;
    band->damping = 1;
    choose_order(band);
    const double blocks = phys_block_tridiagonal_bytes(h);
    h->reach = reach;
    return band->by_fronts ? phys_dissected_bytes(&band->dissected, 2)
           : band->by_blocks
               ? blocks
               : 2 * sizeof(double) * (double)PHYS_BAND_ROWS(band->width) * (double)band->n;
}

/* Of numbers of 1 or 2 parts. */
static bool make_room(struct phys_newton_system *band, size_t parts)
{
    size_t rows = PHYS_BAND_ROWS(band->width);
    if (band->n > INT_MAX / rows) /* LAPACK counts in int */
        return false;
    if (parts * rows * band->n > band->room) {
        free(band->matrix);
        band->matrix = malloc(parts * rows * band->n * sizeof *band->matrix);
        band->room = band->matrix ? parts * rows * band->n : 0;
    }
    band->no_memory = !band->matrix;
    return band->matrix != NULL;
}

/* Row of unknown u in the matrix. */
static size_t row_of(const struct phys_newton_system *band, size_t u)
{
    size_t dof = band->hessian->dof, nodes = band->n / dof, node = u / dof;
    if (band->folded)
        return (node < (nodes + 1) / 2 ? 2 * node : 2 * (nodes - node) - 1) * dof + u % dof;
    return band->by_coordinate ? u % dof * nodes + node : u;
}

static double *entry_of(struct phys_newton_system *band, size_t parts, size_t row, size_t col)
{
    return &band->matrix[parts * PHYS_BAND(band->width, row_of(band, row), row_of(band, col))];
}

/* Adds an entry of unknowns, of which at least one is at an end, to their projections. */
static void add_projected(struct phys_newton_system *band, size_t parts, size_t row, size_t col,
                          double x)
{
    const size_t n = 2 * band->hessian->dof;
    const double *P = band->free_part;
    size_t i, j;
    const bool spreads[2] = {at_end(band, row, &i), at_end(band, col, &j)};
    for (size_t a = 0; a < (spreads[0] ? n : 1); a++)
        for (size_t b = 0; b < (spreads[1] ? n : 1); b++) {
            double share = (spreads[0] ? P[i * n + a] : 1) * (spreads[1] ? P[j * n + b] : 1);
            if (share != 0)
                *entry_of(band, parts, spreads[0] ? end_unknown(band, a) : row,
                          spreads[1] ? end_unknown(band, b) : col) += share * x;
        }
}

/* 1 at the ends in the directions that are held. */
static void hold_ends(struct phys_newton_system *band, size_t parts)
{
    const size_t n = band->free ? 2 * band->hessian->dof : 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            if (band->folded || (i == j && held(band, end_unknown(band, i))))
                *entry_of(band, parts, end_unknown(band, i), end_unknown(band, j)) +=
                    (i == j) - (band->folded ? band->free_part[i * n + j] : 0);
}

/* D^-1 H D^-1 over the unknowns; of two parts, less i damping. */
static void fill(struct phys_newton_system *band, size_t parts)
{
    const struct phys_hessian *h = band->hessian;
    size_t stride = h->table.degree * h->dof;
    memset(band->matrix, 0, parts * PHYS_BAND_ROWS(band->width) * band->n * sizeof *band->matrix);
    for (size_t e = 0; e < h->elements; e++)
        for (size_t b = 0; b < h->side; b++) {
            size_t col = e * stride + b - band->first;
            if (col >= band->n || held(band, col)) /* below the first it has wrapped around */
                continue;
            double factor = band->scale[b % h->dof], entry;
            size_t to = row_of(band, col), first, end, k, j = b % h->dof;
            phys_hessian_coupled(h, j, &first, &end);
            for (size_t node = 0; node <= h->table.degree; node++)
                for (size_t i = first; i < end; i++) {
                    size_t row = e * stride + node * h->dof + i - band->first;
                    entry = phys_hessian_entry(h, e, node, i, b / h->dof, j);
                    entry *= factor * band->scale[i];
                    if (row >= band->n || entry == 0 || held(band, row))
                        continue;
                    if (band->folded && (at_end(band, row, &k) || at_end(band, col, &k)))
                        add_projected(band, parts, row, col, entry);
                    else
                        band->matrix[parts * PHYS_BAND(band->width, row_of(band, row), to)] +=
                            entry;
                }
        }
    for (size_t u = 0; parts == 2 && u < band->n; u++)
        band->matrix[2 * PHYS_BAND(band->width, u, u) + 1] = -band->damping;
    hold_ends(band, parts);
}

static bool factor_band(struct phys_newton_system *band)
{
    size_t parts = band->damping > 0 ? 2 : 1;
    if (!make_room(band, parts))
        return false;
    fill(band, parts);
    return (parts == 1 ? phys_lapack_band_factor : phys_lapack_band_factor_complex)(
               band->n, band->width, band->matrix, band->pivots) == 0;
}

static bool factor_blocks(struct phys_newton_system *band)
{
    if (band->blocks.reach != band->hessian->reach)
        phys_block_tridiagonal_free(&band->blocks);
    if (!band->blocks.slice &&
        !phys_block_tridiagonal_new(&band->blocks, band->hessian, band->hold, band->scale)) {
        band->no_memory = true;
        return false;
    }
    return phys_block_tridiagonal_factor(&band->blocks, band->damping);
}

static bool factor_fronts(struct phys_newton_system *band)
{
    bool no_memory;
    if (phys_dissected_factor(&band->dissected, band->scale, band->damping, band->held, &no_memory))
        return true;
    if (no_memory) { /* others may need less */
        phys_dissected_free(&band->dissected);
        band->no_fronts = true;
    }
    return false;
}

/* Whether elements that are reduced serve for steps with the present damping. */
static bool factor_elements(struct phys_newton_system *band)
{
    return band->damping == 0 && !band->folded && phys_reduced_serves(band->hessian) &&
           (band->reduced.element ||
            phys_reduced_new(&band->reduced, band->hessian, band->hold, band->scale)) &&
           phys_reduced_factor(&band->reduced);
}

bool phys_newton_system_factor(struct phys_newton_system *band, double damping)
{
    band->damping = damping;
    band->by_blocks = band->by_fronts = false;
    ad_blas_single_thread(); /* blocks are too small to share */
    bool factored = band->by_elements = factor_elements(band);
    if (!factored) {
        choose_order(band);
        factored = band->by_fronts = band->by_fronts && factor_fronts(band);
    }
    if (!factored)
        factored = band->by_blocks ? factor_blocks(band) : factor_band(band);
    ad_blas_threads();
    return factored;
}

static void solve_band(struct phys_newton_system *band, size_t parts)
{
    double *x = band->right + band->n;
    memset(x, 0, parts * band->n * sizeof *x);
    for (size_t u = 0; u < band->n; u++)
        x[parts * row_of(band, u)] = band->right[u];
    if (parts == 1)
        phys_lapack_band_solve(band->n, band->width, band->matrix, band->pivots, x);
    else
        phys_lapack_band_solve_complex(band->n, band->width, band->matrix, band->pivots, x);
    for (size_t u = 0; u < band->n; u++)
        band->right[u] = x[parts * row_of(band, u)];
}

void phys_newton_system_step(struct phys_newton_system *band, const double *gradient, double *step)
{
    const struct phys_hessian *h = band->hessian;
    memset(step, 0, h->table.degree * h->dof * (h->elements + 1) * sizeof *step);
    for (size_t u = 0; u < band->n; u++)
        band->right[u] = -gradient[place(band, u)] * scale(band, u);
    project(band, band->right);
    ad_blas_single_thread();
    if (band->by_elements)
        phys_reduced_solve(&band->reduced, band->right);
    else if (band->by_fronts)
        phys_dissected_solve(&band->dissected, band->scale, band->held, band->right,
                             band->right + band->n);
    else if (band->by_blocks)
        phys_block_tridiagonal_solve(&band->blocks, band->right);
    else
        solve_band(band, band->damping > 0 ? 2 : 1);
    ad_blas_threads();
    project(band, band->right);
    for (size_t u = 0; u < band->n; u++)
        step[place(band, u)] = band->right[u] * scale(band, u);
}

/* ---- measuring ---- */

double phys_newton_system_norm(const struct phys_newton_system *band, const double *x)
{
    double sum = 0;
    for (size_t u = 0; u < band->n; u++)
        band->right[u] = x[place(band, u)] * scale(band, u);
    project(band, band->right);
    for (size_t u = 0; u < band->n; u++)
        sum += band->right[u] * band->right[u];
    return sqrt(sum);
}

double phys_newton_system_rounding(const struct phys_newton_system *band, const double *path)
{
    const struct phys_hessian *h = band->hessian;
    const size_t degree = h->table.degree, dof = h->dof, slices = h->elements + 1;
    double sum = 0;
    memset(band->right, 0, band->n * sizeof *band->right);
    for (size_t e = 0; e < h->elements; e++)
        for (size_t b = 0; b < h->side; b++) {
            size_t node = e * degree + b / dof, j = b % dof, first, end;
            const double x =
                fabs(path[(node % degree * dof + h->order[j]) * slices + node / degree]);
            phys_hessian_coupled(h, j, &first, &end);
            for (size_t a = 0; a <= degree; a++) {
                const size_t row = (e * degree + a) * dof - band->first; /* wraps around if held */
                const double *entry = h->element + phys_hessian_place(h, e, a, first, b / dof, j);
                for (size_t i = first; row < band->n && i < end; i++)
                    band->right[row + i] += x * fabs(entry[i - first]);
            }
        }
    for (size_t u = 0; u < band->n; u++)
        sum += held(band, u) ? 0 : pow(band->right[u] * scale(band, u), 2);
    return DBL_EPSILON * sqrt(sum);
}
