/* The derivative in a direction: one forward sweep over the recorded nodes, which appends
   operations. A tangent always has the shape of its value, so that linear operations apply to it
   unchanged. */
#include "autodiff/free.h"
#include "autodiff/derivatives.h"
#include "sweep.h"

#include <stdlib.h>

struct forward {
    ad_tape *tape;
    uint32_t *tangent; /* per node: the id of its tangent, 0 none */
    uint8_t *tainted;  /* the tangent passed a branch: its exact zeros stay zeros */
};

static ad_var tangent_of(const struct forward *f, uint32_t id)
{
    return ad_at(f->tape, f->tangent[id]);
}

static ad_var product(const struct forward *f, const struct node *n)
{
    bool ta = n->aux & 1, tb = n->aux >> 1 & 1;
    ad_var a = ad_at(f->tape, n->in[0]), b = ad_at(f->tape, n->in[1]);
    ad_var da = tangent_of(f, n->in[0]), db = tangent_of(f, n->in[1]);
    ad_var by_a = da.id ? ad_matmul(da, ta, b, tb) : da;
    ad_var by_b = db.id ? ad_matmul(a, ta, db, tb) : db;
    return !by_a.id ? by_b : !by_b.id ? by_a : ad_add(by_a, by_b);
}

/* a dx = db - da x, or with a transposed. */
static ad_var solution(const struct forward *f, const struct node *n, ad_var x, const ad_var t[3])
{
    size_t side = n->aux & SYSTEM_SIDE;
    ad_var a = ad_at(f->tape, n->in[0]), factor = ad_at(f->tape, n->in[1]), right = t[2];
    if (t[0].id) {
        ad_var da = ad_each_product(t[0], x, side, n->rows / side, n->aux & SYSTEM_TRANSPOSED);
        right = right.id ? ad_sub(right, da) : ad_neg(da);
    }
    return right.id ? ad_solve_factored(a, factor, right, n->aux) : right;
}

/* Of the parts that have a tangent. */
static ad_var placed(const struct forward *f, const struct node *n)
{
    size_t count = f->tape->lists[n->aux], kept = 0;
    ad_var *parts = malloc((count + 1) * sizeof *parts), y = ad_at(f->tape, 0);
    size_t *at = malloc((2 * count + 1) * sizeof *at);
    if (!parts || !at)
        ad_fail(&f->tape->error, AD_E_MEMORY, "out of memory in the derivative");
    for (size_t k = 0; parts && at && k < count; k++) {
        const uint32_t *part = f->tape->lists + n->aux + 1 + 3 * k;
        if (!f->tangent[part[0]])
            continue;
        parts[kept] = tangent_of(f, part[0]);
        at[kept] = part[1];
        at[count + kept++] = part[2];
    }
    if (kept)
        y = ad_place(f->tape, n->rows, n->cols, kept, parts, at, at + count);
    AD_FREE(parts, at);
    return y;
}

static ad_var derivative(const struct forward *f, uint32_t id)
{
    const struct node n = *node_at(f->tape, id);
    ad_var t[3] = {ad_at(f->tape, 0), ad_at(f->tape, 0), ad_at(f->tape, 0)};
    for (size_t k = 0; k < ad_ops[n.op].arity; k++)
        t[k] = tangent_of(f, n.in[k]);
    if (ad_ops[n.op].elementwise)
        return ad_elementwise_tangent(&n, ad_at(f->tape, id), t, f->tainted[id]);
    if (n.op == AD_OP_matmul)
        return product(f, &n);
    if (n.op == AD_OP_place)
        return placed(f, &n);
    if (n.op == AD_OP_solve)
        return solution(f, &n, ad_at(f->tape, id), t);
    if (n.op == AD_OP_scan || n.op == AD_OP_scan_adjoint)
        return ad_scan_tangent(&n, ad_at(f->tape, id), f->tangent);
    if (ad_is_custom(n.op))
        return ad_custom_tangent(&n, ad_at(f->tape, id), t, f->tainted[id]);
    if (!t[0].id || n.op == AD_OP_factor)
        return ad_at(f->tape, 0);
    if (n.op == AD_OP_logdet)
        return ad_sum_rows(ad_mul(t[0], ad_logdet_slope(&n, f->tape)));
    const struct node *of = node_at(f->tape, t[0].id);
    if (n.op == AD_OP_gather_cols && of->op == AD_OP_broadcast &&
        node_at(f->tape, of->in[0])->cols == 1) /* all columns are alike */
        return ad_broadcast(ad_at(f->tape, of->in[0]), n.rows, n.cols);
    struct node same = n; /* linear in its one operand, with the same lists and numbers */
    same.in[0] = t[0].id;
    same.flags = 0;
    return ad_append(f->tape, same);
}

