/* Jacobians as programs (derivatives.h): one run per colour, whose seed is 1 for the columns, or
   rows, of that colour. All runs but the first recompute only what depends on the seed. */
#include "autodiff/derivatives.h"
#include "autodiff/gradient/sweep.h"
#include "jacobian.h"

#include <stdlib.h>
#include <string.h>

/* A variable in the program's memory. */
struct vector {
    void *data;
    size_t size;
};

/* An element of the concatenated vectors, and the matrix entry it gives. */
struct place {
    size_t element, entry;
};

struct ad_jacobian {
    struct ad_sparse matrix;
    struct pattern pattern;
    double *value;
    ad_program *program;
    enum ad_type type;
    struct vector *seed, *result;
    size_t runs;
    size_t *first_seed, *first_entry; /* per run, in: */
    size_t *seeds;                    /* elements of the seeds that are 1 */
    struct place *entries;            /* where entries of the matrix come from */
};

/* ---- recording ---- */

static void hold_inputs(ad_tape *tape)
{
    for (uint32_t id = 0; id < tape->n_nodes; id++)
        if (node_at(tape, id)->op == AD_OP_input)
            node_at(tape, id)->flags |= NODE_HELD;
}

/* Where n variables lie. */
static struct vector *vectors(ad_program *program, size_t n, const ad_var x[])
{
    struct vector *v = calloc(n + 1, sizeof *v);
    for (size_t k = 0; v && k < n; k++)
        v[k] = (struct vector){ad_data(program, x[k]), ad_rows(x[k]) * ad_cols(x[k])};
    return v;
}

/* All inputs are held, except one seed per x (forward) or one for y (backward). */
static bool record(ad_jacobian *J, ad_var y, size_t n, const ad_var x[], bool forward)
{
    size_t n_seeds = forward ? n : 1, n_results = forward ? 1 : n;
    ad_var *seed = calloc(n + 1, sizeof *seed), *result = calloc(n + 1, sizeof *result);
    bool done = seed && result;
    hold_inputs(y.tape);
    for (size_t k = 0; done && k < n_seeds; k++) {
        ad_var of = forward ? x[k] : y;
        seed[k] = ad_input(y.tape, ad_rows(of), ad_cols(of), "seed");
    }
    done = done && y.tape->error.status == AD_OK &&
           (forward ? ad_sweep_forward(y.tape, true, n, x, seed, 1, &y, result)
                    : ad_sweep_back(y.tape, 1, &y, seed, true, n, x, result)) == AD_OK &&
           ad_compile(y.tape, n_results, result, &J->program) == AD_OK;
    if (done) {
        J->seed = vectors(J->program, n_seeds, seed);
        J->result = vectors(J->program, n_results, result);
    }
    free(seed);
    free(result);
    return done && J->seed && J->result;
}

/* ---- contents of each run ---- */

static void count(size_t n, const uint32_t *colour, size_t *first)
{
    for (size_t k = 0; k < n; k++)
        if (colour[k] != UINT32_MAX)
            first[colour[k] + 1]++;
}

static void add_up(size_t n, size_t *first)
{
    for (size_t k = 0; k < n; k++)
        first[k + 1] += first[k];
}

/* By the colours of columns (forward) or rows. */
static bool plan(ad_jacobian *J, const uint32_t *colour, bool forward)
{
    const struct pattern *p = &J->pattern;
    size_t entries = p->start[p->rows], seeds = forward ? p->cols : p->rows;
    J->first_seed = calloc(J->runs + 2, sizeof *J->first_seed);
    J->first_entry = calloc(J->runs + 2, sizeof *J->first_entry);
    J->seeds = malloc((seeds + 1) * sizeof *J->seeds);
    J->entries = malloc((entries + 1) * sizeof *J->entries);
    J->value = calloc(entries + 1, sizeof *J->value);
    if (!J->first_seed || !J->first_entry || !J->seeds || !J->entries || !J->value)
        return false;
    count(seeds, colour, J->first_seed + 1);
    for (size_t r = 0; r < p->rows; r++)
        for (size_t k = p->start[r]; k < p->start[r + 1]; k++)
            J->first_entry[colour[forward ? p->col[k] : r] + 2]++;
    add_up(J->runs, J->first_seed + 1);
    add_up(J->runs, J->first_entry + 1);
    for (size_t k = 0; k < seeds; k++)
        if (colour[k] != UINT32_MAX)
            J->seeds[J->first_seed[colour[k] + 1]++] = k;
    for (size_t r = 0; r < p->rows; r++)
        for (size_t k = p->start[r]; k < p->start[r + 1]; k++) {
            size_t run = colour[forward ? p->col[k] : r];
            J->entries[J->first_entry[run + 1]++] = (struct place){forward ? r : p->col[k], k};
        }
    J->matrix = (struct ad_sparse){p->rows, p->cols, p->start, p->col, J->value};
    return true;
}

