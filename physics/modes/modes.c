/* Small oscillations about an equilibrium: eigenvalues of s^2 M + s G + K, with what their digits
   are known to. */
#include "physics/linear/vectors.h"
#include "internal.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DIRECTIONS = 2 };

static const double defective = 1e-6; /* eigenvalues closer to 0 may be pairs that have merged */

/* M, G and K in units of the sizes of the coordinates, time in units of `unit`. */
struct matrices {
    double *M, *G, *K; /* [n x n] */
};

struct problem {
    size_t n;
    const double *size, *off; /* of coordinates, and how far the place is off, in sizes */
    double unit;
    struct matrices at, changed[DIRECTIONS]; /* there, and what a nudge of the place changes */
    double *room;
    /* Of K x = value M x, ascending: with vectors in rows, of x M x = 1. */
    double *value, *vector;
    bool positive; /* M is */
    bool turning;  /* G is not zero */
};

static bool evaluate(struct problem *p, struct phys_curvature *c, const double *q,
                     struct matrices *into)
{
    const size_t n = p->n;
    if (!phys_curvature_at(c, q, p->room, 0)) /* at rest */
        return false;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const double scale = p->size[i] * p->size[j];
            into->M[i * n + j] = scale * 0.5 * (c->vv[i * n + j] + c->vv[j * n + i]);
            into->K[i * n + j] = -scale * 0.5 * (c->qq[i * n + j] + c->qq[j * n + i]);
            into->G[i * n + j] = scale * (c->qv[j * n + i] - c->qv[i * n + j]);
        }
    return true;
}

static bool begin(struct problem *p, struct phys_curvature *c, const double *size,
                  const double *off)
{
    const size_t n = c->system->dof, square = n * n;
    *p = (struct problem){.n = n, .size = size, .off = off, .unit = 1};
    p->room = calloc(n + (3 * (1 + DIRECTIONS) + 1) * square + n, sizeof *p->room);
    if (!p->room)
        return false;
    double *next = p->room + n;
    for (size_t k = 0; k <= DIRECTIONS; k++) {
        struct matrices *m = k ? &p->changed[k - 1] : &p->at;
        *m = (struct matrices){next, next + square, next + 2 * square};
        next += 3 * square;
    }
    p->vector = next;
    p->value = next + square;
    return true;
}

/* All matrices. False: something is not finite, or M is singular. */
static bool fill(struct problem *p, struct phys_curvature *c, const double *q)
{
    const size_t n = p->n, square = n * n;
    double *beside = p->value; /* free as yet */
    if (!evaluate(p, c, q, &p->at))
        return false;
    for (size_t d = 0; d < DIRECTIONS; d++) {
        for (size_t i = 0; i < n; i++)
            beside[i] = q[i] + ((i * (d + 3) + d) % 3 ? p->off[i] : -p->off[i]) * p->size[i];
        if (!evaluate(p, c, beside, &p->changed[d]))
            return false;
        for (size_t k = 0; k < square; k++) {
            p->changed[d].M[k] -= p->at.M[k];
            p->changed[d].G[k] -= p->at.G[k];
            p->changed[d].K[k] -= p->at.K[k];
        }
    }
    const double mass = phys_largest(square, p->at.M), stiffness = phys_largest(square, p->at.K),
                 turning = phys_largest(square, p->at.G);
    p->turning = turning > 1e-13 * sqrt(mass * stiffness);
    p->unit = fmin(stiffness > 0 ? sqrt(mass / stiffness) : INFINITY,
                   p->turning ? mass / turning : INFINITY);
    if (!isfinite(p->unit))
        p->unit = 1;
    for (size_t d = 0; d <= DIRECTIONS; d++) {
        struct matrices *m = d ? &p->changed[d - 1] : &p->at;
        for (size_t k = 0; k < square; k++) {
            m->G[k] *= p->unit;
            m->K[k] *= p->unit * p->unit;
        }
    }
    return true;
}

