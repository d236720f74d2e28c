/* The gradient: one reverse sweep over the recorded nodes, which appends operations.

   An adjoint may be smaller than its value (a scalar or row that stands for its own broadcast): the
   adjoint of a sum costs nothing. Slices of one value collect their adjoints as the parts of one
   place operation, so that splitting a value row by row costs no more than its size.

   Zeros behind branches: select, min, max, relu and abs send an exact zero to the branch not taken.
   Behind them 0 * inf would give NaN, so the chain rule multiplies with mul0 there, which keeps a
   zero whatever the other factor. */
#include "autodiff/free.h"
#include "autodiff/derivatives.h"
#include "sweep.h"

#include <stdlib.h>

ad_var ad_reduce_to(ad_var c, const struct node *y, const struct node *x)
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

bool ad_is_zero(ad_var x)
{
    const struct node *n = node_at(x.tape, x.id);
    uint32_t row = 0, col = 0, rows = n->rows, cols = n->cols;
    for (; n->op == AD_OP_slice || n->op == AD_OP_broadcast; n = node_at(x.tape, n->in[0])) {
        row += n->op == AD_OP_slice ? n->in[1] : 0;
        col += n->op == AD_OP_slice ? n->in[2] : 0;
        const struct node *of = node_at(x.tape, n->in[0]);
        if (of->rows == 1)
            row = 0, rows = 1;
        if (of->cols == 1)
            col = 0, cols = 1;
    }
    bool zero = n->op == AD_OP_constant;
    for (uint32_t r = row; zero && r < row + rows; r++)
        for (uint32_t c = col; zero && c < col + cols; c++)
            zero = x.tape->numbers[n->aux + (size_t)r * n->cols + c] == 0;
    return zero;
}

/* The same value, recorded once or, some operations deep, twice. */
static bool is_same(const ad_tape *tape, uint32_t a, uint32_t b, int depth)
{
    const struct node *p = node_at(tape, a), *q = node_at(tape, b);
    bool same = p->op == q->op && ad_ops[p->op].elementwise && depth;
    for (size_t k = 0; a != b && same && k < ad_ops[p->op].arity; k++)
        same = is_same(tape, p->in[k], q->in[k], depth - 1);
    return a == b || same;
}

/* a x + a y is a (x + y): the derivative of a force along u passes its factors on to each
   coordinate. Saves a sixth of the operations of a gas's Hessian times a vector. */
static ad_var sum(ad_var p, ad_var q, int depth)
{
    const struct node *np = node_at(p.tape, p.id), *nq = node_at(q.tape, q.id);
    for (int k = 0; depth && np->op == AD_OP_mul && nq->op == AD_OP_mul && k < 4; k++) {
        ad_var a = ad_at(p.tape, np->in[k / 2]), x = ad_at(p.tape, np->in[1 - k / 2]);
        ad_var y = ad_at(p.tape, nq->in[1 - k % 2]);
        if (is_same(p.tape, a.id, nq->in[k % 2], 3) && ad_rows(x) == ad_rows(y) &&
            ad_cols(x) == ad_cols(y))
            return ad_mul(sum(x, y, depth - 1), a);
    }
    return ad_add(p, q);
}

void ad_accumulate(struct sweep *s, uint32_t to, ad_var c)
{
    enum { FACTORS = 8 };
    if (s->tainted && ad_is_zero(c))
        return;
    uint32_t so_far = s->adjoint[to];
    s->adjoint[to] = so_far ? sum(sweep_var(s, so_far), c, FACTORS).id : c.id;
    if (s->tainted)
        s->flags[to] |= TAINTED;
}

static int by_position(const void *a, const void *b)
{
    const struct adjoint_part *p = a, *q = b;
    const uint32_t x[] = {p->row, p->col, p->rows, p->cols},
                   y[] = {q->row, q->col, q->rows, q->cols};
    for (size_t i = 0; i < LENGTH(x); i++)
        if (x[i] != y[i])
            return x[i] < y[i] ? -1 : 1;
    return (p->next < q->next) - (p->next > q->next); /* unique: a stable order */
}

static bool same_place(const struct adjoint_part *p, const struct adjoint_part *q)
{
    return p->row == q->row && p->col == q->col && p->rows == q->rows && p->cols == q->cols;
}

