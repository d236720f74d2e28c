/* Morse index, conjugate points and smallest eigenvalue of the action's Hessian, by elimination in
   order of time (Sylvester's law of inertia). Eliminating the inner nodes of each element leaves a
   block tridiagonal matrix over the slices with blocks A_i and couplings B_i; then
       D_1 = A_1,   D_i+1 = A_i+1 - B_i^T D_i^-1 B_i,
   and the number of negative eigenvalues of the Hessian is that of all D_i and inner blocks
   together. The count up to D_i is the index of the path up to slice i + 1: where it increases
   there is a point conjugate to the start (Morse; Gelfand, Fomin, Calculus of Variations, section
   29). */
#include "spectrum.h"
#include "autodiff/free.h"
#include "autodiff/blas.h"
#include "physics/io/grow.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double BEYOND = 1e6;  /* times the largest entry: not in the spectrum */
static const double ROUNDING = 16; /* of an eigenvalue, in units of the largest */
enum { SLOW = 3 };                 /* steps that leave more than half */
static const double ROUGH = 0.01;  /* relative error of eigenvalues that are not reported */

struct chain {
    struct phys_hessian *hessian;
    size_t dof, inner, side; /* side: 2 dof of a condensed element, slice before and slice behind */
    double *K;               /* [inner][inner] inner block */
    double *C;               /* [2 dof][inner] coupling of inner nodes to slices, and solved */
    double *S, *before;      /* [2 dof][2 dof] condensed elements */
    double *D, *X, *Y;       /* [dof][dof] */
    double *work;
    int *pivots;
    size_t *order; /* [inner + side] place in an element of inner nodes, slice before, behind */
    double mass[PHYS_RULE_MOST]; /* of a slice and of each inner node: sigma counts times it ... */
    bool integral;               /* ... and the length of the element in units of dt */
    double largest;              /* entry of any element ... */
    double scale;                /* ... and of the spectrum */
    double log_determinant;      /* of H - sigma, of the last sigma, unless it was left early */
    bool lost;                   /* out of memory for conjugate points */
};

/* ---- elements ---- */

/* Entry of an element's matrix in the order inner nodes, slice before, slice behind. */
static double entry(const struct chain *c, size_t e, size_t i, size_t j)
{
    const struct phys_hessian *h = c->hessian;
    return h->element[(e * h->side + c->order[j]) * h->side + c->order[i]];
}

/* Of the mass of its inner nodes, and of half that of its slices. */
static double length_of(const struct chain *c, size_t e)
{
    return c->integral ? phys_hessian_length(c->hessian, e) : 1;
}

/* Of a slice, which ends one element and begins another. */
static double slice_mass(const struct chain *c, size_t i)
{
    double before = i > 0 ? length_of(c, i - 1) : 0;
    double after = i < c->hessian->elements ? length_of(c, i) : 0;
    return c->integral ? 0.5 * c->mass[0] * (before + after) : 1;
}

/* What is given at an end where coordinates move gets, in the condensed element e there, a positive
   block of its own, beyond the spectrum. */
static void hold_given(struct chain *c, size_t e)
{
    size_t n = c->side;
    for (size_t k = 0; k < n; k++) {
        size_t end = k / c->dof;
        const bool *free = c->hessian->free[end];
        if (!free || free[k % c->dof] || e != end * (c->hessian->elements - 1))
            continue;
        for (size_t j = 0; j < n; j++)
            c->S[j * n + k] = c->S[k * n + j] = j == k ? BEYOND * c->largest : 0;
    }
}

/* Puts the element without its inner nodes, shifted by -sigma there, into c->S. False: sigma is an
   eigenvalue of the inner block to the last bit; else `negative` of them are below it. */
static bool condense(struct chain *c, size_t e, double sigma, size_t *negative)
{
    size_t m = c->inner, n = c->side;
    double length = length_of(c, e);
    *negative = 0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            c->S[j * n + i] = entry(c, e, m + i, m + j);
    if (m == 0) {
        hold_given(c, e);
        return true;
    }
    for (size_t j = 0; j < m; j++)
        for (size_t i = 0; i < m; i++)
            c->K[j * m + i] =
                entry(c, e, i, j) - (i == j ? sigma * length * c->mass[1 + i / c->dof] : 0);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < m; i++)
            c->C[j * m + i] = entry(c, e, i, m + j);
    if (phys_lapack_symmetric_factor(m, c->K, c->pivots, c->work) != 0)
        return false;
    *negative = phys_lapack_symmetric_inertia(m, c->K, c->pivots, &c->log_determinant);
    double *solved = c->C + n * m;
    for (size_t k = 0; k < n * m; k++)
        solved[k] = -c->C[k];
    phys_lapack_symmetric_solve(m, c->K, c->pivots, n, solved);
    ad_blas_gemm(AD_F64, false, true, n, n, m, solved, m, c->C, m, true, c->S, n);
    hold_given(c, e);
    return true;
}

