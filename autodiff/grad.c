/* The gradient: one reverse sweep over the recorded nodes, appending operations.

   Adjoints may be smaller than the value they belong to (a scalar or row standing for a broadcast
   of itself): the adjoint of a sum costs nothing. Slices of one value add their adjoints as parts of
   one place operation, so that taking a value apart row by row costs no more than its size.

   Zeros behind branches. select, min, max, relu, abs send an exact zero along what they do not
   take. Behind them 0 * inf would make NaN, so there the chain rule multiplies with mul0, which keeps
   a zero whatever the other factor is. */
#include "internal.h"

#include <stdlib.h>
#include <string.h>

/* A part of an adjoint: covers rows x cols of the value from (row, col) on. */
struct part {
    uint32_t id, row, col, rows, cols, next;
};

enum { NEEDED = 1, TAINTED = 2 }; /* depends on some x; its adjoint came through a branch */

struct sweep {
    ad_tape *tape;
    uint32_t *adjoint; /* per node: the id of its adjoint so far, 0 none */
    uint32_t *first;   /* per node: 1 + its first part */
    uint8_t *flags;
    struct part *parts;
    size_t n_parts, max_parts;
    bool tainted; /* of the node being treated */
};

static ad_var var(struct sweep *s, uint32_t id)
{
    return (ad_var){s->tape, id};
}

/* Sums dimensions in which y was broadcast from x; a dimension the adjoint left implicit counts
   as often as it repeats. */
static ad_var reduce_to(ad_var c, const struct node *y, const struct node *x)
{
    double times = 1;
    if (x->rows == 1 && y->rows > 1) {
        if (ad_rows(c) == 1)
            times *= y->rows;
        else
            c = ad_sum_rows(c);
    }
    if (x->cols == 1 && y->cols > 1) {
        if (ad_cols(c) == 1)
            times *= y->cols;
        else
            c = ad_sum_cols(c);
    }
    return ad_mul(c, times);
}

static void accumulate(struct sweep *s, uint32_t to, ad_var c)
{
    uint32_t sum = s->adjoint[to];
    s->adjoint[to] = sum ? ad_add(var(s, sum), c).id : c.id;
    if (s->tainted)
        s->flags[to] |= TAINTED;
}

static ad_var full(ad_var g, const struct node *y)
{
    return ad_broadcast(g, y->rows, y->cols);
}

/* ---- elementwise rules, from the table ---- */

static bool branches(uint16_t op)
{
    switch (op) {
    case AD_OP_abs:
    case AD_OP_relu:
    case AD_OP_min:
    case AD_OP_max:
    case AD_OP_select:
        return true;
    default:
        return false;
    }
}

/* b a^(b-1); 0 at base 0 where that is infinite. */
static ad_var pow_base(ad_var a, ad_var b)
{
    ad_var infinite = ad_mul(ad_eq(a, 0.0), ad_lt(b, 1.0));
    return ad_select(infinite, 0.0, ad_mul(b, ad_pow(a, ad_sub(b, 1.0))));
}

/* y log a; 0 at base 0. */
static ad_var pow_exponent(ad_var a, ad_var y)
{
    return ad_select(ad_eq(a, 0.0), 0.0, ad_mul(y, ad_log(a)));
}

static double ad_value(ad_var c)
{
    double value = 0;
    ad_constant_value(c, &value);
    return value;
}

/* c g, the number multiplied into one that g, or a factor of g, already has. */
static ad_var scaled(ad_var g, double c)
{
    const struct node *n = node_at(g.tape, g.id);
    double inner;
    for (int k = 0; k < 2 && n->op == AD_OP_mul; k++) {
        const struct node *factor = node_at(g.tape, n->in[k]);
        if (factor->op == AD_OP_mul && ad_constant_value((ad_var){g.tape, factor->in[1]}, &inner))
            return ad_mul(ad_scale((ad_var){g.tape, n->in[k]}, c),
                          ((ad_var){g.tape, n->in[1 - k]}));
    }
    return ad_scale(g, c);
}

