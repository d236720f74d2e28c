/* Limited-memory BFGS descent of the action (Nocedal, Wright, Numerical Optimization, 2nd ed.,
   algorithms 7.4 and 7.5) with the strong Wolfe conditions found by bracketing. */
#include "path_program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY = 10, TRIALS = 40 };

static const double DECREASE = 1e-4, CURVATURE = 0.9;

struct lbfgs {
    struct phys_path_program path;
    size_t n, pairs; /* pairs taken so far */
    double *x, *g, *direction;
    double *s[MEMORY], *y[MEMORY], rho[MEMORY];
    double *work;
};

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += a[k] * b[k];
    return sum;
}

static enum ad_status lbfgs_new(struct lbfgs *m, const struct phys_system *system,
                                const struct phys_path_settings *settings, const double *path,
                                struct ad_error *error)
{
    if (phys_path_program_new(&m->path, system, settings, path, error) != AD_OK)
        return error->status;
    size_t n = m->n = m->path.n;
    m->work = malloc((3 + 2 * MEMORY) * n * sizeof *m->work);
    if (!m->work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    m->x = m->work;
    m->g = m->work + n;
    m->direction = m->work + 2 * n;
    for (size_t k = 0; k < MEMORY; k++) {
        m->s[k] = m->work + (3 + 2 * k) * n;
        m->y[k] = m->work + (4 + 2 * k) * n;
    }
    return AD_OK;
}

/* direction = -B g by the two-loop recursion over the pairs kept. */
static void find_direction(struct lbfgs *m)
{
    size_t n = m->n, kept = m->pairs < MEMORY ? m->pairs : MEMORY;
    double alpha[MEMORY] = {0};
    for (size_t k = 0; k < n; k++)
        m->direction[k] = -m->g[k];
    for (size_t j = 0; j < kept; j++) {
        size_t i = (m->pairs - 1 - j) % MEMORY;
        alpha[i] = m->rho[i] * dot(n, m->s[i], m->direction);
        for (size_t k = 0; k < n; k++)
            m->direction[k] -= alpha[i] * m->y[i][k];
    }
    if (kept) {
        size_t i = (m->pairs - 1) % MEMORY;
        double gamma = 1 / (m->rho[i] * dot(n, m->y[i], m->y[i]));
        for (size_t k = 0; k < n; k++)
            m->direction[k] *= gamma;
    }
    for (size_t j = kept; j-- > 0;) {
        size_t i = (m->pairs - 1 - j) % MEMORY;
        double beta = m->rho[i] * dot(n, m->y[i], m->direction);
        for (size_t k = 0; k < n; k++)
            m->direction[k] += (alpha[i] - beta) * m->s[i][k];
    }
}

static void move(struct lbfgs *m, double length, size_t number, struct phys_path_step *at)
{
    for (size_t k = 0; k < m->n; k++)
        m->path.x[k] = m->x[k] + length * m->direction[k];
    *at = phys_path_program_run(&m->path, number);
}

/* Finds a length between what is too short and what is too long; doubles until something is. */
static bool search(struct lbfgs *m, double length, struct phys_path_step *at)
{
    double from = at->objective, slope = dot(m->n, m->g, m->direction), low = 0;
    double high = (double)INFINITY;
    size_t number = at->step + 1;
    if (!(slope < 0))
        return false;
    for (int trial = 0; trial < TRIALS; trial++) {
        move(m, length, number, at);
        double here = dot(m->n, m->path.g, m->direction);
        if (!(at->objective <= from + DECREASE * length * slope) || here > -CURVATURE * slope)
            high = length;
        else if (here < CURVATURE * slope)
            low = length;
        else
            return true;
        length = isinf(high) ? 2 * length : 0.5 * (low + high);
    }
    return at->objective < from;
}

static void remember(struct lbfgs *m)
{
    double *s = m->s[m->pairs % MEMORY], *y = m->y[m->pairs % MEMORY];
    for (size_t k = 0; k < m->n; k++) {
        s[k] = m->path.x[k] - m->x[k];
        y[k] = m->path.g[k] - m->g[k];
    }
    double curvature = dot(m->n, s, y);
    if (curvature > 0)
        m->rho[m->pairs++ % MEMORY] = 1 / curvature;
}

/* One step. False, and the path where it was, if the objective falls no further. */
static bool improve(struct lbfgs *m, struct phys_path_step *at)
{
    size_t bytes = m->n * sizeof *m->x, number = at->step;
    memcpy(m->x, m->path.x, bytes);
    memcpy(m->g, m->path.g, bytes);
    find_direction(m);
    double largest = 0;
    for (size_t k = 0; k < m->n; k++)
        largest = fmax(largest, fabs(m->direction[k]));
    /* the first step has no scale yet: no coordinate moves by more than the learning rate */
    double length = m->pairs ? 1 : m->path.settings->learning_rate / largest;
    if (search(m, length, at)) {
        remember(m);
        return true;
    }
    memcpy(m->path.x, m->x, bytes);
    *at = phys_path_program_run(&m->path, number);
    return false;
}

static enum ad_status iterate(struct lbfgs *m, double *path, struct phys_path_info *info,
                              struct ad_error *error)
{
    struct phys_path_step at = phys_path_program_run(&m->path, 0);
    enum phys_stop stop = 0;
    for (;;) {
        if (phys_path_program_finite(&m->path, &at, error) != AD_OK)
            return error->status;
        if (!stop)
            stop = phys_path_program_report(&m->path, &at);
        if (stop)
            break;
        if (at.grad_norm == 0)
            stop = PHYS_STOP_ROUNDING;
        else if (!improve(m, &at))
            stop = PHYS_STOP_STALLED;
    }
    phys_path_program_end(&m->path, stop, &at, path, info);
    return AD_OK;
}

static enum ad_status solve(const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error)
{
    struct lbfgs m = {0};
    if (lbfgs_new(&m, system, settings, path, error) == AD_OK &&
        phys_path_program_adam(&m.path, error) == AD_OK)
        iterate(&m, path, info, error);
    free(m.work);
    phys_path_program_free(&m.path);
    return error->status;
}

const struct phys_solver phys_solver_lbfgs = {
    "lbfgs", "descent of the action by limited-memory BFGS", solve, false};