/* ---- the chain ---- */

/* A block of a condensed element: slices a and b, 0 or 1. */
static double block(const struct chain *c, const double *S, size_t a, size_t b, size_t i, size_t j)
{
    return S[(b * c->dof + j) * c->side + a * c->dof + i];
}

/* Y = D^-1 B for the B of the element in c->S, by columns; X = B^T Y. D is factored. */
static void eliminate(struct chain *c)
{
    size_t n = c->dof;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            c->Y[j * n + i] = block(c, c->S, 0, 1, i, j);
    phys_lapack_symmetric_solve(n, c->D, c->pivots, n, c->Y);
    ad_blas_gemm(AD_F64, false, true, n, n, n, c->Y, n, c->S + n * c->side, c->side, false, c->X,
                 n);
}

/* `more` points conjugate to the start between slices i and i + 1. */
static void note_conjugate(struct chain *c, size_t i, size_t more, struct phys_spectrum *spectrum)
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
static bool next_block(struct chain *c, size_t i, double sigma)
{
    size_t n = c->dof, last = c->hessian->elements;
    double mass = slice_mass(c, i);
    for (size_t b = 0; b < n; b++)
        for (size_t a = 0; a < n; a++)
            c->D[b * n + a] = (i > 0 ? block(c, c->before, 1, 1, a, b) : 0) +
                              (i < last ? block(c, c->S, 0, 0, a, b) : 0) - c->X[b * n + a] -
                              (a == b ? sigma * mass : 0);
    return phys_lapack_symmetric_factor(n, c->D, c->pivots, c->work) == 0;
}

/* Number of eigenvalues of the Hessian below sigma, in `total`, and conjugate points; without a
   spectrum to keep those in it is enough to know whether there are more than `enough`. False: sigma
   is an eigenvalue of some part to the last bit. Any number where it is stopped. */
static bool eliminate_all(struct chain *c, double sigma, size_t enough, size_t *total,
                          struct phys_spectrum *spectrum)
{
    const struct phys_hessian *h = c->hessian;
    size_t more = 0, first = h->free[0] ? 0 : 1, end = h->elements + (h->free[1] ? 1 : 0);
    c->log_determinant = 0;
    if (!condense(c, 0, sigma, total))
        return false;
    memset(c->X, 0, c->dof * c->dof * sizeof *c->X);
    if (spectrum)
        note_conjugate(c, 0, *total, spectrum);
    for (size_t i = first; i < end && !phys_hessian_stopped(c->hessian); i++) {
        if (i > 0) {
            double *swap = c->before;
            c->before = c->S;
            c->S = swap;
        }
        more = 0;
        if ((i > 0 && i < h->elements && !condense(c, i, sigma, &more)) || !next_block(c, i, sigma))
            return false;
        more += phys_lapack_symmetric_inertia(c->dof, c->D, c->pivots, &c->log_determinant);
        if (i < h->elements)
            eliminate(c);
        if (spectrum)
            note_conjugate(c, i, more, spectrum);
        *total += more;
        if (!spectrum && *total > enough)
            break;
    }
    return true;
}

/* A pivot that is zero to the last bit is passed by a shift below rounding. */
static size_t count_below(struct chain *c, double sigma, size_t enough,
                          struct phys_spectrum *spectrum)
{
    size_t total;
    while (!eliminate_all(c, sigma, enough, &total, spectrum)) {
        sigma -= DBL_EPSILON * c->scale;
        if (spectrum)
            spectrum->n_conjugate = 0;
    }
    return total;
}

/* ---- public functions ---- */

static const struct phys_spectrum unknown = {
    .smallest = (double)NAN, .second_variation = (double)NAN, .around = {(double)NAN, (double)NAN}};

void phys_hessian_settings(struct phys_hessian *h, const struct phys_path_settings *settings)
{
    h->mesh = settings->mesh;
    for (size_t end = 0; settings->ends && end < 2; end++)
        h->free[end] = settings->ends->free[end];
}

