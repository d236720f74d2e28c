/* What changes sign along a family where it bifurcates: symmetric functions of its multipliers,
   which are smooth where these meet (family_parts.h). */
#include "family_parts.h"
#include "physics/linear/linear.h"
#include "physics/linear/vectors.h"

#include <complex.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 2 * PHYS_PERIODIC_DOF };

/* ---- the multipliers ---- */

/* Numbers of the blocks that P [d x d] falls into, as of motions in a plane and out of it: each by
   itself loses no digits to the others. */
static void divide(size_t d, const double *P, size_t *block)
{
    const double least = 1e-3 * DBL_EPSILON * phys_norm(d * d, P);
    bool merged = true;
    for (size_t i = 0; i < d; i++)
        block[i] = i;
    while (merged) {
        merged = false;
        for (size_t i = 0; i < d; i++)
            for (size_t j = 0; j < d; j++)
                if (fabs(P[j * d + i]) > least && block[i] < block[j]) {
                    block[j] = block[i];
                    merged = true;
                } else if (fabs(P[j * d + i]) > least && block[j] < block[i]) {
                    block[i] = block[j];
                    merged = true;
                }
    }
}

enum ad_status phys_family_multipliers(const struct family_run *run, double shake,
                                       struct family_point *p, struct ad_error *error)
{
    const size_t d = run->d;
    size_t block[MOST], done = 0;
    double *P = calloc(4 * d * d, sizeof *P);
    if (!P)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *part = P + d * d, *left = part + d * d, *right = left + d * d;
    for (size_t j = 0; j < d; j++)
        for (size_t i = 0; i < d; i++)
            P[j * d + i] = run->y[d + j * d + i] * run->unit[j] / run->unit[i];
    const double slow = 1e-12 * phys_norm(d, p->rate);
    p->grown = phys_norm(d * d, P);
    divide(d, P, block);
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t k = 0; k < d && error->status == AD_OK; k++) {
            size_t n = 0, of[MOST];
            bool along = false;
            for (size_t i = 0; i < d; i++)
                if (block[i] == k) {
                    of[n++] = i;
                    along = along || fabs(p->rate[i]) > slow;
                }
            if (n == 0 || along != (pass == 1))
                continue;
            for (size_t j = 0; j < n; j++)
                for (size_t i = 0; i < n; i++)
                    part[j * n + i] = P[of[j] * d + of[i]];
            const double by = shake * phys_norm(n * n, part);
            for (size_t i = 0; i < n * n; i++)
                part[i] += by * sin((double)(7 * i) + 1);
            if (phys_lapack_eigenvalues(n, part, p->re + done, p->im + done, left, right) != 0)
                ad_fail(error, AD_E_ACCURACY, "no multipliers found");
            done += n;
        }
        p->aside = pass == 0 ? done : p->aside;
    }
    free(P);
    return error->status;
}

/* ---- the tests ---- */

static double complex multiplier(const struct family_point *p, size_t k)
{
    return p->re[k] + I * p->im[k];
}

/* The elementary symmetric function of degree k of a[n]. */
static double symmetric(size_t n, const double complex *a, size_t k)
{
    double complex e[MOST + 1] = {1};
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j > 0; j--)
            e[j] += a[i] * e[j - 1];
    return creal(e[k]);
}

/* The multipliers that are not 1 all along; returns their number. */
static size_t others(const struct family_run *run, const struct family_point *p,
                     double complex *other)
{
    for (size_t k = 0; k < run->d; k++)
        other[k] = multiplier(p, k);
    for (size_t drop = 0; drop < run->trivial; drop++) {
        size_t nearest = 0;
        for (size_t k = 1; k < run->d - drop; k++)
            if (cabs(other[k] - 1) < cabs(other[nearest] - 1))
                nearest = k;
        other[nearest] = other[run->d - drop - 1];
    }
    return run->d - run->trivial;
}

/* One of mu + 1/mu of each pair mu, 1/mu; returns their number. */
static size_t sums(size_t n, double complex *other)
{
    for (size_t k = 0; k + 1 < n; k += 2) {
        size_t partner = k + 1;
        for (size_t j = k + 2; j < n; j++)
            if (cabs(other[j] * other[k] - 1) < cabs(other[partner] * other[k] - 1))
                partner = j;
        const double complex pair = other[partner];
        other[partner] = other[k + 1];
        other[k + 1] = pair;
        other[k / 2] = 0.5 * (other[k] + 1 / other[k] + pair + 1 / pair);
    }
    return n / 2;
}

static double torus(const struct family_run *run, const struct family_point *p)
{
    double complex other[MOST], product = 1;
    size_t n = others(run, p, other);
    if (run->symplectic)
        n = sums(n, other);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++)
            product *= run->symplectic ? cpow(other[i] - other[j], 2) : other[i] * other[j] - 1;
    return creal(product);
}

bool phys_family_is_torus(const struct family_run *run, const struct family_point *p)
{
    double complex other[MOST];
    size_t n = others(run, p, other);
    double nearest = INFINITY;
    bool is = false;
    if (run->symplectic)
        n = sums(n, other);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++) {
            const double apart =
                run->symplectic ? cabs(other[i] - other[j]) : cabs(other[i] * other[j] - 1);
            if (apart < nearest) {
                nearest = apart;
                is = run->symplectic ? fabs(creal(other[i])) < 2 : cimag(other[i]) != 0;
            }
        }
    return is;
}

void phys_family_test(const struct family_run *run, struct family_point *p)
{
    const size_t d = run->d;
    double complex less[MOST], more[MOST];
    double size = 1;
    for (size_t k = 0; k < d; k++) {
        less[k] = multiplier(p, k) - 1;
        more[k] = multiplier(p, k) + 1;
        size *= 1 + cabs(multiplier(p, k));
    }
    memset(p->noise, 0, sizeof p->noise);
    p->test[TEST_TARGET] = p->value - run->settings->to;
    p->test[TEST_FOLD] = p->slope;
    p->noise[TEST_FOLD] = 1e-9;
    const size_t aside = run->trivial <= 2 ? p->aside : 0; /* more: some may be there */
    p->test[TEST_ONE] = symmetric(aside, less, aside) *
                        symmetric(d - aside, less + aside, d - aside - run->trivial);
    p->test[TEST_MINUS] = symmetric(d, more, d);
    p->test[TEST_TORUS] = d - run->trivial >= (run->symplectic ? 4 : 2) ? torus(run, p) : 0;
    for (size_t k = TEST_ONE; k < TESTS; k++)
        p->noise[k] = 100 * DBL_EPSILON * p->grown * size;
}
