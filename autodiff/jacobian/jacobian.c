/* Jacobians and Hessians (derivatives.h): which elements of the results of the runs are terms of
   which entries, and the runs. */
#include "autodiff/free.h"
#include "autodiff/derivatives.h"
#include "autodiff/exec/program.h"
#include "jacobian.h"

#include <stdlib.h>
#include <string.h>

enum { BATCH = 16 }; /* runs whose results become entries together, row by row */

/* ---- terms ---- */

/* The result an element of one colour lies in, and its place there. */
struct where {
    uint32_t result, at;
};

static struct where *find_elements(const ad_jacobian *J)
{
    struct where *where = malloc((J->results + 1) * sizeof *where), *to = where;
    for (uint32_t k = 0; where && k < J->n_results; k++)
        for (uint32_t at = 0; at < ad_rows(J->result[k]) * ad_cols(J->result[k]); at++)
            *to++ = (struct where){k, at};
    return where;
}

/* The place of element `at` of a colour: in the batch, or in the program's memory. */
static size_t place_of(const ad_jacobian *J, size_t colour, const struct where *where, size_t at)
{
    if (!J->at_once)
        return colour % BATCH * J->results + at;
    size_t element = where[at].at;
    ad_var source =
        ad_jacobian_source(J->result[colour * J->n_results + where[at].result], &element);
    return (size_t)((char *)ad_data(J->program, source) - J->program->memory) /
               J->program->element +
           element;
}

/* The entry of row r in this column of the matrix. */
static size_t find_entry(const struct pattern *p, size_t r, uint32_t column)
{
    size_t k = p->start[r];
    while (p->col[k] != column)
        k++;
    return k;
}

/* Visits the terms of the matrix by rows, and counts those of each batch (where is NULL), or writes
   them. */
static void visit_terms(ad_jacobian *J, const struct where *where)
{
    const struct directions *d = &J->by;
    const struct pattern *p = d->column ? &d->computed : &d->pattern;
    for (size_t r = 0; r < p->rows; r++)
        for (size_t k = p->start[r]; k < p->start[r + 1]; k++) {
            const size_t c = p->col[k], colour = d->colour[d->forward ? c : r];
            const size_t batch = J->at_once ? 0 : colour / BATCH;
            if (!where) {
                J->first_term[batch + 2]++;
                continue;
            }
            const size_t entry = d->column ? find_entry(&d->pattern, r, d->column[c]) : k;
            const size_t element = place_of(J, colour, where, d->forward ? r : c);
            const size_t term = J->entry ? J->first_term[batch + 1]++ : entry;
            J->term[term] = (uint32_t)element;
            if (J->entry)
                J->entry[term] = (uint32_t)entry;
        }
}

static bool find_terms(ad_jacobian *J)
{
    const struct directions *d = &J->by;
    const struct pattern *p = &d->pattern;
    const size_t entries = p->start[p->rows], batches = J->at_once ? 1 : d->colours / BATCH + 1;
    const size_t terms = d->column ? d->computed.start[p->rows] : entries;
    const size_t width = d->colours < BATCH ? d->colours : BATCH;
    J->results = d->forward ? p->rows : d->column ? d->computed.cols : p->cols;
    J->adds = terms > entries;
    J->first_term = calloc(batches + 2, sizeof *J->first_term);
    J->term = malloc((terms + 1) * sizeof *J->term);
    bool in_order = J->at_once && !J->adds;
    J->entry = in_order ? NULL : malloc((terms + 1) * sizeof *J->entry);
    J->value = calloc(entries + 1, sizeof *J->value);
    J->batch = J->at_once ? NULL : malloc((width * J->results + 1) * sizeof *J->batch);
    struct where *where = find_elements(J);
    const size_t most =
        J->at_once ? J->program->memory_bytes / J->program->element : width * J->results;
    bool done = J->first_term && J->term && (J->entry || in_order) && J->value &&
                (J->batch || J->at_once) && where && most <= UINT32_MAX && entries <= UINT32_MAX;
    if (done) {
        visit_terms(J, NULL);
        for (size_t b = 1; b <= batches; b++)
            J->first_term[b + 1] += J->first_term[b];
        visit_terms(J, where);
        if (in_order)
            J->first_term[1] = terms;
        J->matrix = (struct ad_sparse){p->rows, p->cols, p->start, p->col, J->value};
    }
    free(where);
    return done;
}

/* ---- making ---- */

/* The gradient, as a column. */
static ad_var gradient(ad_var y, size_t n, const ad_var x[])
{
    ad_var *g = calloc(n + 1, sizeof *g), all = ad_at(y.tape, 0);
    if (!g)
        return ad_refuse(y.tape, AD_E_MEMORY, "jacobian: out of memory");
    if (ad_grad(y, n, x, g) == AD_OK) {
        for (size_t k = 0; k < n; k++)
            g[k] = ad_reshape(g[k], ad_rows(g[k]) * ad_cols(g[k]), 1);
        all = ad_concat_rows(n, g);
    }
    free(g);
    return all;
}

static bool can_derive(ad_var y, size_t n, const ad_var x[])
{
    ad_var none;
    if (!ad_operands(AD_COMPOSITE_jacobian, 1, &y, &none))
        return false;
    if (!n || !x)
        ad_refuse(y.tape, AD_E_ARGUMENT, "jacobian: got no variables; expected at least one");
    return n && x && ad_all_on(y.tape, AD_COMPOSITE_jacobian, "x", n, x);
}

