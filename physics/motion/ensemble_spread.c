/* Statistics of an ensemble at its times. Quantiles are interpolated between order statistics, at
   (n - 1) p (Hyndman and Fan, American Statistician 50 (1996) 361, definition 7). */
#include "ensemble_run.h"
#include "autodiff/exec/pool.h"

#include <math.h>
#include <stdlib.h>

const double phys_ensemble_quantile[PHYS_ENSEMBLE_QUANTILES] = {0.05, 0.25, 0.5, 0.75, 0.95};

struct spread_task {
    const struct ensemble_task *task;
    double *values; /* [threads][n] */
};

/* Moves what is less than the pivot, or equal to it, to the front: how many these are. Without a
   branch that depends on x, which could not be predicted. */
static size_t part(double *x, size_t n, double pivot, bool equal)
{
    size_t front = 0;
    for (size_t i = 0; i < n; i++) {
        const double y = x[i];
        x[i] = x[front];
        x[front] = y;
        front += equal ? y <= pivot : y < pivot;
    }
    return front;
}

/* Sorts x [n], whose first is number `first` of all, as far as to have those of the n_wanted
   ascending numbers in their places: by quicksort of the parts that contain one. */
static void sort_at(double *x, size_t first, size_t n, size_t n_wanted, const size_t *wanted)
{
    while (n > 1 && n_wanted > 0) {
        const double a = x[0], b = x[n / 2], c = x[n - 1];
        const double pivot = fmax(fmin(a, b), fmin(fmax(a, b), c));
        size_t low = part(x, n, pivot, false), below = 0;
        if (low == 0)
            low = part(x, n, pivot, true); /* all of them are in their places */
        while (below < n_wanted && wanted[below] < first + low)
            below++;
        sort_at(x, first, x[0] < pivot ? low : 0, below, wanted);
        x += low;
        first += low;
        n -= low;
        wanted += below;
        n_wanted -= below;
    }
}

static struct phys_spread spread_of(size_t n, double *x)
{
    struct phys_spread s = {.n = n, .mean = n ? 0 : (double)NAN};
    double squares = 0, rest = 0;
    for (size_t i = 0; i < n; i++)
        s.mean += x[i] / (double)n;
    for (size_t i = 0; i < n; i++) /* what rounding of the sum left */
        rest += x[i] - s.mean;
    s.mean += n ? rest / (double)n : 0;
    for (size_t i = 0; i < n; i++)
        squares += (x[i] - s.mean) * (x[i] - s.mean);
    s.deviation = n > 1 ? sqrt(squares / (double)(n - 1)) : (double)NAN;
    size_t wanted[2 * PHYS_ENSEMBLE_QUANTILES], n_wanted = 0;
    for (size_t k = 0; n > 0 && k < PHYS_ENSEMBLE_QUANTILES; k++) {
        size_t i = (size_t)((double)(n - 1) * phys_ensemble_quantile[k]);
        wanted[n_wanted++] = i;
        wanted[n_wanted++] =
            i + 1 < n ? i + 1 : i; /* of few numbers not ascending, but there before */
    }
    sort_at(x, 0, n, n_wanted, wanted);
    for (size_t k = 0; k < PHYS_ENSEMBLE_QUANTILES; k++) {
        double at = (double)(n - 1) * phys_ensemble_quantile[k];
        const double *y = n ? &x[wanted[2 * k]] : NULL, *z = n ? &x[wanted[2 * k + 1]] : NULL;
        s.quantile[k] = n ? *y + (at - floor(at)) * (*z - *y) : (double)NAN;
    }
    return s;
}

const double *phys_ensemble_end(const struct ensemble_task *task, size_t i, double *t)
{
    const struct phys_ensemble *e = task->ensemble;
    const struct phys_motion_settings *s = task->settings->motion;
    const struct phys_member *m = &e->member[i];
    const struct phys_crossed *c = &m->crossed;
    bool until = false;
    for (size_t k = 0; k < s->n_crossings; k++)
        until |= s->crossings[k].last;
    *t = until && c->n ? c->t[c->n - 1] : e->t[e->n_times - 1];
    if (!phys_member_complete(m) ||
        (until && !(c->n > 0 && s->crossings[(size_t)c->which[c->n - 1] - 1].last)))
        return NULL;
    return until ? c->x + (c->n - 1) * 2 * e->dof : e->x + ((i + 1) * e->n_times - 1) * 2 * e->dof;
}

/* Of member i at time j, NaN where it has not come that far; j = n_times: at its end. */
static double value_at(const struct ensemble_task *task, size_t i, size_t j, size_t k)
{
    const struct phys_ensemble *e = task->ensemble;
    const size_t states = 2 * e->dof, at = i * e->n_times + j;
    double t;
    const double *x = j < e->n_times ? e->x + at * states : phys_ensemble_end(task, i, &t);
    if (!x)
        return (double)NAN;
    if (k > states)
        return t;
    return k < states ? x[k] : j < e->n_times ? e->energy[at] : e->energy[e->n * e->n_times + i];
}

static void at_time(void *context, size_t thread, size_t j)
{
    const struct spread_task *task = context;
    struct phys_ensemble *e = task->task->ensemble;
    const size_t quantities = 2 * e->dof + 1;
    double *values = task->values + thread * e->n;
    for (size_t k = 0; k < quantities + (j == e->n_times); k++) {
        size_t n = 0;
        for (size_t i = 0; i < e->n; i++) {
            const double x = value_at(task->task, i, j, k);
            if (isfinite(x))
                values[n++] = x;
        }
        e->spread[j * quantities + k] = spread_of(n, values);
    }
}

enum ad_status phys_ensemble_spread(const struct ensemble_task *all, size_t threads,
                                    struct ad_error *error)
{
    const struct phys_ensemble *e = all->ensemble;
    struct spread_task task = {.task = all, .values = malloc(threads * e->n * sizeof *task.values)};
    if (!task.values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_parallel(threads, e->n_times + 1, at_time, &task);
    free(task.values);
    return AD_OK;
}