/* Chooses the direction with fewer runs. */
static bool choose(ad_jacobian *J, uint32_t **colour, bool *forward)
{
    struct pattern t;
    const struct pattern *p = &J->pattern;
    if (!ad_pattern_transpose(p, &t))
        return false;
    uint32_t *by_col = malloc((p->cols + 1) * sizeof *by_col),
             *by_row = malloc((p->rows + 1) * sizeof *by_row);
    size_t cols = by_col ? ad_colour_columns(p, &t, by_col) : 0;
    size_t rows = by_row ? ad_colour_columns(&t, p, by_row) : 0;
    ad_pattern_free(&t);
    *forward = cols <= rows;
    *colour = *forward ? by_col : by_row;
    J->runs = *forward ? cols : rows;
    free(*forward ? by_row : by_col);
    return cols && rows;
}

/* ---- making ---- */

static bool make(ad_jacobian *J, ad_var y, size_t n, const ad_var x[])
{
    uint32_t *colour = NULL;
    bool forward;
    J->type = y.tape->type;
    bool done = ad_pattern_find(&J->pattern, y, n, x) && choose(J, &colour, &forward) &&
                plan(J, colour, forward) && record(J, y, n, x, forward);
    free(colour);
    return done;
}

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
        done = tape->error.status == AD_OK && make(J, of, n, at);
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
    ad_pattern_free(&J->pattern);
    free(J->value);
    free(J->seed);
    free(J->result);
    free(J->first_seed);
    free(J->first_entry);
    free(J->seeds);
    free(J->entries);
    free(J);
}

/* ---- running ---- */

ad_program *ad_jacobian_program(ad_jacobian *J) { return J ? J->program : NULL; }

size_t ad_jacobian_runs(const ad_jacobian *J) { return J ? J->runs : 0; }

const struct ad_sparse *ad_jacobian_matrix(const ad_jacobian *J) { return J ? &J->matrix : NULL; }

/* The vector that holds this element, and its first element; searched from the previous one on. */
static const struct vector *find(const struct vector *v, size_t element, size_t *first)
{
    for (; element - *first >= v->size; v++)
        *first += v->size;
    return v;
}

static void set_seeds(const ad_jacobian *J, size_t run, double value)
{
    const struct vector *v = J->seed;
    size_t first = 0;
    for (size_t k = J->first_seed[run]; k < J->first_seed[run + 1]; k++) {
        v = find(v, J->seeds[k], &first);
        if (J->type == AD_F64)
            ((double *)v->data)[J->seeds[k] - first] = value;
        else
            ((float *)v->data)[J->seeds[k] - first] = (float)value;
    }
}

static void collect(ad_jacobian *J, size_t run)
{
    const struct vector *v = J->result;
    size_t first = 0;
    for (size_t k = J->first_entry[run]; k < J->first_entry[run + 1]; k++) {
        const struct place *at = &J->entries[k];
        if (at->element < first) { /* of the next row: from the first vector on */
            v = J->result;
            first = 0;
        }
        v = find(v, at->element, &first);
        J->value[at->entry] = J->type == AD_F64
                                  ? ((const double *)v->data)[at->element - first]
                                  : (double)((const float *)v->data)[at->element - first];
    }
}

void ad_jacobian_run(ad_jacobian *J)
{
    for (size_t run = 0; J && run < J->runs; run++) {
        set_seeds(J, run, 1);
        if (run == 0)
            ad_run(J->program);
        else
            ad_rerun(J->program);
        collect(J, run);
        set_seeds(J, run, 0);
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