/* One place operation from all parts of a value; parts at the same place are added first. */
static ad_var collect_parts(struct sweep *s, uint32_t id)
{
    size_t n = 0, distinct = 0;
    for (uint32_t k = s->first[id]; k; k = s->parts[k - 1].next)
        n++;
    struct adjoint_part *parts = malloc(n * sizeof *parts);
    ad_var *vars = malloc(n * sizeof *vars);
    size_t *at = malloc(2 * n * sizeof *at);
    ad_var y = sweep_var(s, 0);
    if (!parts || !vars || !at) {
        ad_fail(&s->tape->error, AD_E_MEMORY, "out of memory in the gradient");
        goto done;
    }
    n = 0;
    for (uint32_t k = s->first[id]; k; k = s->parts[k - 1].next)
        parts[n++] = s->parts[k - 1];
    qsort(parts, n, sizeof *parts, by_position);
    for (size_t k = 0; k < n; k++) {
        ad_var part = sweep_var(s, parts[k].id);
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
    AD_FREE(parts, vars, at);
    return y;
}

/* The adjoint of a value, complete once every later node has been processed; 0: none. */
static uint32_t finish(struct sweep *s, uint32_t id)
{
    if (s->first[id]) {
        ad_var parts = collect_parts(s, id);
        s->first[id] = 0;
        s->tainted = false;
        ad_accumulate(s, id, parts);
    }
    return s->adjoint[id];
}

/* Marks the nodes that depend on an x. */
static void mark(struct sweep *s, uint32_t end, size_t n, const ad_var x[])
{
    s->from = end;
    for (size_t k = 0; k < n; k++)
        if (x[k].id < end) {
            s->flags[x[k].id] |= NEEDED;
            s->from = x[k].id < s->from ? x[k].id : s->from;
        }
    for (uint32_t id = s->from + 1; id < end; id++) {
        const struct node *node = node_at(s->tape, id);
        for (size_t k = 0; k < n_inputs(s->tape, node); k++)
            s->flags[id] |= s->flags[input_of(s->tape, node, k)];
    }
}

static void sweep(struct sweep *s, uint32_t end)
{
    for (uint32_t id = end - 1; id > 0 && id >= s->from && s->tape->error.status == AD_OK; id--) {
        if (!is_needed(s, id))
            continue;
        const struct node *node = node_at(s->tape, id);
        if (node->op == AD_OP_input || node->op == AD_OP_constant)
            continue;
        uint32_t g = finish(s, id);
        if (!g)
            continue;
        s->tainted = (s->flags[id] & TAINTED) || ad_branches(node->op) || node->op == AD_OP_mul0;
        if (ad_ops[node->op].elementwise)
            ad_elementwise_rule(s, node, sweep_var(s, id), sweep_var(s, g));
        else
            ad_structure_rule(s, node, sweep_var(s, id), sweep_var(s, g));
    }
}

/* True if op can differentiate y by x[0..n-1]; *tape is the tape that keeps an error. */
static bool can_derive(unsigned op, ad_var y, size_t n, const ad_var x[], const void *g,
                       ad_tape **tape)
{
    *tape = y.tape;
    for (size_t k = 0; x && k < n && !*tape; k++)
        *tape = x[k].tape;
    if (!*tape)
        return false;
    if (n && (!x || !g))
        ad_refuse(*tape, AD_E_ARGUMENT, "%s: got no %s (NULL)",
                  op == AD_COMPOSITE_vjp ? "vjp" : "grad",
                  x ? "place for the gradient" : "variables");
    return (*tape)->error.status == AD_OK && ad_all_on(*tape, op, "y", 1, &y) &&
           ad_all_on(*tape, op, "x", n, x);
}

enum ad_status ad_sweep_back(ad_tape *tape, size_t m, const ad_var y[], const ad_var seed[],
                             bool tainted, size_t n, const ad_var x[], ad_var g[])
{
    const uint32_t end = ad_end_of(m, y);
    struct sweep s = {.tape = tape,
                      .adjoint = calloc(end, sizeof *s.adjoint),
                      .first = calloc(end, sizeof *s.first),
                      .flags = calloc(end, sizeof *s.flags),
                      .tainted = tainted};
    if (!s.adjoint || !s.first || !s.flags) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory in the gradient");
    } else {
        mark(&s, end, n, x);
        for (size_t k = 0; k < m; k++)
            ad_accumulate(&s, y[k].id, seed[k]);
        sweep(&s, end);
    }
    for (size_t k = 0; k < n && tape->error.status == AD_OK; k++) {
        uint32_t id = x[k].id < end ? finish(&s, x[k].id) : 0; /* node 0 is the constant 0 */
        g[k] = ad_broadcast(ad_at(tape, id), ad_rows(x[k]), ad_cols(x[k]));
    }
    AD_FREE(s.adjoint, s.first, s.flags, s.parts);
    return tape->error.status;
}

static void set_none(ad_tape *tape, size_t n, ad_var g[])
{
    for (size_t k = 0; g && k < n; k++)
        g[k] = ad_refused(tape);
}

/* g may be the array of x, so it is not written before. */
static enum ad_status finished(ad_tape *tape, size_t n, ad_var g[])
{
    enum ad_status status = tape ? tape->error.status : AD_E_TAPE;
    if (status != AD_OK)
        set_none(tape, n, g);
    return status;
}

enum ad_status ad_grad(ad_var y, size_t n, const ad_var x[], ad_var g[])
{
    ad_tape *tape;
    if (can_derive(AD_COMPOSITE_grad, y, n, x, g, &tape)) {
        ad_var one = ad_scalar(tape, 1);
        ad_sweep_back(tape, 1, &y, &one, false, n, x, g);
    }
    return finished(tape, n, g);
}

enum ad_status ad_vjp(ad_var y, ad_var seed, size_t n, const ad_var x[], ad_var g[])
{
    ad_tape *tape;
    ad_var in[] = {y, seed};
    bool can = can_derive(AD_COMPOSITE_vjp, y, n, x, g, &tape) &&
               ad_all_on(tape, AD_COMPOSITE_vjp, "seed", 1, &seed);
    if (can && !ad_fits(seed, y))
        ad_refuse_operands(tape, AD_E_SHAPE, AD_COMPOSITE_vjp, 2, in,
                           "the seed does not broadcast to y");
    else if (can)
        ad_sweep_back(tape, 1, &y, &seed, false, n, x, g);
    return finished(tape, n, g);
}
