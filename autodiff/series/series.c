/* Series of a recording: what is needed of it, element by element (series.h). */
#include "autodiff/free.h"
#include "internal.h"

#include <math.h>
#include <stdlib.h>

/* The nodes on the way from x to y. */
struct builder {
    const ad_tape *tape;
    struct jet_builder jets;
    uint32_t end;
    bool *needed;
    jet **at; /* elements of the nodes, into `elements` */
    jet *elements;
};

static bool mark(struct builder *b, size_t n_y, const ad_var y[])
{
    b->end = 0;
    for (size_t k = 0; k < n_y; k++)
        b->end = y[k].id + 1 > b->end ? y[k].id + 1 : b->end;
    b->needed = calloc(b->end, sizeof *b->needed);
    b->at = calloc(b->end, sizeof *b->at);
    if (!b->needed || !b->at)
        return false;
    for (size_t k = 0; k < n_y; k++)
        b->needed[y[k].id] = true;
    size_t elements = 0;
    for (uint32_t id = b->end; id-- > 0;) {
        const struct node *n = node_at(b->tape, id);
        for (size_t k = 0; b->needed[id] && k < n_inputs(b->tape, n); k++)
            b->needed[input_of(b->tape, n, k)] = true;
        elements += b->needed[id] ? node_size(n) : 0;
    }
    b->elements = malloc((elements + 1) * sizeof *b->elements);
    jet *at = b->elements;
    for (uint32_t id = 0; b->elements && id < b->end; id++)
        if (b->needed[id]) {
            b->at[id] = at;
            at += node_size(node_at(b->tape, id));
        }
    return b->elements;
}

/* Inputs are the first jets, all of them, in the order of x. */
static enum ad_status put_inputs(struct builder *b, ad_tape *tape, size_t n_x, const ad_var x[])
{
    struct ad_series *s = b->jets.series;
    bool is_new;
    for (size_t k = 0; k < n_x; k++) {
        const struct node *n = node_at(tape, x[k].id);
        if (n->op != AD_OP_input)
            return ad_refuse(tape, AD_E_ARGUMENT, "series: x[%zu] is no input", k), AD_E_ARGUMENT;
        for (size_t j = 0; j < k; j++)
            if (x[j].id == x[k].id)
                return ad_refuse(tape, AD_E_ARGUMENT, "series: x[%zu] is x[%zu] again", k, j),
                       AD_E_ARGUMENT;
        s->first_input[k] = s->n;
        for (size_t i = 0; i < node_size(n); i++) {
            jet made = ad_jet_make(&b->jets,
                                   (struct jet){.kind = JET_INPUT,
                                                .a = JET_NONE,
                                                .b = JET_NONE,
                                                .da = JET_NONE,
                                                .db = JET_NONE,
                                                .ea = JET_NONE,
                                                .eb = JET_NONE,
                                                .number = (double)s->n},
                                   &is_new);
            if (x[k].id < b->end && b->at[x[k].id])
                b->at[x[k].id][i] = made;
        }
        if (x[k].id < b->end)
            b->needed[x[k].id] = false;
    }
    return AD_OK;
}

static void put_elementwise(struct builder *b, const struct node *n, jet *y)
{
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            jet in[3];
            for (size_t k = 0; k < ad_ops[n->op].arity; k++) {
                const struct node *x = node_at(b->tape, n->in[k]);
                in[k] = b->at[n->in[k]][(x->rows == 1 ? 0 : r) * x->cols + (x->cols == 1 ? 0 : c)];
            }
            y[r * n->cols + c] = ad_jet_elementwise(&b->jets, (enum ad_op)n->op, in);
        }
}

static enum ad_status put_nodes(struct builder *b, ad_tape *tape)
{
    for (uint32_t id = 0; id < b->end; id++) {
        const struct node *n = node_at(tape, id);
        if (!b->needed[id])
            continue;
        if (n->op == AD_OP_input)
            return ad_refuse(tape, AD_E_ARGUMENT,
                             "series: y depends on input %u, which is not among x", id),
                   AD_E_ARGUMENT;
        if (ad_ops[n->op].elementwise)
            put_elementwise(b, n, b->at[id]);
        else if (!ad_jet_structure(&b->jets, tape, n, b->at, b->at[id]))
            return ad_refuse(tape, AD_E_ARGUMENT, "series: node %u (%s) has no rule", id,
                             ad_op_name((enum ad_op)n->op)),
                   AD_E_ARGUMENT;
    }
    return AD_OK;
}

static enum ad_status put_outputs(struct builder *b, size_t n_y, const ad_var y[])
{
    struct ad_series *s = b->jets.series;
    for (size_t k = 0; k < n_y; k++) {
        s->first_output[k] = s->n_output;
        s->n_output += node_size(node_at(b->tape, y[k].id));
    }
    s->output = malloc(s->n_output * sizeof *s->output);
    for (size_t k = 0; s->output && k < n_y; k++)
        for (size_t i = 0; i < node_size(node_at(b->tape, y[k].id)); i++)
            s->output[s->first_output[k] + i] = b->at[y[k].id][i].id;
    return s->output ? AD_OK : AD_E_MEMORY;
}

