/* Conjugate points of the motion through the ends of a path. From a node at t_i the flow of (q, p)
   is (a b; c d); J = a X + b Y are the Jacobi fields that vanish at the start, spanned by (X; Y) at
   the node. With b regular, as it is between near nodes,
       N(t) = X^T b^-1 J = X^T (b^-1 a X + Y)
   is symmetric and loses as much rank as J. Where L_vv is positive definite its eigenvalues begin
   at +inf and decrease, so each one that ends below zero has crossed it once; a point counts as
   often as the fields lose rank there (Morse; Duistermaat, Adv. Math. 21, 1976). */
#include "autodiff/ascending.h"
#include "internal.h"
#include "autodiff/blas.h"
#include "autodiff/free.h"
#include "shooting.h"
#include "physics/io/grow.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double loose = 1e-10, tight = 1e-13; /* of the motion: the difference is the error */
static const double known = 4e-12;                /* relative to the time: rounding */

static const double NEAR = 0.1; /* of the path's extent: the motion may be so far from it */

enum { MOST_TRIALS = 60 };

/* Jacobi fields from a node on. */
struct fields {
    struct phys_shooting *shooting;
    size_t node, dof;
    double *X, *Y, *J, *P; /* [dof][dof] each, by columns: (X; Y) at the node, (J; P) at t */
    double *flow, *state;  /* [2 dof][2 dof], [2 dof] */
    double *N, *unit;      /* [dof][dof] */
    double *values, *factor;
    int *pivots;
};

static bool fields_new(struct fields *f, struct phys_shooting *s)
{
    size_t n = s->dof;
    *f = (struct fields){.shooting = s, .dof = n};
    f->X = calloc(11 * n * n + 3 * n, sizeof *f->X);
    f->pivots = malloc(n * sizeof *f->pivots);
    if (!f->X || !f->pivots)
        return false;
    f->Y = f->X + n * n;
    f->J = f->Y + n * n;
    f->P = f->J + n * n;
    f->N = f->P + n * n;
    f->unit = f->N + n * n;
    f->factor = f->unit + n * n;
    f->flow = f->factor + n * n;
    f->state = f->flow + 4 * n * n;
    f->values = f->state + 2 * n;
    for (size_t k = 0; k < n; k++)
        f->Y[k * n + k] = 1;
    return true;
}

static void fields_free(struct fields *f) { AD_FREE(f->X, f->pivots); }

/* (J; P) = flow (X; Y) */
static void carry(struct fields *f, const double *flow)
{
    size_t n = f->dof;
    for (size_t c = 0; c < n; c++)
        for (size_t r = 0; r < 2 * n; r++) {
            double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += flow[k * 2 * n + r] * f->X[c * n + k] +
                       flow[(n + k) * 2 * n + r] * f->Y[c * n + k];
            (r < n ? f->J : f->P)[c * n + r % n] = sum;
        }
}

/* The eigenvalues of N at the end of `flow`, ascending. False: b is singular. */
static bool eigenvalues(struct fields *f, const double *flow)
{
    size_t n = f->dof;
    carry(f, flow);
    for (size_t c = 0; c < n; c++)
        for (size_t r = 0; r < n; r++)
            f->factor[r * n + c] = flow[(n + c) * 2 * n + r];
    if (phys_lapack_lu_factor(n, f->factor, f->pivots) != 0)
        return false;
    for (size_t c = 0; c < n; c++) { /* J by b^-1 J */
        phys_lapack_lu_solve(n, f->factor, f->pivots, f->J + c * n);
        for (size_t r = 0; r < n; r++) {
            double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += f->X[r * n + k] * f->J[c * n + k];
            f->N[c * n + r] = sum;
            f->unit[c * n + r] = r == c;
        }
    }
    for (size_t c = 0; c < n; c++)
        for (size_t r = 0; r < c; r++)
            f->N[c * n + r] = f->N[r * n + c] = 0.5 * (f->N[c * n + r] + f->N[r * n + c]);
    return phys_lapack_eigenvectors(n, f->N, f->unit, f->values) == 0;
}

/* Eigenvalue k of N at t, times the time from the node; NaN where it is lost. */
static double value(struct fields *f, size_t k, double t)
{
    struct phys_shooting *s = f->shooting;
    if (!phys_shooting_flow(s, f->node, t, f->flow, f->state) || !eigenvalues(f, f->flow))
        return (double)NAN;
    return f->values[k] * (t - s->time[f->node]);
}

/* The zero of eigenvalue k between times near the node and at the next, where it has the value
   `end`: the secant through both ends of the bracket, a stale end halved (Illinois). */
static double zero(struct fields *f, size_t k, double end)
{
    const struct phys_shooting *s = f->shooting;
    double low = s->time[f->node], high = s->time[f->node + 1], start = low;
    double length = high - low, at_high = end * length, at_low;
    do { /* near enough to the node for the sign it has there */
        low = start + 0.25 * (low > start ? low - start : length);
        at_low = value(f, k, low);
    } while ((at_low < 0) == (at_high < 0) && low - start > 1e-9 * length);
    int stale = 0;
    for (int trial = 0; trial < MOST_TRIALS && high - low > 0.1 * known * high; trial++) {
        double t = low - at_low * (high - low) / (at_high - at_low);
        double here = value(f, k, t);
        if (here == 0 || !isfinite(here))
            return isfinite(here) ? t : here;
        bool below = (here < 0) == (at_low < 0);
        if (fabs(t - (below ? low : high)) < 0.05 * known * high)
            return t;
        if (below) {
            at_high *= stale == -1 ? 0.5 : 1;
            low = t, at_low = here, stale = -1;
        } else {
            at_low *= stale == 1 ? 0.5 : 1;
            high = t, at_high = here, stale = 1;
        }
    }
    return 0.5 * (low + high);
}