/* Moves the number of a factor c d to g: shared by all inputs, and often free there. */
static void move_number(ad_var *g, ad_arg *d)
{
    if (!d->var.tape)
        return;
    const struct node *n = node_at(d->var.tape, d->var.id);
    double c = -1;
    if (n->op != AD_OP_neg &&
        !(n->op == AD_OP_mul && ad_constant_value((ad_var){g->tape, n->in[1]}, &c)))
        return;
    *g = scaled(*g, c);
    d->var.id = n->in[0];
}

/* Adds g * d to the adjoint of input k of y. A d of 0 is no dependence. */
static void chain(struct sweep *s, const struct node *y, int k, ad_var g, ad_arg d)
{
    uint32_t to = y->in[k];
    if (!d.var.tape && d.value == 0)
        return;
    if (d.var.tape && ad_constant_value(d.var, &d.value))
        d.var.tape = NULL;
    move_number(&g, &d);
    ad_var c;
    if (!d.var.tape)
        c = scaled(g, d.value);
    else
        c = ad_binary(s->tainted ? AD_OP_mul0 : AD_OP_mul, AD_ARG(g), d);
    accumulate(s, to, reduce_to(c, y, node_at(s->tape, to)));
}

static bool needed(const struct sweep *s, uint32_t id)
{
    return s->flags[id] & NEEDED;
}

static void elementwise_rule(struct sweep *s, const struct node *n, ad_var y, ad_var g)
{
    ad_var a = var(s, n->in[0]), b = var(s, n->in[1]), x = a;
    (void)b;
    (void)y;
    switch (n->op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        chain(s, n, 0, g, AD_ARG(dx));                                                             \
        break;
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    case AD_OP_##name:                                                                             \
        if (needed(s, n->in[0]))                                                                   \
            chain(s, n, 0, g, AD_ARG(da));                                                         \
        if (needed(s, n->in[1]))                                                                   \
            chain(s, n, 1, g, AD_ARG(db));                                                         \
        break;
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    case AD_OP_##name:                                                                             \
        if (needed(s, n->in[1]))                                                                   \
            chain(s, n, 1, g, AD_ARG(db));                                                         \
        if (needed(s, n->in[2]))                                                                   \
            chain(s, n, 2, g, AD_ARG(dc));                                                         \
        break;
#include "ops.def"
    default:
        break;
    }
    (void)x;
}

/* ---- structural rules ---- */

static void add_part(struct sweep *s, uint32_t to, ad_var g, uint32_t row, uint32_t col)
{
    if (!ad_reserve((void **)&s->parts, s->n_parts, &s->max_parts, 1, sizeof *s->parts)) {
        ad_fail(&s->tape->error, AD_E_MEMORY, "out of memory in the gradient");
        return;
    }
    s->parts[s->n_parts++] = (struct part){g.id,
                                           row,
                                           col,
                                           (uint32_t)ad_rows(g),
                                           (uint32_t)ad_cols(g),
                                           s->first[to]};
    s->first[to] = (uint32_t)s->n_parts;
    if (s->tainted)
        s->flags[to] |= TAINTED;
}

static void matmul_rule(struct sweep *s, const struct node *n, ad_var g)
{
    ad_var a = var(s, n->in[0]), b = var(s, n->in[1]);
    bool ta = n->aux & 1, tb = n->aux >> 1;
    if (needed(s, a.id))
        accumulate(s, a.id, ta ? ad_matmul(b, tb, g, true) : ad_matmul(g, false, b, !tb));
    if (needed(s, b.id))
        accumulate(s, b.id, tb ? ad_matmul(g, true, a, ta) : ad_matmul(a, !ta, g, false));
}

/* The part of g that a part of a place operation sees. */
static ad_var window(ad_var g, uint32_t row, uint32_t col, const struct node *part)
{
    return ad_slice_cols(ad_slice_rows(g, row, part->rows), col, part->cols);
}