/* Marks what the first jets, inputs, and the outputs need: a derivative may come after what needs
   it. */
static void mark_jets(struct ad_series *s, size_t inputs, uint32_t *marked, uint32_t *stack)
{
    size_t depth = 0;
    for (size_t k = 0; k < inputs; k++)
        marked[k] = 1;
    for (size_t k = 0; k < s->n_output || depth;) {
        uint32_t x = JET_NONE;
        if (!depth) {
            x = s->output[k++];
            if (!marked[x]) {
                marked[x] = 1;
                stack[depth++] = x;
            }
            continue;
        }
        struct jet *it = &s->jets[stack[--depth]];
        for (size_t j = 0; j < JET_OPERANDS; j++) {
            x = *ad_jet_operand(it, j);
            if (x != JET_NONE && !marked[x]) {
                marked[x] = 1;
                stack[depth++] = x;
            }
        }
    }
}

/* Leaves out what no output needs. */
static enum ad_status sweep(struct ad_series *s, size_t inputs)
{
    uint32_t *to = calloc(s->n, sizeof *to), *stack = malloc(s->n * sizeof *stack), n = 0;
    if (to && stack) {
        mark_jets(s, inputs, to, stack);
        for (size_t k = 0; k < s->n; k++)
            if (to[k]) {
                s->jets[n] = s->jets[k];
                to[k] = n++;
            }
        for (size_t k = 0; k < n; k++)
            for (size_t j = 0; j < JET_OPERANDS; j++) {
                uint32_t *x = ad_jet_operand(&s->jets[k], j);
                *x = *x == JET_NONE ? JET_NONE : to[*x];
            }
        for (size_t k = 0; k < s->n_output; k++)
            s->output[k] = to[s->output[k]];
        s->n = n;
    }
    AD_FREE(stack, to);
    return to && stack ? AD_OK : AD_E_MEMORY;
}

static size_t products(const struct ad_series *s)
{
    size_t n = 0;
    for (size_t k = 0; k < s->n; k++)
        n += s->jets[k].kind == JET_PRODUCT;
    return n;
}

/* Takes what has fewer products. */
static void simplify(struct ad_series *s, size_t inputs)
{
    struct ad_series made = {0};
    if (ad_series_factor(s, &made) && sweep(&made, inputs) == AD_OK &&
        products(&made) < products(s)) {
        const struct ad_series old = *s;
        s->jets = made.jets;
        s->output = made.output;
        s->n = made.n;
        s->max = made.max;
        made.jets = old.jets;
        made.output = old.output;
    }
    AD_FREE(made.jets, made.output);
}

/* The jet without its factors that are numbers. */
static uint32_t without_factors(const struct ad_series *s, uint32_t x)
{
    while (s->jets[x].kind == JET_SCALE)
        x = s->jets[x].a;
    return x;
}

/* 1 - sin^2, or 1 - cos^2. */
static bool is_other_square(const struct ad_series *s, const struct jet *shift)
{
    const struct jet *scale = &s->jets[shift->a], *square;
    if (shift->number != 1 || scale->kind != JET_SCALE || scale->number != -1)
        return false;
    square = &s->jets[scale->a];
    if (square->kind != JET_SQUARE)
        return false;
    const struct jet *base = &s->jets[square->a];
    return base->kind == JET_INTEGRAL && (base->op == AD_OP_sin || base->op == AD_OP_cos);
}

/* What `x` has as a factor twice, JET_NONE: nothing that is seen. */
static uint32_t squared(const struct ad_series *s, uint32_t x)
{
    const struct jet *it = &s->jets[x = without_factors(s, x)];
    uint32_t base;
    switch (it->kind) {
    case JET_SQUARE:
        return without_factors(s, it->a);
    case JET_POWER:
        return fmod(it->number, 2) == 0 ? without_factors(s, it->a) : JET_NONE;
    case JET_PRODUCT:
        if (without_factors(s, it->a) == without_factors(s, it->b))
            return without_factors(s, it->a);
        base = squared(s, it->a);
        return base != JET_NONE ? base : squared(s, it->b);
    case JET_QUOTIENT:
        return squared(s, it->a);
    case JET_COMBINE:
        base = squared(s, it->a);
        return base == squared(s, it->b) ? base : JET_NONE;
    case JET_SHIFT:
        return is_other_square(s, it) ? it->a : JET_NONE;
    default:
        return JET_NONE;
    }
}

/* Roots of squares, also in the derivative of asin(sin x), and hypot(x, c x): |x| by another name.
 */