static double largest_entry(const struct phys_hessian *h)
{
    double most = 0;
    for (size_t k = 0; k < h->elements * h->side * h->side; k++)
        most = fmax(most, fabs(h->element[k]));
    return most;
}

static bool chain_new(struct chain *c, struct phys_hessian *h)
{
    size_t n = h->dof, m = (h->table.degree - 1) * n;
    *c = (struct chain){.hessian = h, .dof = n, .inner = m, .side = 2 * n};
    size_t larger = m > n ? m : n;
    c->K = malloc((m * m + 4 * n * m + 8 * n * n + 3 * n * n + 64 * larger) * sizeof *c->K);
    c->pivots = malloc(larger * sizeof *c->pivots);
    c->order = malloc((m + 2 * n) * sizeof *c->order);
    if (!c->K || !c->pivots || !c->order)
        return false;
    for (size_t k = 0; k < m + 2 * n; k++)
        c->order[k] = k < m ? n + k : k < m + n ? k - m : k;
    c->C = c->K + m * m;
    c->S = c->C + 4 * n * m;
    c->before = c->S + 4 * n * n;
    c->D = c->before + 4 * n * n;
    c->X = c->D + n * n;
    c->Y = c->X + n * n;
    c->work = c->Y + n * n;
    c->largest = largest_entry(h);
    return true;
}

static void chain_free(struct chain *c) { AD_FREE(c->K, c->pivots, c->order); }

/* Masses that are 1 give the eigenvalues of the Hessian. Those of the second variation are measured
   against the integral of x^2: node k has the mass of an element's length times the integral of its
   polynomial, which the points of a rule give exactly, and a slice that of both its elements. */
static void set_masses(struct chain *c, bool integral)
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

/* A shift, the number of eigenvalues below it, and log |det(H - shift)|. */
struct shift {
    double at, log;
    size_t below;
};

/* Whether the shift is above eigenvalue k. */
static bool is_above(struct chain *c, size_t k, struct shift *shift)
{
    shift->below = count_below(c, shift->at, SIZE_MAX, NULL);
    shift->log = c->log_determinant;
    return shift->below > k;
}

/* A shift between both, not nearer to either than half of `least`: by their order of size, else by
   the determinant where that changes its sign once between them. */
static double between(const struct shift *low, const struct shift *high, double least)
{
    double width = high->at - low->at, near = fmin(fabs(low->at), fabs(high->at));
    double far = fmax(fabs(low->at), fabs(high->at)), share = 0.5;
    if (far > 4 * fmax(near, least) && low->at * high->at >= 0)
        return (high->at > 0 ? 1 : -1) * sqrt(fmax(near, least) * far);
    if (high->below == low->below + 1)
        share = 1 / (1 + exp(high->log - low->log));
    return low->at + fmax(least / 2, fmin(width - least / 2, share * width));
}

/* Eigenvalue k, ascending from 0, to rounding or a relative error: shifts on either side of it are
   brought together by the secant method (Illinois), or by halves where that is slow. INFINITY:
   there are fewer. */
static double eigenvalue(struct chain *c, size_t k, double relative)
{
    struct shift end[2] = {{0}}, next = {0};
    bool side = is_above(c, k, &next), above = side;
    for (; above == side && !c->hessian->stopped; above = is_above(c, k, &next)) {
        end[side] = next;
        next.at = next.at == 0 ? (side ? -c->scale : c->scale) : 2 * next.at;
        if (next.at > BEYOND * c->scale)
            return (double)INFINITY;
    }
    end[!side] = next;
    for (size_t slow = 0; !c->hessian->stopped;) {
        double near = fmin(fabs(end[0].at), fabs(end[1].at)), width = end[1].at - end[0].at;
        double least = fmax(4 * DBL_EPSILON * c->scale, relative * near);
        if (width <= least)
            break;
        next.at = slow < SLOW ? between(&end[0], &end[1], least) : end[0].at + 0.5 * width;
        bool before = above;
        above = is_above(c, k, &next);
        end[above] = next;
        if (above == before)
            end[!above].log -= M_LN2;
        slow = slow < SLOW && end[1].at - end[0].at > 0.5 * width ? slow + 1 : 0;
    }
    return 0.5 * (end[0].at + end[1].at);
}

enum { CHEAP = 40 }; /* dof * degree up to which sixty eliminations are cheap */

/* The Hessian of -S. */
static void negate(struct phys_hessian *h)
{
    for (size_t k = 0; k < h->elements * h->side * h->side; k++)
        h->element[k] = -h->element[k];
}

