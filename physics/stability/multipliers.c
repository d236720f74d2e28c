/* Floquet multipliers: eigenvalues of the state-transition matrix over a period, with what its
   uncertainty and rounding leave of them: e / |l r| of a simple one, with unit vectors l and r;
   sqrt(e |M|) of two that have merged, as those along the motion and across energies have. */
#include "internal.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static const double known = 4; /* uncertainties */

/* Component i of eigenvector k: real and imaginary part in two columns of a pair. */
static double modulus(size_t n, const double *vectors, const double *im, size_t k, size_t i)
{
    if (im[k] == 0)
        return fabs(vectors[k * n + i]);
    const size_t first = im[k] > 0 ? k : k - 1;
    return hypot(vectors[first * n + i], vectors[(first + 1) * n + i]);
}

/* |l^H r| */
static double product(size_t n, const double *l, const double *r, const double *im, size_t k)
{
    double re = 0, other = 0;
    const size_t a = im[k] < 0 ? k - 1 : k, b = im[k] == 0 ? k : a + 1;
    for (size_t i = 0; i < n; i++) {
        const double x = l[a * n + i], y = im[k] == 0 ? 0 : l[b * n + i];
        const double u = r[a * n + i], w = im[k] == 0 ? 0 : r[b * n + i];
        re += x * u + y * w;
        other += x * w - y * u;
    }
    return hypot(re, other);
}

static int by_modulus(const void *a, const void *b)
{
    const struct phys_multiplier *x = a, *y = b;
    const double d = hypot(y->re, y->im) - hypot(x->re, x->im);
    return d != 0 ? (d > 0 ? 1 : -1) : (x->im < y->im) - (x->im > y->im);
}

static enum phys_periodic_kind judge(const struct phys_periodic *found, bool timeless)
{
    size_t inside = 0;
    bool vague = false;
    for (size_t k = 0; k < found->n; k++) {
        const struct phys_multiplier *m = &found->multiplier[k];
        const double off = hypot(m->re, m->im) - 1;
        if (off > known * m->uncertainty)
            return PHYS_PERIODIC_UNSTABLE;
        inside += off < -known * m->uncertainty;
        vague = vague || !(known * m->uncertainty < 1);
    }
    if (vague)
        return PHYS_PERIODIC_UNKNOWN;
    return inside + timeless >= found->n ? PHYS_PERIODIC_ATTRACTING : PHYS_PERIODIC_NEUTRAL;
}

enum ad_status phys_multipliers(const struct phys_system *system, const double *size,
                                struct phys_periodic *found,
                                const struct phys_periodic_settings *settings,
                                struct ad_error *error)
{
    const size_t n = found->n;
    const struct phys_lyapunov_settings how = {.size = sizeof how,
                                               .t1 = found->period,
                                               .proceed = settings->proceed,
                                               .context = settings->context};
    double *M = calloc(5 * n * n + 2 * n, sizeof *M), whole = 0;
    if (!M)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *u = M + n * n, *a = u + n * n, *left = a + n * n, *right = left + n * n,
           *re = right + n * n, *im = re + n;
    if (phys_transition(system, found->x, &how, M, u, error) == AD_OK) {
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                a[j * n + i] = M[i * n + j] *= size[j] / size[i];
                u[i * n + j] *= size[j] / size[i];
                whole += M[i * n + j] * M[i * n + j];
            }
        whole = sqrt(whole);
        if (phys_lapack_eigenvalues(n, a, re, im, left, right) != 0)
            ad_fail(error, AD_E_ACCURACY, "the multipliers of %s: no eigenvalues found",
                    system->scene->name);
    }
    for (size_t k = 0; k < n && error->status == AD_OK; k++) {
        double e = (double)n * DBL_EPSILON * whole;
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                e += modulus(n, left, im, k, i) *
                     (u[i * n + j] + found->closure * whole / (double)n) *
                     modulus(n, right, im, k, j);
        found->multiplier[k] = (struct phys_multiplier){
            re[k], im[k], fmin(e / product(n, left, right, im, k), sqrt(e * whole))};
    }
    if (error->status == AD_OK) {
        qsort(found->multiplier, n, sizeof *found->multiplier, by_modulus);
        found->kind = judge(found, !settings->hold_period);
    }
    free(M);
    return error->status;
}

const char *phys_periodic_word(enum phys_periodic_kind kind)
{
    static const char *const words[] = {
        [PHYS_PERIODIC_NEUTRAL] = "stable to first order: no multiplier is outside the unit circle",
        [PHYS_PERIODIC_ATTRACTING] = "attracting: multipliers are inside the unit circle",
        [PHYS_PERIODIC_UNSTABLE] = "unstable: a multiplier is outside the unit circle",
        [PHYS_PERIODIC_UNKNOWN] = "stability unknown: multipliers are uncertain by more than 1"};
    return kind < sizeof words / sizeof *words ? words[kind] : NULL;
}
