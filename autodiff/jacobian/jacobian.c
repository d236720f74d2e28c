/* Jacobians as programs (derivatives.h): each colour has a seed that is 1 for the columns, or rows,
   of that colour. A short program has the seeds of all colours; a long one runs once per colour,
   and all runs but the first recompute only what depends on the seed. Where whole rows of a
   variable have one colour, its seed is a column. */
#include "autodiff/derivatives.h"
#include "autodiff/exec/program.h"
#include "autodiff/gradient/sweep.h"
#include "jacobian.h"

#include <stdlib.h>
#include <string.h>

/* A variable in the program's memory. */
struct vector {
    void *data;
    size_t size;
};

/* An element of the results of some runs, and the matrix entry it gives. */
struct place {
    size_t element, entry;
};

enum {
    BATCH = 16,       /* colours whose results become entries together, row by row */
    MOST_NODES = 4096 /* of a program for all colours, beside those of y */
};

struct ad_jacobian {
    struct ad_sparse matrix;
    struct pattern pattern;
    double *value;
    ad_program *program;
    enum ad_type type;
    struct vector *seed, *result; /* n_seeds and n_results of each colour of a run */
    size_t n_seeds, n_results;
    size_t colours, at_once; /* colours of a run: one, or all */
    size_t *first_seed;      /* per colour, in: */
    size_t *seeds;           /* elements of the seeds that are 1 */
    size_t *first_entry;     /* per batch of colours, in: */
    struct place *entries;   /* where entries of the matrix come from */
    double *batch;           /* results of its colours, one behind the other */
    size_t results;          /* elements of one colour */
};

/* ---- recording ---- */

