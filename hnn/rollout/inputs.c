/* Inputs of models along a motion (rollout.h): numbers, or columns of a table, linear in time or
   held from row to row. */
#include "autodiff/free.h"
#include "rollout.h"
#include "hnn/data/data_source.h"

#include <math.h>
#include <stdlib.h>

/* Times of motions are known to rounding. */
static const double slack = 1e-9;

enum ad_status hnn_inputs_at(void *context, double t, double *u, struct ad_error *error)
{
    if (AD_LACKS(error, context, u))
        return error->status;
    const struct hnn_inputs *s = context;
    const struct hnn_path *table = s->table;
    size_t low = 0, high = table ? table->n : 0;
    double part = 0;
    if (high) {
        double first = table->t[0], last = table->t[high - 1], room = slack * (last - first);
        if (!(t >= first - room && t <= last + room))
            return ad_fail(error, AD_E_INPUT, "inputs are known from t = %g to %g, not at %.9g",
                           first, last, t);
        while (high - low > 1) {
            size_t middle = low + (high - low) / 2;
            *(table->t[middle] <= t ? &low : &high) = middle;
        }
        if (!s->hold && low + 1 < table->n)
            part = (t - table->t[low]) / (table->t[low + 1] - table->t[low]);
    }
    for (size_t k = 0; k < s->n; k++) {
        const struct hnn_input *in = &s->input[k];
        u[k] = in->value;
        if (in->source == HNN_INPUT_TIME)
            u[k] = t;
        else if (in->source == HNN_INPUT_COLUMN) {
            const double *here = table->u + low * table->inputs + in->column;
            u[k] = part == 0 ? *here : *here + part * (here[table->inputs] - *here);
        }
    }
    return AD_OK;
}

/* A sum over rows of steps, or of changes of slope, that begin there: [rows x n]. */
ad_var hnn_inputs_record(void *context, size_t k, ad_var t)
{
    const struct hnn_inputs *s = context;
    if (!s || !t.tape || k >= s->n || s->input[k].source != HNN_INPUT_COLUMN)
        return (ad_var){0};
    const struct hnn_path *table = s->table;
    size_t rows = table->n;
    double *part = malloc(rows * sizeof *part);
    if (!part)
        return ad_refuse(t.tape, AD_E_MEMORY, "out of memory");
    const double *u = table->u + s->input[k].column, first = *u;
    double before = s->hold ? first : 0, begin = table->t[0], end = table->t[rows - 1];
    for (size_t i = 0; i < rows; i++, u += table->inputs) {
        double next = i + 1 < rows ? (u[table->inputs] - *u) / (table->t[i + 1] - table->t[i]) : 0;
        double now = s->hold ? *u : i + 1 < rows ? next : before;
        part[i] = now - before;
        before = now;
    }
    ad_var since = ad_sub(t, ad_const(t.tape, rows, 1, table->t));
    ad_var on = s->hold ? ad_ge(since, 0) : ad_relu(since);
    ad_var sum = ad_matmul(ad_const(t.tape, 1, rows, part), false, on, false);
    free(part);
    double room = slack * (end - begin);
    ad_var inside = ad_mul(ad_sub(t, begin - room), ad_sub(end + room, t));
    return ad_add(ad_add(sum, first), ad_mul(0.0, ad_sqrt(inside)));
}

bool hnn_inputs_constant(const struct hnn_inputs *inputs, size_t n)
{
    for (size_t k = 0; inputs && k < n && k < inputs->n; k++)
        for (size_t i = 1; inputs->input[k].source == HNN_INPUT_COLUMN && i < inputs->table->n;
             i++) {
            const double *u = inputs->table->u + inputs->input[k].column;
            if (u[i * inputs->table->inputs] != *u)
                return false;
        }
    return inputs != NULL;
}

/* Columns of blocks of rows, to rows of the path. */
static enum ad_status read_rows(struct hnn_source *source, const size_t *column,
                                struct hnn_path *path, struct ad_error *error)
{
    size_t m = path->inputs, rows = 1, room = 0;
    double **to = calloc(source->columns, sizeof *to);
    double *block = malloc((m + 1) * PHYS_CSV_ROWS * sizeof *block);
    if (!to || !block)
        ad_fail(error, AD_E_MEMORY, "%s: out of memory", source->file);
    for (size_t k = 0; to && block && k <= m; k++)
        to[column[k]] = block + k * PHYS_CSV_ROWS;
    while (rows && error->status == AD_OK &&
           source->kind->read(source, PHYS_CSV_ROWS, to, &rows, error) == AD_OK) {
        if (path->n + rows > room) {
            room = 2 * (path->n + rows);
            double *t = realloc(path->t, room * sizeof *t), *u;
            path->t = t ? t : path->t;
            u = realloc(path->u, room * m * sizeof *u);
            path->u = u ? u : path->u;
            if (!t || !u) {
                ad_fail(error, AD_E_MEMORY, "%s: out of memory", source->file);
                break;
            }
        }
        for (size_t i = 0; i < rows; i++, path->n++) {
            path->t[path->n] = to[column[0]][i];
            for (size_t k = 0; k < m; k++)
                path->u[path->n * m + k] = to[column[k + 1]][i];
        }
    }
    AD_FREE(to, block);
    return error->status;
}

enum ad_status hnn_inputs_read(const char *file, const char *time, const char *columns,
                               struct hnn_path *path, struct ad_error *error)
{
    struct hnn_source *source = NULL;
    size_t *t = NULL, *input = NULL, n = 0, m = 0, column[HNN_INPUTS_MOST + 1];
    if (path)
        *path = (struct hnn_path){0};
    if (AD_LACKS(error, file, time, columns, path))
        return error->status;
    if (hnn_source_open(file, 0, &source, error) == AD_OK &&
        hnn_choose(source, "time", time, &t, &n, error) == AD_OK &&
        hnn_choose(source, "inputs", columns, &input, &m, error) == AD_OK) {
        if (n != 1 || m > HNN_INPUTS_MOST)
            ad_fail(error, AD_E_ARGUMENT, "%s: inputs: expected a time and at most %d columns",
                    file, HNN_INPUTS_MOST);
        else
            column[0] = *t;
        for (size_t k = 0; k < m && error->status == AD_OK; k++)
            column[k + 1] = input[k];
        path->inputs = m;
        if (error->status == AD_OK)
            read_rows(source, column, path, error);
    }
    hnn_source_close(source);
    AD_FREE(t, input);
    for (size_t i = 0; i < path->n && error->status == AD_OK; i++)
        if (i && !(path->t[i] > path->t[i - 1]))
            ad_fail(error, AD_E_INPUT,
                    "%s: times of inputs: expected one motion, whose times increase, got %g and "
                    "then %g",
                    file, path->t[i - 1], path->t[i]);
    if (error->status == AD_OK && !path->n)
        ad_fail(error, AD_E_INPUT, "%s: expected rows of inputs, found none", file);
    if (error->status != AD_OK)
        hnn_path_free(path);
    return error->status;
}