/* x a y */
static double form(size_t n, const double *x, const double *a, const double *y)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            sum += x[i] * a[i * n + j] * y[j];
    return sum;
}

static double rounding(const struct problem *p)
{
    return 8 * (double)p->n * DBL_EPSILON * fmax(fabs(p->value[0]), fabs(p->value[p->n - 1]));
}

/* What value k of K x = value M x may be off by. */
static double doubt(const struct problem *p, size_t k)
{
    const double *x = p->vector + k * p->n;
    double sum = rounding(p);
    for (size_t d = 0; d < DIRECTIONS; d++)
        sum += fabs(form(p->n, x, p->changed[d].K, x) -
                    p->value[k] * form(p->n, x, p->changed[d].M, x));
    return sum;
}

static enum ad_status solve_symmetric(struct problem *p, struct ad_error *error)
{
    const size_t square = p->n * p->n;
    double *mass = malloc(square * sizeof *mass);
    if (!mass)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", p->n);
    memcpy(p->vector, p->at.K, square * sizeof *mass);
    memcpy(mass, p->at.M, square * sizeof *mass);
    const int info = phys_lapack_eigenvectors(p->n, p->vector, mass, p->value);
    free(mass);
    p->positive = info == 0;
    return info >= 0 && info <= (int)p->n && info != 0
               ? ad_fail(error, AD_E_ACCURACY, "the eigenvalues of M^-1 K do not converge")
               : AD_OK;
}

/* Shapes have 1 where they are largest. */
static void scale_shape(const struct problem *p, struct phys_mode *mode)
{
    double most = 0, at[2] = {1, 0};
    for (size_t i = 0; i < p->n; i++) {
        double *x = mode->shape + 2 * i;
        x[0] *= p->size[i];
        x[1] *= p->size[i];
        if (hypot(x[0], x[1]) > most * (1 + 1e-9)) {
            most = hypot(x[0], x[1]);
            mode->coordinate = i;
            memcpy(at, x, sizeof at);
        }
    }
    const double square = at[0] * at[0] + at[1] * at[1];
    for (size_t i = 0; i < p->n; i++) {
        double *x = mode->shape + 2 * i;
        const double re = (x[0] * at[0] + x[1] * at[1]) / square;
        x[1] = (x[1] * at[0] - x[0] * at[1]) / square;
        x[0] = re;
    }
}

static void standing_modes(const struct problem *p, struct phys_equilibrium *one)
{
    for (size_t k = 0; k < p->n; k++) {
        struct phys_mode *mode = &one->mode[k];
        const double value = p->value[k], off = doubt(p, k), s = sqrt(fabs(value)) / p->unit;
        const bool zero = fabs(value) <= off;
        mode->frequency = zero || value < 0 ? 0 : s;
        mode->growth = zero || value > 0 ? 0 : s;
        mode->uncertainty = zero ? sqrt(off) / p->unit : 0.5 * s * off / fabs(value);
        for (size_t i = 0; i < p->n; i++)
            mode->shape[2 * i] = p->vector[k * p->n + i];
        scale_shape(p, mode);
    }
}

/* ---- with G: the eigenvalues s of [0 1; -M^-1 K, -M^-1 G] ---- */

struct linear {
    size_t n;                                    /* 2 dof */
    double *a, *re, *im, *left, *right, *change; /* [n x n] by columns, but re, im [n] */
    int *pivots;
};

/* Lower half of the matrix, by columns: -M^-1 [K G]. */
static void fill_lower(const struct problem *p, const struct matrices *m, const double *factor,
                       const int *pivots, double *a)
{
    const size_t n = p->n;
    double *column = p->room; /* zero again at the end */
    for (size_t j = 0; j < 2 * n; j++) {
        for (size_t i = 0; i < n; i++)
            column[i] = -(j < n ? m->K[i * n + j] : m->G[i * n + j - n]);
        phys_lapack_lu_solve(n, factor, pivots, column);
        memcpy(a + j * 2 * n + n, column, n * sizeof *column);
    }
    memset(column, 0, n * sizeof *column);
}