static void hold_inputs(ad_tape *tape, uint32_t end)
{
    for (uint32_t id = 0; id < end; id++)
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

static enum ad_status sweep_back(ad_var y, ad_var seed, size_t n, const ad_var x[], ad_var by[])
{
    seed = ad_broadcast(seed, ad_rows(y), ad_cols(y));
    return ad_sweep_back(y.tape, 1, &y, &seed, true, n, x, by);
}

/* The derivatives by one colour's seeds, one per x (forward) or one for y (backward). */
static bool record_colour(const ad_jacobian *J, ad_var y, size_t n, const ad_var x[], bool forward,
                          const size_t cols[], ad_var seed[], ad_var result[])
{
    for (size_t k = 0; k < J->n_seeds; k++)
        seed[k] = ad_input(y.tape, ad_rows(forward ? x[k] : y), cols[k], "seed");
    return y.tape->error.status == AD_OK &&
           (forward ? ad_sweep_forward(y.tape, true, n, x, seed, 1, &y, result)
                    : sweep_back(y, seed[0], n, x, result)) == AD_OK;
}

/* Seeds have so many columns. Inputs are held where the program runs several times. */
static bool record(ad_jacobian *J, ad_var y, size_t n, const ad_var x[], bool forward,
                   const size_t cols[])
{
    const uint32_t end = (uint32_t)y.tape->n_nodes;
    J->n_seeds = forward ? n : 1;
    J->n_results = forward ? 1 : n;
    size_t most = J->colours <= MOST_NODES ? J->colours : 1;
    ad_var *seed = calloc(most * J->n_seeds + 1, sizeof *seed);
    ad_var *result = calloc(most * J->n_results + 1, sizeof *result);
    bool done = seed && result && record_colour(J, y, n, x, forward, cols, seed, result);
    bool all = (y.tape->n_nodes - end) * J->colours <= MOST_NODES;
    J->at_once = all ? J->colours : 1;
    for (size_t d = 1; done && d < J->at_once; d++)
        done = record_colour(J, y, n, x, forward, cols, seed + d * J->n_seeds,
                             result + d * J->n_results);
    if (!all)
        hold_inputs(y.tape, end);
    done = done && ad_compile(y.tape, J->at_once * J->n_results, result, &J->program) == AD_OK;
    if (done) {
        J->seed = vectors(J->program, J->at_once * J->n_seeds, seed);
        J->result = vectors(J->program, J->at_once * J->n_results, result);
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

/* The elements of the seeds, and their colours. */
struct seeds {
    size_t *cols; /* per variable: 1, or those of the variable */
    size_t n;
    uint32_t *colour; /* [n] */
};

/* The colour of a row, UINT32_MAX where it has none; false if it has several. */
static bool colour_of_row(size_t cols, const uint32_t *colour, uint32_t *of)
{
    *of = UINT32_MAX;
    for (size_t c = 0; c < cols; c++) {
        if (colour[c] != UINT32_MAX && *of != UINT32_MAX && colour[c] != *of)
            return false;
        *of = colour[c] != UINT32_MAX ? colour[c] : *of;
    }
    return true;
}

/* Of n variables whose elements have these colours. */
static bool make_seeds(struct seeds *s, size_t n, const ad_var x[], const uint32_t *colour)
{
    size_t most = 0;
    for (size_t k = 0; k < n; k++)
        most += ad_rows(x[k]) * ad_cols(x[k]);
    s->cols = malloc((n + 1) * sizeof *s->cols);
    s->colour = malloc((most + 1) * sizeof *s->colour);
    for (size_t k = 0; s->cols && s->colour && k < n; k++) {
        size_t rows = ad_rows(x[k]), cols = ad_cols(x[k]), r = 0;
        while (r < rows && colour_of_row(cols, colour + r * cols, &s->colour[s->n + r]))
            r++;
        s->cols[k] = r == rows ? 1 : cols;
        if (r < rows)
            memcpy(s->colour + s->n, colour, rows * cols * sizeof *colour);
        s->n += rows * s->cols[k];
        colour += rows * cols;
    }
    return s->cols && s->colour;
}

/* By the colours of columns (forward) or rows. */
static bool plan(ad_jacobian *J, const struct seeds *s, const uint32_t *colour, bool forward)
{
    const struct pattern *p = &J->pattern;
    size_t entries = p->start[p->rows], seeds = s->n;
    J->results = forward ? p->rows : p->cols;
    J->first_seed = calloc(J->colours + 2, sizeof *J->first_seed);
    J->first_entry = calloc(J->colours + 2, sizeof *J->first_entry);
    J->seeds = malloc((seeds + 1) * sizeof *J->seeds);
    J->entries = malloc((entries + 1) * sizeof *J->entries);
    J->value = calloc(entries + 1, sizeof *J->value);
    J->batch =
        malloc(((J->colours < BATCH ? J->colours : BATCH) * J->results + 1) * sizeof *J->batch);
    if (!J->first_seed || !J->first_entry || !J->seeds || !J->entries || !J->value || !J->batch)
        return false;
    count(seeds, s->colour, J->first_seed + 1);
    for (size_t r = 0; r < p->rows; r++)
        for (size_t k = p->start[r]; k < p->start[r + 1]; k++)
            J->first_entry[colour[forward ? p->col[k] : r] / BATCH + 2]++;
    add_up(J->colours, J->first_seed + 1);
    add_up(J->colours, J->first_entry + 1);
    for (size_t k = 0; k < seeds; k++)
        if (s->colour[k] != UINT32_MAX)
            J->seeds[J->first_seed[s->colour[k] + 1]++] = k;
    for (size_t r = 0; r < p->rows; r++)
        for (size_t k = p->start[r]; k < p->start[r + 1]; k++) {
            size_t run = colour[forward ? p->col[k] : r];
            size_t element = run % BATCH * J->results + (forward ? r : p->col[k]);
            J->entries[J->first_entry[run / BATCH + 1]++] = (struct place){element, k};
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
    J->colours = *forward ? cols : rows;
    free(*forward ? by_row : by_col);
    return cols && rows;
}

/* ---- making ---- */

static bool make(ad_jacobian *J, ad_var y, size_t n, const ad_var x[])
{
    uint32_t *colour = NULL;
    struct seeds seeds = {.n = 0};
    bool forward;
    J->type = y.tape->type;
    bool done = ad_pattern_find(&J->pattern, y, n, x) && choose(J, &colour, &forward) &&
                make_seeds(&seeds, forward ? n : 1, forward ? x : &y, colour) &&
                plan(J, &seeds, colour, forward) && record(J, y, n, x, forward, seeds.cols);
    free(seeds.cols);
    free(seeds.colour);
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
    free(J->batch);
    free(J);
}

/* ---- running ---- */

ad_program *ad_jacobian_program(ad_jacobian *J) { return J ? J->program : NULL; }

size_t ad_jacobian_runs(const ad_jacobian *J) { return J ? J->colours : 0; }

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
    const struct vector *v = J->seed + colour % J->at_once * J->n_seeds;
    size_t first = 0;
    for (size_t k = J->first_seed[colour]; k < J->first_seed[colour + 1]; k++) {
        v = find(v, J->seeds[k], &first);
        if (J->type == AD_F64)
            ((double *)v->data)[J->seeds[k] - first] = value;
        else
            ((float *)v->data)[J->seeds[k] - first] = (float)value;
    }
}

/* Keeps the results of a colour, and writes the entries of a batch of colours. */
static void collect(ad_jacobian *J, size_t colour)
{
    const struct vector *v = J->result + colour % J->at_once * J->n_results;
    double *to = J->batch + colour % BATCH * J->results;
    for (size_t done = 0; done < J->results; done += v++->size)
        J->program->kernels->to_double(v->size, to + done, v->data);
    if (colour + 1 < J->colours && (colour + 1) % BATCH)
        return;
    size_t batch = colour / BATCH;
    for (size_t k = J->first_entry[batch]; k < J->first_entry[batch + 1]; k++)
        J->value[J->entries[k].entry] = J->batch[J->entries[k].element];
}

void ad_jacobian_run(ad_jacobian *J)
{
    for (size_t first = 0; J && first < J->colours; first += J->at_once) {
        const size_t end = first + J->at_once;
        for (size_t c = first; c < end; c++)
            set_seeds(J, c, 1);
        if (first == 0)
            ad_run(J->program);
        else
            ad_rerun(J->program);
        for (size_t c = first; c < end; c++) {
            collect(J, c);
            set_seeds(J, c, 0);
        }
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