static void count_directions(struct chain *c, struct phys_spectrum *spectrum)
{
    ad_blas_single_thread();
    set_masses(c, false);
    spectrum->index = count_below(c, 0, SIZE_MAX, spectrum);
    if (c->hessian->free[0] || c->hessian->free[1])
        spectrum->n_conjugate = 0; /* they are of other fields: the end's own curvature counts */
    if (c->dof * c->hessian->table.degree <= CHEAP && c->largest > 0) {
        size_t k = spectrum->index;
        double *around = spectrum->around;
        spectrum->smallest = eigenvalue(c, 0, 0);
        set_masses(c, true);
        spectrum->second_variation = eigenvalue(c, 0, 0);
        around[0] = k > 1 ? eigenvalue(c, k - 1, ROUGH) : k ? spectrum->second_variation : NAN;
        around[1] = k ? eigenvalue(c, k, ROUGH) : spectrum->second_variation;
        spectrum->undetermined =
            fmin(fabs(around[0]), fabs(around[1])) <= ROUNDING * DBL_EPSILON * c->scale;
    }
    ad_blas_threads();
}

static enum ad_status examine(struct phys_hessian *h, struct chain *c, const double *path,
                              struct phys_spectrum *spectrum, struct ad_error *error)
{
    phys_hessian_at(h, path, 0);
    if (h->stopped)
        return ad_fail(error, AD_E_ACCURACY, "interrupted");
    spectrum->legendre = phys_hessian_definite(h, &spectrum->not_definite);
    if (spectrum->legendre == PHYS_NEGATIVE)
        negate(h);
    if (!chain_new(c, h))
        return ad_fail(error, AD_E_MEMORY, "out of memory for the inertia");
    if (!isfinite(c->largest))
        return ad_fail(error, AD_E_NONFINITE, "second derivatives of the action are not finite");
    if (spectrum->legendre != PHYS_INDEFINITE)
        count_directions(c, spectrum);
    if (c->lost)
        return ad_fail(error, AD_E_MEMORY, "out of memory for conjugate points");
    return h->stopped ? ad_fail(error, AD_E_ACCURACY, "interrupted") : AD_OK;
}

enum ad_status phys_hessian_spectrum(struct phys_hessian *h, const double *path,
                                     struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct chain c = {0};
    *spectrum = unknown;
    if (phys_hessian_keep_mass(h))
        examine(h, &c, path, spectrum, error);
    else
        ad_fail(error, AD_E_MEMORY, "out of memory for the mass matrices");
    chain_free(&c);
    free(h->mass);
    h->mass = NULL;
    return error->status;
}

bool phys_hessian_confirms(struct phys_hessian *h, const double *path,
                           const struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct chain c = {0};
    bool same = true;
    phys_hessian_at(h, path, 0);
    if (spectrum->legendre == PHYS_NEGATIVE)
        negate(h);
    if (!chain_new(&c, h)) {
        ad_fail(error, AD_E_MEMORY, "out of memory for the inertia");
    } else if (!isfinite(c.largest)) {
        same = false;
    } else {
        ad_blas_single_thread();
        set_masses(&c, true);
        for (size_t k = 0; same && k < 2 && !h->stopped; k++) {
            double sigma = isfinite(spectrum->around[k]) ? 0.5 * spectrum->around[k] : 0;
            same = count_below(&c, sigma, SIZE_MAX, NULL) == spectrum->index;
        }
        ad_blas_threads();
    }
    chain_free(&c);
    if (h->stopped)
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    return same;
}

enum ad_status phys_path_spectrum(const struct phys_system *system,
                                  const struct phys_path_settings *settings, const double *path,
                                  struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct phys_hessian h = {0};
    if (AD_LACKS(error, spectrum))
        return error->status;
    *spectrum = unknown;
    if (AD_LACKS(error, system, system->scene, settings, settings->rule, path))
        return error->status;
    if (phys_hessian_new(&h, system, settings->rule, settings->slices, settings->dt, NULL, error) ==
        AD_OK) {
        h.proceed = settings->proceed;
        h.context = settings->context;
        phys_hessian_settings(&h, settings);
        phys_hessian_spectrum(&h, path, spectrum, error);
    }
    phys_hessian_free(&h);
    return error->status;
}

void phys_spectrum_free(struct phys_spectrum *spectrum)
{
    if (!spectrum)
        return;
    free(spectrum->conjugate);
    *spectrum = (struct phys_spectrum){0};
}