/* Adds `t` to the tangent of node id. */
static void add(struct forward *f, uint32_t id, ad_var t)
{
    const struct node *n = node_at(f->tape, id);
    if (!t.id || (f->tainted[id] && ad_is_zero(t)))
        return;
    t = ad_broadcast(t, n->rows, n->cols);
    f->tangent[id] = f->tangent[id] ? ad_add(tangent_of(f, id), t).id : t.id;
}

static void sweep(struct forward *f, uint32_t end)
{
    for (uint32_t id = 1; id < end && f->tape->error.status == AD_OK; id++) {
        const struct node *n = node_at(f->tape, id);
        bool any = false;
        for (size_t k = 0; k < n_inputs(f->tape, n); k++) {
            uint32_t x = input_of(f->tape, n, k);
            any = any || f->tangent[x];
            f->tainted[id] |= f->tainted[x];
        }
        f->tainted[id] |= ad_branches(n->op) || n->op == AD_OP_mul0;
        if (any)
            add(f, id, derivative(f, id));
    }
}

enum ad_status ad_sweep_forward(ad_tape *tape, bool tainted, size_t n, const ad_var x[],
                                const ad_var dx[], size_t m, const ad_var y[], ad_var dy[])
{
    const uint32_t end = ad_end_of(m, y);
    struct forward f = {
        .tape = tape, .tangent = calloc(end, sizeof *f.tangent), .tainted = calloc(end, 1)};
    if (!f.tangent || !f.tainted) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory in the derivative");
    } else {
        for (size_t k = 0; k < n; k++)
            if (x[k].id < end) {
                add(&f, x[k].id, dx[k]);
                f.tainted[x[k].id] |= tainted;
            }
        sweep(&f, end);
        for (size_t k = 0; k < m; k++)
            dy[k] = ad_broadcast(tangent_of(&f, y[k].id), ad_rows(y[k]), ad_cols(y[k]));
    }
    AD_FREE(f.tangent, f.tainted);
    return tape->error.status;
}

/* Of arguments that can be used. */
static enum ad_status push(ad_tape *tape, ad_var y, size_t n, const ad_var x[], const ad_var dx[],
                           ad_var *dy)
{
    if (tape->error.status != AD_OK || !ad_all_on(tape, AD_COMPOSITE_jvp, "y", 1, &y) ||
        !ad_all_on(tape, AD_COMPOSITE_jvp, "x", n, x) ||
        !ad_all_on(tape, AD_COMPOSITE_jvp, "dx", n, dx))
        return tape->error.status;
    for (size_t k = 0; k < n; k++)
        if (!ad_fits(dx[k], x[k])) {
            ad_refuse_operands(tape, AD_E_SHAPE, AD_COMPOSITE_jvp, 2, (ad_var[]){x[k], dx[k]},
                               "direction %zu does not broadcast to its variable", k);
            return tape->error.status;
        }
    return ad_sweep_forward(tape, false, n, x, dx, 1, &y, dy);
}

enum ad_status ad_jvp(ad_var y, size_t n, const ad_var x[], const ad_var dx[], ad_var *dy)
{
    ad_tape *tape = y.tape;
    for (size_t k = 0; x && k < n && !tape; k++)
        tape = x[k].tape;
    if (tape && (!dy || (n && (!x || !dx))))
        ad_refuse(tape, AD_E_ARGUMENT, "jvp: got no %s (NULL)",
                  !dy  ? "place for the derivative"
                  : !x ? "variables"
                       : "directions");
    ad_var result = ad_refused(tape); /* dy may be one of dx */
    enum ad_status status = tape ? push(tape, y, n, x, dx, &result) : AD_E_TAPE;
    if (dy)
        *dy = status == AD_OK ? result : ad_refused(tape);
    return status;
}
