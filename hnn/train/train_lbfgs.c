/* Limited-memory BFGS (J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., algorithms 7.4 and
   7.5), the strong Wolfe conditions found by bracketing. Directions are in f64 whatever the
   parameters are. Weight decay is the term decay/2 |x|^2 of what is minimised. */
#include "train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY = 10, TRIALS = 25 };

static const double DECREASE = 1e-4, CURVATURE = 0.9;

struct lbfgs {
    size_t n;
    enum ad_type type;
    double decay;
    uint64_t pairs; /* taken so far */
    double *kept;   /* s [MEMORY x n], y [MEMORY x n], rho [MEMORY]: what a next step depends on */
    double *x, *g, *direction, *trial, *trial_g; /* [n] each, in one allocation */
};

static void destroy(void *method)
{
    struct lbfgs *m = method;
    if (!m)
        return;
    free(m->kept);
    free(m->x);
    free(m);
}

static size_t kept_size(const struct lbfgs *m) { return MEMORY * (2 * m->n + 1); }
static double *pair_s(const struct lbfgs *m, uint64_t k) { return m->kept + k % MEMORY * m->n; }
static double *pair_y(const struct lbfgs *m, uint64_t k) { return pair_s(m, k) + MEMORY * m->n; }
static double *pair_rho(const struct lbfgs *m, uint64_t k)
{
    return m->kept + 2 * MEMORY * m->n + k % MEMORY;
}

static void *create(const struct hnn_training *training, enum ad_type type, size_t n)
{
    struct lbfgs *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    *m = (struct lbfgs){.n = n, .type = type, .decay = training->weight_decay};
    m->kept = calloc(kept_size(m), sizeof *m->kept);
    m->x = malloc(5 * n * sizeof *m->x);
    if (!m->kept || !m->x) {
        destroy(m);
        return NULL;
    }
    m->g = m->x + n;
    m->direction = m->x + 2 * n;
    m->trial = m->x + 3 * n;
    m->trial_g = m->x + 4 * n;
    return m;
}

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += a[k] * b[k];
    return sum;
}

/* Objective and gradient g at the problem's point x; *loss is without the decay. */
static double evaluate(const struct lbfgs *m, const struct hnn_problem *problem, double *x,
                       double *g, double *loss)
{
    *loss = hnn_problem_evaluate(problem);
    hnn_to_double(m->type, m->n, hnn_problem_point(problem), x);
    hnn_to_double(m->type, m->n, hnn_problem_gradient(problem), g);
    for (size_t k = 0; k < m->n; k++)
        g[k] += m->decay * x[k];
    return *loss + 0.5 * m->decay * dot(m->n, x, x);
}

/* direction = -B g by the two-loop recursion over the pairs kept. */
static void find_direction(struct lbfgs *m)
{
    size_t n = m->n;
    uint64_t kept = m->pairs < MEMORY ? m->pairs : MEMORY, oldest = m->pairs - kept;
    double alpha[MEMORY] = {0}, *d = m->direction;
    for (size_t k = 0; k < n; k++)
        d[k] = -m->g[k];
    for (uint64_t i = m->pairs; i-- > oldest;) {
        double a = alpha[i % MEMORY] = *pair_rho(m, i) * dot(n, pair_s(m, i), d);
        for (size_t k = 0; k < n; k++)
            d[k] -= a * pair_y(m, i)[k];
    }
    if (kept) {
        const double *y = pair_y(m, m->pairs - 1);
        double scale = 1 / (*pair_rho(m, m->pairs - 1) * dot(n, y, y));
        for (size_t k = 0; k < n; k++)
            d[k] *= scale;
    }
    for (uint64_t i = oldest; i < m->pairs; i++) {
        double b = alpha[i % MEMORY] - *pair_rho(m, i) * dot(n, pair_y(m, i), d);
        for (size_t k = 0; k < n; k++)
            d[k] += b * pair_s(m, i)[k];
    }
}

/* Finds a length between what is too short and what is too long; doubles until something is. */
static bool search(struct lbfgs *m, const struct hnn_problem *problem, double from, double length)
{
    double slope = dot(m->n, m->g, m->direction), low = 0, high = (double)INFINITY, loss;
    double here = from;
    if (!(slope < 0))
        return false;
    for (int trial = 0; trial < TRIALS; trial++) {
        for (size_t k = 0; k < m->n; k++)
            m->trial[k] = m->x[k] + length * m->direction[k];
        hnn_from_double(m->type, m->n, m->trial, hnn_problem_point(problem));
        here = evaluate(m, problem, m->trial, m->trial_g, &loss);
        double now = dot(m->n, m->trial_g, m->direction);
        if (!(here <= from + DECREASE * length * slope) || now > -CURVATURE * slope)
            high = length;
        else if (now < CURVATURE * slope)
            low = length;
        else
            return true;
        length = isinf(high) ? 2 * length : 0.5 * (low + high);
    }
    return here < from;
}

static void remember(struct lbfgs *m)
{
    double *s = pair_s(m, m->pairs), *y = pair_y(m, m->pairs);
    for (size_t k = 0; k < m->n; k++) {
        s[k] = m->trial[k] - m->x[k];
        y[k] = m->trial_g[k] - m->g[k];
    }
    double curvature = dot(m->n, s, y);
    if (curvature > 0)
        *pair_rho(m, m->pairs++) = 1 / curvature;
}

/* The rate bounds the first step alone, which has no scale yet: no parameter moves by more. */
static bool step(void *method, const struct hnn_problem *problem, double rate, double *loss)
{
    struct lbfgs *m = method;
    double from = evaluate(m, problem, m->x, m->g, loss), largest = 0;
    find_direction(m);
    for (size_t k = 0; k < m->n; k++)
        largest = fmax(largest, fabs(m->direction[k]));
    if (search(m, problem, from, m->pairs ? 1 : rate / largest)) {
        remember(m);
        return true;
    }
    hnn_from_double(m->type, m->n, m->x, hnn_problem_point(problem));
    return false;
}

static uint64_t *count(void *method) { return &((struct lbfgs *)method)->pairs; }

static void *state(void *method, size_t *n, enum ad_type *type)
{
    struct lbfgs *m = method;
    *n = kept_size(m);
    *type = AD_F64;
    return m->kept;
}

const struct hnn_optimiser hnn_lbfgs = {
    "lbfgs", "full batch; needs f64 to go far", true, create, destroy, step, count, state};
