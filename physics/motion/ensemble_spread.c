/* Statistics of an ensemble at its times. Quantiles are interpolated between order statistics, at
   (n - 1) p (Hyndman and Fan, American Statistician 50 (1996) 361, definition 7). */
#include "ensemble_run.h"
#include "autodiff/exec/pool.h"

#include <math.h>
#include <stdlib.h>

const double phys_ensemble_quantile[PHYS_ENSEMBLE_QUANTILES] = {0.05, 0.25, 0.5, 0.75, 0.95};

struct spread_task {
    struct phys_ensemble *ensemble;
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
    double squares = 0;
    for (size_t i = 0; i < n; i++)
        s.mean += x[i] / (double)n;
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

static void at_time(void *context, size_t thread, size_t j)
{
    const struct spread_task *task = context;
    struct phys_ensemble *e = task->ensemble;
    const size_t quantities = 2 * e->dof + 1;
    double *values = task->values + thread * e->n;
    for (size_t k = 0; k < quantities; k++) {
        size_t n = 0;
        for (size_t i = 0; i < e->n; i++) {
            const size_t at = i * e->n_times + j;
            double x = k < 2 * e->dof ? e->x[at * 2 * e->dof + k] : e->energy[at];
            if (isfinite(x))
                values[n++] = x;
        }
        e->spread[j * quantities + k] = spread_of(n, values);
    }
}

enum ad_status phys_ensemble_spread(struct phys_ensemble *e, size_t threads, struct ad_error *error)
{
    struct spread_task task = {.ensemble = e,
                               .values = malloc(threads * e->n * sizeof *task.values)};
    if (!task.values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_parallel(threads, e->n_times, at_time, &task);
    free(task.values);
    return AD_OK;
}
