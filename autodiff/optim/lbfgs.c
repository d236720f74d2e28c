/* Limited-memory BFGS (autodiff/lbfgs.h). */
#include "autodiff/lbfgs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY = 10, TRIALS = 40 };

static const double DECREASE = 1e-4, CURVATURE = 0.9, ROUNDING = 1e-12;

struct ad_lbfgs {
    size_t n;
    uint64_t pairs;                    /* taken so far */
    double *kept;                      /* s [MEMORY x n], y [MEMORY x n], rho [MEMORY] */
    double *direction, *from, *from_g; /* [n] each, behind what is kept */
    ad_inner_product *product;         /* NULL: this process has all */
    ad_inverse_times *inverse;         /* NULL: a multiple of one, by the last pair */
    void *context, *inverse_context;
};

static size_t kept_size(const ad_lbfgs *m) { return MEMORY * (2 * m->n + 1); }
static double *pair_s(const ad_lbfgs *m, uint64_t k) { return m->kept + k % MEMORY * m->n; }
static double *pair_y(const ad_lbfgs *m, uint64_t k) { return pair_s(m, k) + MEMORY * m->n; }
static double *pair_rho(const ad_lbfgs *m, uint64_t k)
{
    return m->kept + 2 * MEMORY * m->n + k % MEMORY;
}

ad_lbfgs *ad_lbfgs_new(size_t n)
{
    ad_lbfgs *m = n <= SIZE_MAX / (4 * MEMORY * sizeof(double)) ? malloc(sizeof *m) : NULL;
    if (!m)
        return NULL;
    *m = (ad_lbfgs){.n = n};
    m->kept = calloc(kept_size(m) + 3 * n, sizeof *m->kept);
    if (!m->kept) {
        free(m);
        return NULL;
    }
    m->direction = m->kept + kept_size(m);
    m->from = m->direction + n;
    m->from_g = m->from + n;
    return m;
}

void ad_lbfgs_free(ad_lbfgs *method)
{
    if (method)
        free(method->kept);
    free(method);
}

void ad_lbfgs_share(ad_lbfgs *method, ad_inner_product *product, void *context)
{
    if (!method)
        return;
    method->product = product;
    method->context = context;
}

void ad_lbfgs_precondition(ad_lbfgs *method, ad_inverse_times *inverse, void *context)
{
    if (!method)
        return;
    method->inverse = inverse;
    method->inverse_context = context;
}

static double dot(const ad_lbfgs *m, const double *a, const double *b)
{
    double sum = 0;
    if (m->product)
        return m->product(m->context, a, b);
    for (size_t k = 0; k < m->n; k++)
        sum += a[k] * b[k];
    return sum;
}

/* direction = -B g by the two-loop recursion over the pairs kept. */
static void find_direction(ad_lbfgs *m, const double *g)
{
    size_t n = m->n;
    uint64_t kept = m->pairs < MEMORY ? m->pairs : MEMORY, oldest = m->pairs - kept;
    double alpha[MEMORY] = {0}, *d = m->direction;
    for (size_t k = 0; k < n; k++)
        d[k] = -g[k];
    for (uint64_t i = m->pairs; i-- > oldest;) {
        double a = alpha[i % MEMORY] = *pair_rho(m, i) * dot(m, pair_s(m, i), d);
        for (size_t k = 0; k < n; k++)
            d[k] -= a * pair_y(m, i)[k];
    }
    if (m->inverse) {
        m->inverse(m->inverse_context, d);
    } else if (kept) {
        const double *y = pair_y(m, m->pairs - 1);
        double scale = 1 / (*pair_rho(m, m->pairs - 1) * dot(m, y, y));
        for (size_t k = 0; k < n; k++)
            d[k] *= scale;
    }
    for (uint64_t i = oldest; i < m->pairs; i++) {
        double b = alpha[i % MEMORY] - *pair_rho(m, i) * dot(m, pair_y(m, i), d);
        for (size_t k = 0; k < n; k++)
            d[k] += b * pair_s(m, i)[k];
    }
}

/* Whether the objective fell enough; where it changes by no more than it is rounded, by its slope
   (W. Hager, H. Zhang, SIAM J. Optim. 16, 170 (2005), eq. 22). */
static bool falls(double from, double value, double length, double slope, double here)
{
    return value <= from + DECREASE * length * slope ||
           (fabs(value - from) <= ROUNDING * fabs(from) && here <= (2 * DECREASE - 1) * slope);
}

/* Bisects between a step that is too short and one that is too long; doubles until there is one. */
static bool search(ad_lbfgs *m, ad_objective *evaluate, void *context, double length, double *x,
                   double *g, double *value)
{
    const double from = *value, slope = dot(m, m->from_g, m->direction);
    double low = 0, high = (double)INFINITY;
    if (!(slope < 0))
        return false;
    for (int trial = 0; trial < TRIALS; trial++) {
        for (size_t k = 0; k < m->n; k++)
            x[k] = m->from[k] + length * m->direction[k];
        *value = evaluate(context, x, g);
        double here = dot(m, g, m->direction);
        if (!falls(from, *value, length, slope, here) || here > -CURVATURE * slope)
            high = length;
        else if (here < CURVATURE * slope)
            low = length;
        else
            return true;
        length = isinf(high) ? 2 * length : 0.5 * (low + high);
    }
    return *value < from;
}

static void remember(ad_lbfgs *m, const double *x, const double *g)
{
    double *s = pair_s(m, m->pairs), *y = pair_y(m, m->pairs);
    for (size_t k = 0; k < m->n; k++) {
        s[k] = x[k] - m->from[k];
        y[k] = g[k] - m->from_g[k];
    }
    double curvature = dot(m, s, y);
    if (curvature > 0)
        *pair_rho(m, m->pairs++) = 1 / curvature;
}

bool ad_lbfgs_step(ad_lbfgs *method, ad_objective *evaluate, void *context, double first, double *x,
                   double *g, double *value)
{
    ad_lbfgs *m = method;
    if (!m || !evaluate || !x || !g || !value)
        return false;
    const size_t bytes = m->n * sizeof *x;
    const double from = *value;
    double largest = 0;
    memcpy(m->from, x, bytes);
    memcpy(m->from_g, g, bytes);
    find_direction(m, g);
    for (size_t k = 0; k < m->n && !m->product; k++)
        largest = fmax(largest, fabs(m->direction[k]));
    if (m->product && !m->pairs)
        largest = sqrt(dot(m, m->direction, m->direction));
    if (search(m, evaluate, context, m->pairs || m->inverse ? 1 : first / largest, x, g, value)) {
        remember(m, x, g);
        return true;
    }
    memcpy(x, m->from, bytes);
    memcpy(g, m->from_g, bytes);
    *value = from;
    return false;
}

uint64_t *ad_lbfgs_pairs(ad_lbfgs *method) { return method ? &method->pairs : NULL; }

double *ad_lbfgs_state(ad_lbfgs *method, size_t *size)
{
    if (size)
        *size = method ? kept_size(method) : 0;
    return method ? method->kept : NULL;
}
