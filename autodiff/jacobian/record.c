/* The program of a Jacobian: each colour has a seed that is 1 for the columns, or rows, of that
   colour. A short program has the sweeps of all colours, along constant seeds, so that what a
   colour does not reach is not computed; a long one has one sweep and runs once per colour. Where
   whole rows of a variable have one colour, its seed is a column. */
#include "autodiff/free.h"
#include "autodiff/exec/program.h"
#include "autodiff/gradient/sweep.h"
#include "jacobian.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_NODES = 4096, /* of a program for all colours, beside those of y */
    MOST_SEEDS = 1 << 24
};

/* The elements of the seeds, and their colours. */
struct seeds {
    const ad_var *of; /* the variables (forward), or y */
    size_t *cols;     /* of each: 1, or its own */
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
static bool make_seeds(struct seeds *s, size_t n, const uint32_t *colour)
{
    size_t most = 0;
    for (size_t k = 0; k < n; k++)
        most += ad_rows(s->of[k]) * ad_cols(s->of[k]);
    s->cols = malloc((n + 1) * sizeof *s->cols);
    s->colour = malloc((most + 1) * sizeof *s->colour);
    for (size_t k = 0; s->cols && s->colour && k < n; k++) {
        size_t rows = ad_rows(s->of[k]), cols = ad_cols(s->of[k]), r = 0;
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

/* The derivatives along the seeds of n variables x (forward), or of y. */
static bool sweep(const ad_jacobian *J, ad_var y, size_t n, const ad_var x[], const ad_var seed[],
                  ad_var result[])
{
    ad_tape *tape = y.tape;
    if (J->by.forward)
        return ad_sweep_forward(tape, true, n, x, seed, 1, &y, result) == AD_OK;
    ad_var whole = ad_broadcast(seed[0], ad_rows(y), ad_cols(y));
    return ad_sweep_back(tape, 1, &y, &whole, true, J->by.n, J->by.x, result) == AD_OK;
}

/* The derivatives of one colour. `x` has room for the variables with seeds of that colour and the
   seeds, `values` for the elements of one. */
static bool record_colour(const ad_jacobian *J, ad_var y, const struct seeds *s, uint32_t colour,
                          double *values, ad_var *x, ad_var result[])
{
    const uint32_t *colours = s->colour;
    ad_var *seed = x + J->n_seeds;
    size_t n = 0;
    for (size_t k = 0; k < J->n_seeds; k++) {
        const size_t rows = ad_rows(s->of[k]), size = rows * s->cols[k];
        bool any = false;
        for (size_t e = 0; e < size; e++) {
            values[e] = colours[e] == colour;
            any = any || colours[e] == colour;
        }
        colours += size;
        if (any || !J->by.forward) {
            x[n] = s->of[k];
            seed[n++] = ad_const(y.tape, rows, s->cols[k], values);
        }
    }
    return sweep(J, y, n, x, seed, result);
}

/* All colours in one program, while it is short. */
static bool record_at_once(const ad_jacobian *J, ad_var y, const struct seeds *s)
{
    const size_t end = y.tape->n_nodes;
    double *values = malloc((s->n + 1) * sizeof *values);
    ad_var *x = malloc((2 * J->n_seeds + 1) * sizeof *x);
    bool done = values && x;
    for (uint32_t c = 0; done && c < J->by.colours; c++)
        done = record_colour(J, y, s, c, values, x, J->result + c * J->n_results) &&
               y.tape->n_nodes - end <= MOST_NODES;
    AD_FREE(values, x);
    return done;
}

/* ---- results ---- */

ad_var ad_jacobian_source(ad_var x, size_t *at)
{
    const struct node *n = node_at(x.tape, x.id);
    for (; ad_is_view(n); n = node_at(x.tape, x.id)) {
        const struct elements of = ad_viewed_elements(x.tape, n);
        *at = element_at(&of, *at / n->cols, *at % n->cols);
        x.id = n->in[0];
    }
    return x;
}

/* x, or if it is a negated copy a copy of what is negated; a copy is at least as large. */
static ad_var negated_first(ad_var x)
{
    const struct node *n = node_at(x.tape, x.id), *copy = node_at(x.tape, n->in[0]);
    if (n->op != AD_OP_neg || !ad_is_view(copy) ||
        node_size(node_at(x.tape, copy->in[0])) > node_size(n))
        return x;
    struct node again = *copy;
    again.in[0] = ad_neg(ad_at(x.tape, copy->in[0])).id;
    again.flags = 0;
    return ad_append(x.tape, again);
}

/* Compiles n results, or what they are copies of. */
static bool compile_results(ad_jacobian *J, ad_tape *tape, size_t n)
{
    ad_var *source = malloc((n + 1) * sizeof *source);
    size_t first = 0;
    for (size_t k = 0; source && k < n; k++) {
        J->result[k] = negated_first(J->result[k]);
        source[k] = ad_jacobian_source(J->result[k], &first);
        first = 0;
    }
    bool done =
        source && tape->error.status == AD_OK && ad_compile(tape, n, source, &J->program) == AD_OK;
    free(source);
    return done;
}

/* ---- a run for each colour ---- */

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

static void add_up(size_t n, size_t *first)
{
    for (size_t k = 0; k < n; k++)
        first[k + 1] += first[k];
}

static bool find_seeds(ad_jacobian *J, const struct seeds *s)
{
    J->first_seed = calloc(J->by.colours + 2, sizeof *J->first_seed);
    J->seeds = malloc((s->n + 1) * sizeof *J->seeds);
    if (!J->first_seed || !J->seeds)
        return false;
    for (size_t k = 0; k < s->n; k++)
        if (s->colour[k] != UINT32_MAX)
            J->first_seed[s->colour[k] + 2]++;
    add_up(J->by.colours, J->first_seed + 1);
    for (size_t k = 0; k < s->n; k++)
        if (s->colour[k] != UINT32_MAX)
            J->seeds[J->first_seed[s->colour[k] + 1]++] = k;
    return true;
}

/* A program of one colour, run for each: its seeds are inputs, and the others are held. */
static bool compile_one(ad_jacobian *J, ad_var y, const struct seeds *s)
{
    ad_var *seed = calloc(J->n_seeds + 1, sizeof *seed);
    hold_inputs(y.tape);
    for (size_t k = 0; seed && k < J->n_seeds; k++)
        seed[k] = ad_input(y.tape, ad_rows(s->of[k]), s->cols[k], "seed");
    bool done = seed && y.tape->error.status == AD_OK &&
                sweep(J, y, J->by.n, J->by.x, seed, J->result) &&
                ad_compile(y.tape, J->n_results, J->result, &J->program) == AD_OK &&
                (J->seed = vectors(J->program, J->n_seeds, seed)) &&
                (J->one = vectors(J->program, J->n_results, J->result)) && find_seeds(J, s);
    free(seed);
    return done;
}

bool ad_jacobian_record(ad_jacobian *J, ad_var y)
{
    const size_t colours = J->by.colours;
    struct seeds s = {.of = J->by.forward ? J->by.x : &y};
    J->n_seeds = J->by.forward ? J->by.n : 1;
    J->n_results = J->by.forward ? 1 : J->by.n;
    J->result = calloc((colours <= MOST_NODES ? colours : 1) * J->n_results + 1, sizeof *J->result);
    bool done = J->result && make_seeds(&s, J->n_seeds, J->by.colour);
    J->at_once =
        done && colours <= MOST_NODES && colours * s.n <= MOST_SEEDS && record_at_once(J, y, &s);
    done =
        done && y.tape->error.status == AD_OK &&
        (J->at_once ? compile_results(J, y.tape, colours * J->n_results) : compile_one(J, y, &s));
    AD_FREE(s.cols, s.colour);
    return done;
}