/* An orthonormal basis of the fields (J; P) becomes (X; Y): Gram and Schmidt, twice. */
static void renew(struct fields *f)
{
    size_t n = f->dof;
    memcpy(f->X, f->J, n * n * sizeof *f->X);
    memcpy(f->Y, f->P, n * n * sizeof *f->Y);
    for (size_t c = 0; c < n; c++) {
        double *x = f->X + c * n, *y = f->Y + c * n, norm = 0;
        for (size_t pass = 0; pass < 2 * c; pass++) {
            const double *u = f->X + pass % c * n, *w = f->Y + pass % c * n;
            double share = 0;
            for (size_t k = 0; k < n; k++)
                share += u[k] * x[k] + w[k] * y[k];
            for (size_t k = 0; k < n; k++) {
                x[k] -= share * u[k];
                y[k] -= share * w[k];
            }
        }
        for (size_t k = 0; k < n; k++)
            norm += x[k] * x[k] + y[k] * y[k];
        for (size_t k = 0; k < n; k++) {
            x[k] /= sqrt(norm);
            y[k] /= sqrt(norm);
        }
    }
}

/* The number of negative eigenvalues of L_vv at a node, equal to that of N at first. */
static size_t negative_masses(struct fields *f, size_t node)
{
    const struct phys_shooting *s = f->shooting;
    size_t n = f->dof, count = 0;
    const double *state = s->state + node * 2 * n;
    phys_curvature_at(&f->shooting->at, state, state + n, s->time[node]);
    memcpy(f->N, s->at.vv, n * n * sizeof *f->N);
    memset(f->unit, 0, n * n * sizeof *f->unit);
    for (size_t k = 0; k < n; k++)
        f->unit[k * n + k] = 1;
    if (phys_lapack_eigenvectors(n, f->N, f->unit, f->values) != 0)
        return 0;
    while (count < n && f->values[count] < 0)
        count++;
    return count;
}

struct times {
    size_t n;
    double *at;
};

static bool add(struct times *times, double t)
{
    if (!isfinite(t) || !phys_grow(&times->at, times->n, sizeof *times->at))
        return false;
    times->at[times->n++] = t;
    return true;
}

/* The zeros over segment f->node, none over the first, where N is not defined. */
static bool cross(struct fields *f, struct times *times)
{
    struct phys_shooting *s = f->shooting;
    size_t n = f->dof, before = negative_masses(f, f->node), after = 0;
    double end[PHYS_SHOOTING_DOF];
    if (!eigenvalues(f, s->flow + f->node * 4 * n * n))
        return false;
    memcpy(end, f->values, n * sizeof *end);
    while (after < n && end[after] < 0)
        after++;
    size_t first = before < after ? before : after, last = before < after ? after : before;
    for (size_t k = first; k < last; k++)
        if (!add(times, zero(f, k, end[k])))
            return false;
    return true;
}

/* All of them, in their order. */
static bool find(struct phys_shooting *s, struct times *times)
{
    struct fields f;
    bool found = fields_new(&f, s);
    for (f.node = 0; found && f.node < s->n; f.node++) {
        found = f.node == 0 || cross(&f, times);
        carry(&f, s->flow + f.node * 4 * s->dof * s->dof);
        renew(&f);
    }
    fields_free(&f);
    if (times->n)
        qsort(times->at, times->n, sizeof *times->at, ad_ascending);
    return found;
}

/* The times by tight steps, and how far those by looser ones are from them. */
static enum ad_status adopt(const struct times *rough, const struct times *fine,
                            struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct phys_conjugate *points = malloc((fine->n + 1) * sizeof *points);
    if (!points)
        return ad_fail(error, AD_E_MEMORY, "out of memory for conjugate points");
    for (size_t k = 0; k < fine->n; k++)
        points[k] = (struct phys_conjugate){
            fine->at[k], fmax(fabs(fine->at[k] - rough->at[k]), known * fine->at[k])};
    free(spectrum->conjugate);
    spectrum->conjugate = points;
    spectrum->n_conjugate = fine->n;
    spectrum->of_motion = true;
    return AD_OK;
}

enum ad_status phys_path_conjugate(const struct phys_system *system,
                                   const struct phys_path_settings *settings, const double *path,
                                   struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct phys_shooting s;
    struct times rough = {0}, fine = {0};
    if (AD_LACKS(error, system, system->scene, settings, path, spectrum, settings->rule))
        return error->status;
    if (phys_refuse_forces(system, "paths", error) != AD_OK ||
        phys_refuse_constraints(system, "conjugate points", error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    if (system->dof > PHYS_SHOOTING_DOF)
        return AD_OK;
    ad_blas_single_thread(); /* matrices are too small to share */
    if (phys_shooting_new(&s, system, settings, path, error) && phys_shooting_solve(&s, loose) &&
        phys_shooting_moved(&s) <= NEAR && find(&s, &rough) && phys_shooting_solve(&s, tight) &&
        find(&s, &fine) && rough.n == fine.n)
        adopt(&rough, &fine, spectrum, error);
    ad_blas_threads();
    phys_shooting_free(&s);
    AD_FREE(rough.at, fine.at);
    return error->status;
}
