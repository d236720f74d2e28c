/* Paths, and measures of them (rollout.h). */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "rollout.h"
#include "hnn/data/data_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void hnn_path_free(struct hnn_path *path)
{
    if (!path)
        return;
    AD_FREE(path->t, path->x, path->u);
    *path = (struct hnn_path){0};
}

void hnn_times(double t0, double t1, size_t n, double *t)
{
    for (size_t i = 0; t && i < n; i++)
        t[i] = t0 + (t1 - t0) * ((double)i / (double)(n - 1));
}

/* ---- from a file ---- */

static enum ad_status copy_rows(const struct hnn_table *table, size_t first, size_t n,
                                struct hnn_path *path, struct ad_error *error)
{
    size_t states = table->plan.components;
    path->t = malloc(n * sizeof *path->t);
    path->x = malloc(states * n * sizeof *path->x);
    path->inputs = table->plan.inputs;
    path->u = malloc(n * (path->inputs + 1) * sizeof *path->u);
    if (!path->t || !path->x || !path->u)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", table->file);
    path->states = states;
    path->n = n;
    memcpy(path->t, hnn_table_column(table, table->plan.time) + first, n * sizeof *path->t);
    for (size_t k = 0; k < path->inputs; k++)
        for (size_t i = 0; i < n; i++)
            path->u[i * path->inputs + k] =
                hnn_table_column(table, table->plan.input[k])[first + i];
    for (size_t k = 0; k < states; k++) {
        const double *column = hnn_table_column(table, table->plan.state[k]) + first;
        for (size_t i = 0; i < n; i++)
            path->x[i * states + k] = column[i];
    }
    return AD_OK;
}

/* The motion continues from this row to the next: with a column that distinguishes trajectories,
   gaps lie within one; otherwise they may lie between two. */
static bool goes_on(const struct hnn_table *table, size_t next)
{
    return table->plan.trial != HNN_NO_COLUMN ? !hnn_table_begins(table, next)
                                              : hnn_table_follows(table, next);
}

static enum ad_status choose_rows(const struct hnn_table *table, double from, double time,
                                  struct hnn_path *path, struct ad_error *error)
{
    const double *t = hnn_table_column(table, table->plan.time);
    size_t first = 0, end;
    while (first < table->rows && t[first] < from)
        first++;
    double begin = fmax(from, t[0]), to = begin + time;
    for (end = first; end < table->rows && t[end] <= to; end++)
        if (end > first && !goes_on(table, end))
            break;
    if (end - first < 2)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected two or more rows of a trajectory from t = %g to %g, found "
                       "%zu; the last row is at t = %g",
                       table->file, begin, to, end - first, t[table->rows - 1]);
    if (isfinite(time) && t[end - 1] + table->longest < to)
        return ad_fail(error, AD_E_INPUT,
                       "%s: the trajectory at t = %g ends at t = %g, %s; expected a time of at "
                       "most %g, got %g",
                       table->file, t[first], t[end - 1],
                       end < table->rows ? "where another one or a gap begins" : "as the file does",
                       t[end - 1] - begin, time);
    return copy_rows(table, first, end - first, path, error);
}

enum ad_status hnn_path_read(const struct hnn_dataset_settings *settings, double from, double time,
                             struct hnn_path *path, struct ad_error *error)
{
    if (path)
        *path = (struct hnn_path){0};
    if (AD_LACKS(error, settings, path, settings->file))
        return error->status;
    AD_OWN(hnn_dataset_settings, settings, seed, error);
    struct hnn_dataset_settings s = {.size = sizeof s,
                                     .file = settings->file,
                                     .state = settings->state,
                                     .time = settings->time,
                                     .trial = settings->trial,
                                     .skip_missing = settings->skip_missing,
                                     .skip_rows = settings->skip_rows,
                                     .inputs = settings->inputs,
                                     .rollout = 1}; /* no rates are needed */
    struct hnn_table table = {0};
    *path = (struct hnn_path){0};
    if (!s.time)
        return ad_fail(error, AD_E_ARGUMENT, "%s: a trajectory needs a time column", s.file);
    if (hnn_table_read(&s, s.file, NULL, &table, error) == AD_OK)
        choose_rows(&table, from, time, path, error);
    hnn_table_free(&table);
    if (error->status != AD_OK)
        hnn_path_free(path);
    return error->status;
}

/* ---- measures ---- */

static bool comparable(const struct hnn_path *a, const struct hnn_path *b)
{
    return a && b && a->n == b->n && a->states == b->states;
}

double hnn_path_square(const struct hnn_path *a, const struct hnn_path *b, size_t i)
{
    if (!comparable(a, b) || i >= a->n)
        return NAN;
    double sum = 0;
    for (size_t k = i * a->states; k < (i + 1) * a->states; k++)
        sum += (a->x[k] - b->x[k]) * (a->x[k] - b->x[k]);
    return sum / (double)a->states;
}

double hnn_path_mse(const struct hnn_path *a, const struct hnn_path *b)
{
    if (!comparable(a, b))
        return NAN;
    double sum = 0;
    for (size_t i = 0; i < a->n; i++)
        sum += hnn_path_square(a, b, i);
    return sum / (double)a->n;
}

double hnn_path_energy(const struct phys_ode *ode, const struct hnn_path *path, size_t i)
{
    if (!ode || !path || i >= path->n || path->states != ode->n)
        return NAN;
    const double *y = path->x + i * path->states;
    return ode->energy ? ode->energy(ode->context, path->t[i], y) : (double)NAN;
}

double hnn_energy_mse(const struct phys_ode *ode, const struct hnn_path *a,
                      const struct hnn_path *b)
{
    if (!comparable(a, b))
        return NAN;
    double sum = 0;
    for (size_t i = 0; i < a->n; i++) {
        double d = hnn_path_energy(ode, a, i) - hnn_path_energy(ode, b, i);
        sum += d * d;
    }
    return sum / (double)a->n;
}

double hnn_energy_drift(const struct phys_ode *ode, const struct hnn_path *path,
                        const struct hnn_rollout_settings *settings)
{
    if (!ode || !path || !settings)
        return NAN;
    double most = ode->energy ? 0 : (double)NAN;
    double start = hnn_path_energy(ode, path, 0);
    for (size_t i = 1; i < path->n; i++) {
        double added = path->t[i] > settings->add_at ? settings->add : 0;
        most = fmax(most, fabs(hnn_path_energy(ode, path, i) - start - added));
    }
    return most;
}