static double complex_size(const double *re, const double *im, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += re[i] * re[i] + (im ? im[i] * im[i] : 0);
    return sqrt(sum);
}

/* |w^H a z| of pairs (real, imaginary column; NULL: real), a [n x n] by columns, NULL: unit. */
static double complex_form(size_t n, const double *w[2], const double *a, const double *z[2])
{
    double re = 0, im = 0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = a ? 0 : j; i < (a ? n : j + 1); i++) {
            const double x = a ? a[j * n + i] : 1, wi = w[1] ? w[1][i] : 0, zi = z[1] ? z[1][j] : 0;
            re += x * (w[0][i] * z[0][j] + wi * zi);
            im += x * (w[0][i] * zi - wi * z[0][j]);
        }
    return hypot(re, im);
}

/* Uncertainty of eigenvalue k, whose vectors start at columns k. */
static double eigenvalue_doubt(const struct linear *l, size_t k, double norm)
{
    const bool pair = l->im[k] != 0;
    const double *w[] = {l->left + k * l->n, pair ? l->left + (k + 1) * l->n : NULL};
    const double *z[] = {l->right + k * l->n, pair ? l->right + (k + 1) * l->n : NULL};
    const double overlap = complex_form(l->n, w, NULL, z);
    double sum = 8 * (double)l->n * DBL_EPSILON * norm * complex_size(w[0], w[1], l->n) *
                 complex_size(z[0], z[1], l->n);
    for (size_t d = 0; d < DIRECTIONS; d++)
        sum += complex_form(l->n, w, l->change + d * l->n * l->n, z);
    return overlap > 0 ? sum / overlap : INFINITY;
}

static void turning_mode(const struct problem *p, const struct linear *l, size_t k,
                         struct phys_mode *mode)
{
    const bool pair = l->im[k] != 0;
    for (size_t i = 0; i < p->n; i++) {
        mode->shape[2 * i] = l->right[k * l->n + i];
        mode->shape[2 * i + 1] = pair ? l->right[(k + 1) * l->n + i] : 0;
    }
    scale_shape(p, mode);
}

static enum ad_status turning_modes(const struct problem *p, const struct linear *l,
                                    struct phys_equilibrium *one, struct ad_error *error)
{
    const double norm = complex_size(l->a, NULL, l->n * l->n);
    size_t n = 0, zeros = 0;
    for (size_t k = 0; k < l->n; k += l->im[k] != 0 ? 2 : 1) {
        const double off = eigenvalue_doubt(l, k, norm), least = fmin(off, defective * norm);
        struct phys_mode found = {.growth = fabs(l->re[k]) > least ? l->re[k] / p->unit : 0,
                                  .frequency = fabs(l->im[k]) > least ? l->im[k] / p->unit : 0,
                                  .uncertainty = off / p->unit};
        if (found.frequency == 0 && found.growth < 0)
            continue;
        if (found.frequency == 0 && found.growth == 0) {
            zeros += l->im[k] != 0 ? 2 : 1;
            if (zeros % 2 != 0 && l->im[k] == 0)
                continue;
        }
        if (n == p->n)
            n++;
        else {
            found.shape = one->mode[n].shape;
            one->mode[n] = found;
            turning_mode(p, l, k, &one->mode[n++]);
        }
    }
    return n == p->n ? AD_OK
                     : ad_fail(error, AD_E_ACCURACY,
                               "the eigenvalues of an equilibrium are not in pairs s, -s");
}