static void place_rule(struct sweep *s, const struct node *n, ad_var g)
{
    for (size_t k = 0; k < s->tape->lists[n->aux]; k++) {
        const uint32_t *part = s->tape->lists + n->aux + 1 + 3 * k; /* lists may move: look again */
        uint32_t id = part[0];
        if (needed(s, id))
            accumulate(s, id, window(g, part[1], part[2], node_at(s->tape, id)));
    }
}

/* Gather and scatter are each other's adjoint; their list is recorded again as the array may move. */
static ad_var indexed_adjoint(struct sweep *s, const struct node *n, ad_var g)
{
    const uint32_t *list = s->tape->lists + n->aux;
    size_t count = list[0];
    uint32_t *rows = malloc(count * sizeof *rows);
    if (!rows) {
        ad_fail(&s->tape->error, AD_E_MEMORY, "out of memory in the gradient");
        return g;
    }
    memcpy(rows, list + 1, count * sizeof *rows);
    ad_var c = n->op == AD_OP_gather
                   ? ad_scatter_rows(g, rows, node_at(s->tape, n->in[0])->rows)
                   : ad_gather_rows(g, count, rows);
    free(rows);
    return c;
}

static void structure_rule(struct sweep *s, const struct node *n, ad_var g)
{
    const struct node *x = node_at(s->tape, n->in[0]);
    double scale = n->op == AD_OP_diff || n->op == AD_OP_diff_adjoint ? s->tape->numbers[n->aux] : 0;
    switch (n->op) {
    case AD_OP_slice:
        add_part(s, n->in[0], full(g, n), n->in[1], n->in[2]);
        break;
    case AD_OP_reshape:
        accumulate(s, n->in[0], ad_reshape(full(g, n), x->rows, x->cols));
        break;
    case AD_OP_broadcast:
        accumulate(s, n->in[0], reduce_to(g, n, x));
        break;
    case AD_OP_gather:
    case AD_OP_scatter:
        accumulate(s, n->in[0], indexed_adjoint(s, n, full(g, n)));
        break;
    case AD_OP_place:
        place_rule(s, n, full(g, n));
        break;
    case AD_OP_diff:
        accumulate(s, n->in[0], ad_diff_adjoint(full(g, n), scale, n->in[2], x->cols));
        break;
    case AD_OP_diff_adjoint:
        accumulate(s, n->in[0], ad_diff(full(g, n), scale, n->in[2]));
        break;
    case AD_OP_sum:
    case AD_OP_sum_rows:
    case AD_OP_sum_cols:
        accumulate(s, n->in[0], g);
        break;
    case AD_OP_transpose:
        accumulate(s, n->in[0], ad_transpose(full(g, n)));
        break;
    case AD_OP_matmul:
        matmul_rule(s, n, full(g, n));
        break;
    default:
        break;
    }
}

/* ---- the sweep ---- */

static int by_position(const void *a, const void *b)
{
    const struct part *p = a, *q = b;
    const uint32_t x[] = {p->row, p->col, p->rows, p->cols}, y[] = {q->row, q->col, q->rows, q->cols};
    for (size_t i = 0; i < LENGTH(x); i++)
        if (x[i] != y[i])
            return x[i] < y[i] ? -1 : 1;
    return (p->next < q->next) - (p->next > q->next); /* unique: a stable order */
}

static bool same_place(const struct part *p, const struct part *q)
{
    return p->row == q->row && p->col == q->col && p->rows == q->rows && p->cols == q->cols;
}

/* One place operation out of all parts of a value, those at the same place added up first. */
static ad_var collect_parts(struct sweep *s, uint32_t id)
{
    size_t n = 0, distinct = 0;
    for (uint32_t k = s->first[id]; k; k = s->parts[k - 1].next)
        n++;
    struct part *parts = malloc(n * sizeof *parts);
    ad_var *vars = malloc(n * sizeof *vars);
    size_t *at = malloc(2 * n * sizeof *at);
    ad_var y = var(s, 0);
    if (!parts || !vars || !at) {
        ad_fail(&s->tape->error, AD_E_MEMORY, "out of memory in the gradient");
        goto done;
    }
    n = 0;
    for (uint32_t k = s->first[id]; k; k = s->parts[k - 1].next)
        parts[n++] = s->parts[k - 1];
    qsort(parts, n, sizeof *parts, by_position);
    for (size_t k = 0; k < n; k++) {
        ad_var part = var(s, parts[k].id);
        if (k && same_place(&parts[k - 1], &parts[k])) {
            vars[distinct - 1] = ad_add(vars[distinct - 1], part);
            continue;
        }
        vars[distinct] = part;
        at[distinct] = parts[k].row;
        at[n + distinct++] = parts[k].col;
    }
    const struct node *x = node_at(s->tape, id);
    y = ad_place(s->tape, x->rows, x->cols, distinct, vars, at, at + n);
done:
    free(parts);
    free(vars);
    free(at);
    return y;
}