static bool has_kink(const struct ad_series *s, const struct jet *it)
{
    const struct jet *a, *b;
    switch (it->kind) {
    case JET_PIECEWISE:
        return it->op != AD_OP_eq && it->op != AD_OP_ne;
    case JET_ROOT:
        return squared(s, it->a) != JET_NONE;
    case JET_POWER:
        return it->number != floor(it->number) && squared(s, it->a) != JET_NONE;
    case JET_INTEGRAL:
        a = &s->jets[it->a];
        if (it->op != AD_OP_hypot)
            return false;
        b = &s->jets[it->b];
        if (a->kind == JET_NUMBER || b->kind == JET_NUMBER)
            return (a->kind == JET_NUMBER ? a : b)->number == 0;
        return without_factors(s, it->a) == without_factors(s, it->b);
    default:
        return false;
    }
}

/* Memory of the coefficients; those of numbers are set for good. */
static enum ad_status allocate(struct ad_series *s)
{
    s->stride = s->order + 1;
    if (s->n > SIZE_MAX / sizeof(double) / (s->stride + 1))
        return AD_E_MEMORY;
    s->coefficients = calloc(s->n * (s->stride + 1), sizeof *s->coefficients);
    s->low = s->coefficients + s->n * s->stride;
    for (size_t k = 0; s->coefficients && k < s->n; k++) {
        const struct jet *it = &s->jets[k];
        if (it->kind == JET_NUMBER)
            s->coefficients[k * s->stride] = it->number;
        if (has_kink(s, it) && s->branches++ == 0)
            s->kink = it;
    }
    return s->coefficients ? AD_OK : AD_E_MEMORY;
}

static enum ad_status build(struct builder *b, size_t n_y, const ad_var y[], size_t n_x,
                            const ad_var x[])
{
    struct ad_series *s = b->jets.series;
    ad_tape *tape = y[0].tape;
    s->first_input = calloc(n_x + 1, sizeof *s->first_input);
    s->first_output = calloc(n_y, sizeof *s->first_output);
    if (!s->first_input || !s->first_output || !mark(b, n_y, y))
        return AD_E_MEMORY;
    if (put_inputs(b, tape, n_x, x) != AD_OK)
        return tape->error.status;
    const size_t inputs = s->n_input = s->n;
    if (put_nodes(b, tape) != AD_OK)
        return tape->error.status;
    if (b->jets.failed || put_outputs(b, n_y, y) != AD_OK || sweep(s, inputs) != AD_OK)
        return AD_E_MEMORY;
    simplify(s, inputs);
    return allocate(s);
}

enum ad_status ad_series_new(size_t n_y, const ad_var y[], size_t n_x, const ad_var x[],
                             size_t order, ad_series **series)
{
    ad_tape *tape = n_y && y ? y[0].tape : NULL;
    if (series)
        *series = NULL;
    if (!tape || !series || (n_x && !x))
        return AD_E_ARGUMENT;
    if (order >= UINT32_MAX)
        return ad_refuse(tape, AD_E_ARGUMENT, "series: order %zu is too large", order),
               AD_E_ARGUMENT;
    if (tape->error.status != AD_OK || !ad_all_on(tape, AD_COMPOSITE_series, "y", n_y, y) ||
        !ad_all_on(tape, AD_COMPOSITE_series, "x", n_x, x))
        return tape->error.status;
    if (tape->type != AD_F64)
        return ad_refuse(tape, AD_E_ARGUMENT, "series: a tape of f32; expected f64"), AD_E_ARGUMENT;
    struct builder b = {.tape = tape, .jets.series = calloc(1, sizeof(struct ad_series))};
    enum ad_status status = AD_E_MEMORY;
    if (b.jets.series) {
        b.jets.series->order = order;
        status = build(&b, n_y, y, n_x, x);
    }
    AD_FREE(b.needed, b.at, b.elements, b.jets.table);
    if (status != AD_OK) {
        ad_series_free(b.jets.series);
        if (status == AD_E_MEMORY)
            ad_refuse(tape, status, "series: out of memory");
        return status;
    }
    *series = b.jets.series;
    return AD_OK;
}

void ad_series_free(ad_series *series)
{
    if (!series)
        return;
    ad_series_code_free(series->code);
    AD_FREE(series->jets, series->coefficients, series->first_input, series->output,
            series->first_output, series);
}

double *ad_series_input(ad_series *series, size_t k, size_t i)
{
    return series ? series->coefficients + (series->first_input[k] + i) * series->stride : NULL;
}

static uint32_t output(const ad_series *series, size_t k, size_t i)
{
    return series->output[series->first_output[k] + i];
}

const double *ad_series_output(const ad_series *series, size_t k, size_t i)
{
    return series ? series->coefficients + output(series, k, i) * series->stride : NULL;
}

bool ad_series_is_number(const ad_series *series, size_t k, size_t i)
{
    return series && series->jets[output(series, k, i)].kind == JET_NUMBER;
}

size_t ad_series_branches(const ad_series *series) { return series ? series->branches : 0; }

const char *ad_series_kink(const ad_series *series)
{
    const struct jet *kink = series ? series->kink : NULL;
    return !kink                         ? NULL
           : kink->kind == JET_PIECEWISE ? "abs, relu, min, max or another comparison"
           : kink->kind == JET_INTEGRAL  ? ad_op_name((enum ad_op)kink->op)
                                         : "a root of a square";
}