static enum ad_status solve_turning(struct problem *p, struct phys_equilibrium *one,
                                    struct ad_error *error)
{
    const size_t n = p->n, N = 2 * n, square = N * N;
    struct linear l = {.n = N};
    l.a = calloc((4 + DIRECTIONS) * square + 2 * N, sizeof *l.a);
    double *factor = malloc(n * n * sizeof *factor);
    l.pivots = malloc(n * sizeof *l.pivots);
    if (!l.a || !factor || !l.pivots) {
        AD_FREE(l.a, factor, l.pivots);
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    }
    l.left = l.a + square;
    l.right = l.left + square;
    double *work = l.right + square;
    l.change = work + square;
    l.re = l.change + DIRECTIONS * square;
    l.im = l.re + N;
    memcpy(factor, p->at.M, n * n * sizeof *factor);
    phys_lapack_lu_factor(n, factor, l.pivots);
    fill_lower(p, &p->at, factor, l.pivots, l.a);
    for (size_t i = 0; i < n; i++)
        l.a[(n + i) * N + i] = 1;
    memcpy(work, l.a, square * sizeof *work);
    for (size_t d = 0; d < DIRECTIONS; d++) { /* M^-1 (dK - dM M^-1 K), and so with G */
        struct matrices m = p->changed[d];
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                for (size_t r = 0; r < n; r++) {
                    m.K[i * n + j] += m.M[i * n + r] * l.a[j * N + n + r];
                    m.G[i * n + j] += m.M[i * n + r] * l.a[(n + j) * N + n + r];
                }
        fill_lower(p, &m, factor, l.pivots, l.change + d * square);
    }
    if (phys_lapack_eigenvalues(N, work, l.re, l.im, l.left, l.right) != 0)
        ad_fail(error, AD_E_ACCURACY, "the eigenvalues of an equilibrium do not converge");
    else
        turning_modes(p, &l, one, error);
    AD_FREE(l.a, factor, l.pivots);
    return error->status;
}

static int order(const void *a, const void *b)
{
    const struct phys_mode *x = a, *y = b;
    return x->growth != y->growth ? (x->growth < y->growth) - (x->growth > y->growth)
                                  : (x->frequency > y->frequency) - (x->frequency < y->frequency);
}

static enum phys_equilibrium_kind judge(const struct problem *p, const struct phys_equilibrium *one)
{
    size_t negative = 0, zero = 0;
    for (size_t k = 0; k < p->n; k++)
        if (one->mode[k].growth > 0)
            return PHYS_EQUILIBRIUM_UNSTABLE;
    if (!p->positive)
        return PHYS_EQUILIBRIUM_GYROSCOPIC;
    for (size_t k = 0; k < p->n; k++) {
        const double off = doubt(p, k);
        negative += p->value[k] < -off;
        zero += fabs(p->value[k]) <= off;
    }
    return negative ? PHYS_EQUILIBRIUM_GYROSCOPIC
           : zero   ? PHYS_EQUILIBRIUM_NEUTRAL
                    : PHYS_EQUILIBRIUM_LEAST;
}

enum ad_status phys_modes_at(struct phys_curvature *curvature, const double *size,
                             const double *off, struct phys_equilibrium *one,
                             struct ad_error *error)
{
    struct problem p;
    const size_t n = curvature->system->dof;
    one->n_modes = 0;
    one->kind = PHYS_EQUILIBRIUM_UNDECIDED;
    one->mode = calloc(n, sizeof *one->mode);
    double *shapes = calloc(2 * n * n, sizeof *shapes);
    if (!begin(&p, curvature, size, off) || !one->mode || !shapes) {
        AD_FREE(shapes, p.room);
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    }
    for (size_t k = 0; k < n; k++)
        one->mode[k].shape = shapes + 2 * n * k;
    one->shapes = shapes;
    if (fill(&p, curvature, one->q) && solve_symmetric(&p, error) == AD_OK) {
        if (p.turning || !p.positive)
            solve_turning(&p, one, error);
        else
            standing_modes(&p, one);
        one->n_modes = error->status == AD_OK ? n : 0;
        if (one->n_modes)
            one->kind = judge(&p, one);
        qsort(one->mode, one->n_modes, sizeof *one->mode, order);
    }
    free(p.room);
    return error->status;
}