/* The adjoint of a value, complete once every later node was treated; 0: none. */
static uint32_t finish(struct sweep *s, uint32_t id)
{
    if (s->first[id]) {
        ad_var parts = collect_parts(s, id);
        s->first[id] = 0;
        s->tainted = false;
        accumulate(s, id, parts);
    }
    return s->adjoint[id];
}

/* Marks what depends on an x. */
static void mark(struct sweep *s, uint32_t last, size_t n, const ad_var x[])
{
    for (size_t k = 0; k < n; k++)
        if (x[k].id <= last)
            s->flags[x[k].id] |= NEEDED;
    for (uint32_t id = 1; id <= last; id++) {
        const struct node *node = node_at(s->tape, id);
        uint8_t flag = 0;
        for (int k = 0; k < ad_ops[node->op].arity && ad_ops[node->op].arity < 9; k++)
            flag |= s->flags[node->in[k]];
        if (node->op == AD_OP_place) {
            const uint32_t *list = s->tape->lists + node->aux;
            for (size_t k = 0; k < list[0]; k++)
                flag |= s->flags[list[1 + 3 * k]];
        }
        s->flags[id] |= flag;
    }
}

static void sweep(struct sweep *s, uint32_t last)
{
    for (uint32_t id = last; id > 0 && s->tape->error.status == AD_OK; id--) {
        if (!needed(s, id))
            continue;
        const struct node *node = node_at(s->tape, id);
        if (node->op == AD_OP_input || node->op == AD_OP_constant)
            continue;
        uint32_t g = finish(s, id);
        if (!g)
            continue;
        s->tainted = (s->flags[id] & TAINTED) || branches(node->op) || node->op == AD_OP_mul0;
        if (ad_ops[node->op].elementwise)
            elementwise_rule(s, node, var(s, id), var(s, g));
        else
            structure_rule(s, node, var(s, g));
    }
}

enum ad_status ad_grad(ad_var y, size_t n, const ad_var x[], ad_var g[])
{
    ad_tape *tape = y.tape;
    if (!tape)
        return AD_E_TAPE;
    for (size_t k = 0; k < n; k++) {
        g[k] = (ad_var){tape, 0};
        if (x[k].tape != tape)
            ad_fail(&tape->error, AD_E_TAPE, "grad: x[%zu] is of another tape", k);
    }
    if (tape->error.status != AD_OK)
        return tape->error.status;

    size_t size = (size_t)y.id + 1;
    struct sweep s = {.tape = tape,
                      .adjoint = calloc(size, sizeof *s.adjoint),
                      .first = calloc(size, sizeof *s.first),
                      .flags = calloc(size, sizeof *s.flags)};
    if (!s.adjoint || !s.first || !s.flags) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory in the gradient");
    } else {
        mark(&s, y.id, n, x);
        s.adjoint[y.id] = ad_scalar(tape, 1).id;
        sweep(&s, y.id);
    }
    for (size_t k = 0; k < n && tape->error.status == AD_OK; k++) {
        uint32_t id = x[k].id <= y.id ? finish(&s, x[k].id) : 0; /* node 0 is the constant 0 */
        g[k] = ad_broadcast((ad_var){tape, id}, ad_rows(x[k]), ad_cols(x[k]));
    }
    free(s.adjoint);
    free(s.first);
    free(s.flags);
    free(s.parts);
    return tape->error.status;
}