static enum ad_status new_jacobian(ad_var y, size_t n, const ad_var x[], bool of_gradient,
                                   ad_jacobian **jacobian)
{
    if (!jacobian)
        return AD_E_ARGUMENT;
    *jacobian = NULL;
    if (!can_derive(y, n, x))
        return y.tape ? y.tape->error.status : AD_E_TAPE;
    ad_var *at = calloc(n + 1, sizeof *at);
    ad_tape *tape = ad_tape_copy(y.tape);
    ad_jacobian *J = calloc(1, sizeof *J);
    bool done = tape && J && at;
    for (size_t k = 0; done && k < n; k++)
        at[k] = ad_at(tape, x[k].id);
    if (done) {
        ad_var of = of_gradient ? gradient(ad_at(tape, y.id), n, at) : ad_at(tape, y.id);
        J->type = tape->type;
        done = tape->error.status == AD_OK && ad_directions_choose(&J->by, of, n, at) &&
               ad_jacobian_record(J, of) && find_terms(J);
    }
    if (!done) {
        bool known = tape && tape->error.status != AD_OK;
        ad_fail(&y.tape->error, known ? tape->error.status : AD_E_MEMORY, "%s",
                known ? tape->error.message : "jacobian: out of memory");
        ad_jacobian_free(J);
        J = NULL;
    }
    ad_tape_free(tape);
    free(at);
    *jacobian = J;
    return y.tape->error.status;
}

enum ad_status ad_jacobian_new(ad_var y, size_t n, const ad_var x[], ad_jacobian **jacobian)
{
    return new_jacobian(y, n, x, false, jacobian);
}

enum ad_status ad_hessian_new(ad_var y, size_t n, const ad_var x[], ad_jacobian **hessian)
{
    return new_jacobian(y, n, x, true, hessian);
}

void ad_jacobian_free(ad_jacobian *J)
{
    if (!J)
        return;
    ad_program_free(J->program);
    ad_directions_free(&J->by);
    AD_FREE(J->value, J->seed, J->result, J->first_seed, J->seeds, J->first_term, J->term, J->entry,
            J->one, J->batch, J);
}

/* ---- running ---- */

ad_program *ad_jacobian_program(ad_jacobian *J) { return J ? J->program : NULL; }

size_t ad_jacobian_runs(const ad_jacobian *J) { return J ? J->by.colours : 0; }

const struct ad_sparse *ad_jacobian_matrix(const ad_jacobian *J) { return J ? &J->matrix : NULL; }

/* The vector that holds this element, and its first element; searched from the previous one on. */
static const struct vector *find(const struct vector *v, size_t element, size_t *first)
{
    for (; element - *first >= v->size; v++)
        *first += v->size;
    return v;
}

static void set_seeds(const ad_jacobian *J, size_t colour, double value)
{
    const struct vector *v = J->seed;
    size_t first = 0;
    for (size_t k = J->first_seed[colour]; k < J->first_seed[colour + 1]; k++) {
        v = find(v, J->seeds[k], &first);
        if (J->type == AD_F64)
            ((double *)v->data)[J->seeds[k] - first] = value;
        else
            ((float *)v->data)[J->seeds[k] - first] = (float)value;
    }
}

/* Adds up the terms of a batch; `from` is of double or float. */
static void take_terms(ad_jacobian *J, size_t batch, bool wide, const void *from)
{
    const double *doubles = from;
    const float *floats = from;
    const size_t first = J->first_term[batch], end = J->first_term[batch + 1];
    double *value = J->value;
    if (J->adds && batch == 0)
        memset(value, 0, J->matrix.start[J->matrix.rows] * sizeof *value);
    if (!J->entry && wide)
        for (size_t k = first; k < end; k++)
            value[k] = doubles[J->term[k]];
    else
        for (size_t k = first; k < end; k++) {
            const double v = wide ? doubles[J->term[k]] : (double)floats[J->term[k]];
            const size_t entry = J->entry ? J->entry[k] : k;
            value[entry] = J->adds ? value[entry] + v : v;
        }
}

/* Keeps the results of a run, and takes the terms of a batch of them. */
static void collect(ad_jacobian *J, size_t colour)
{
    double *to = J->batch + colour % BATCH * J->results;
    for (size_t k = 0; k < J->n_results; to += J->one[k++].size)
        J->program->kernels->to_double(J->one[k].size, to, J->one[k].data);
    if (colour + 1 == J->by.colours || (colour + 1) % BATCH == 0)
        take_terms(J, colour / BATCH, true, J->batch);
}

void ad_jacobian_run(ad_jacobian *J)
{
    if (J && J->at_once) {
        ad_run(J->program);
        take_terms(J, 0, J->type == AD_F64, J->program->memory);
        return;
    }
    for (size_t c = 0; J && c < J->by.colours; c++) {
        set_seeds(J, c, 1);
        if (c == 0)
            ad_run(J->program);
        else
            ad_rerun(J->program);
        collect(J, c);
        set_seeds(J, c, 0);
    }
}

void ad_jacobian_dense(const ad_jacobian *J, double *values)
{
    if (!J || !values)
        return;
    const struct ad_sparse *m = &J->matrix;
    memset(values, 0, m->rows * m->cols * sizeof *values);
    for (size_t r = 0; r < m->rows; r++)
        for (size_t k = m->start[r]; k < m->start[r + 1]; k++)
            values[r * m->cols + m->col[k]] = m->value[k];
}
