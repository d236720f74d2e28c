/* Derivatives of loops. With z the operands of a loop F and w a seed of its value, scan_adjoint
   computes B(z, w) = F'(z)^T w. Let D be the loop of F and its derivative F'(z) u, whose steps are
   those of F with their tangents. Then

       F's tangent along u         the second half of D(z, u)
       B's adjoint of a seed u     to w: F'(z) u, the same;
                                   to z: the gradient of <w, F'(z) u>, which is D's adjoint by z
                                   with seeds (0, w)
       B's tangent along (u, v)    the gradient of <w, F'(z) u> + <v, F(z)>, with seeds (v, w)

   so that derivatives of any order are made of loops and adjoints of loops, each of which stores
   states by its own schedule. */
#include "autodiff/free.h"
#include "sweep.h"

#include <stdlib.h>
#include <string.h>

/* ---- the body of D ---- */

static uint32_t known_tangent(const ad_tape *tape, uint32_t loop, const uint8_t *along)
{
    for (uint32_t k = 0; k < tape->n_loops; k++)
        if (tape->loops[k].tangent_of == loop + 1 &&
            !memcmp(tape->loops[k].along, along, loop_operands(&tape->loops[loop])))
            return k;
    return UINT32_MAX;
}

/* The variables ids[from ...to) of a loop's body on the tape `body`. */
static void variables(ad_tape *body, const struct loop *l, uint32_t from, uint32_t to, ad_var *x)
{
    for (uint32_t k = from; k < to; k++)
        x[k - from] = ad_at(body, l->ids[k]);
}

static bool is_along(const struct loop *l, const uint8_t *along, uint32_t k)
{
    return k < l->n_state || along[k];
}

/* Whether the body of d, a copy of that of l, could be given inputs that say along what, and the
   derivative of its results. */
static bool record_tangent(const struct loop *l, const uint8_t *along, struct loop *d)
{
    const uint32_t operands = loop_operands(l), results = loop_results(l);
    ad_var *x = calloc(2 * (size_t)(operands + results) + 1, sizeof *x);
    if (!x)
        return false;
    ad_var *dx = x + operands, *y = dx + operands, *dy = y + results;
    uint32_t n = 0, at = 0;
    const uint32_t end[] = {l->n_state, l->n_state + l->n_in, operands, operands + l->n_state,
                            operands + results};
    for (uint32_t kind = 0, k = 0; kind < 3; kind++) {
        const uint32_t first = k, first_along = n;
        for (; k < end[kind]; k++) {
            const struct node *of = node_at(d->body, l->ids[k]);
            d->ids[at++] = l->ids[k];
            if (is_along(l, along, k)) {
                x[n] = ad_at(d->body, l->ids[k]);
                dx[n++] = ad_input(d->body, of->rows, of->cols, "tangent");
            }
        }
        for (uint32_t i = first_along; i < n; i++)
            d->ids[at++] = dx[i].id;
        *(kind == 0   ? &d->n_state
          : kind == 1 ? &d->n_in
                      : &d->n_shared) = k - first + n - first_along;
    }
    variables(d->body, l, operands, operands + results, y);
    bool done = ad_sweep_forward(d->body, true, n, x, dx, results, y, dy) == AD_OK;
    for (uint32_t kind = 3, k = 0; kind < 5; kind++) {
        const uint32_t first = k;
        for (; k < end[kind] - operands; k++)
            d->ids[at++] = y[k].id;
        for (uint32_t i = first; i < k; i++)
            d->ids[at++] = dy[i].id;
    }
    d->n_out = 2 * l->n_out;
    free(x);
    return done;
}

uint32_t ad_tangent_loop(ad_tape *tape, uint32_t loop, const uint8_t *along)
{
    uint32_t known = known_tangent(tape, loop, along);
    if (known != UINT32_MAX)
        return known;
    const struct loop l = tape->loops[loop];
    const size_t n = loop_operands(&l);
    struct loop d = {.body = ad_tape_copy(l.body),
                     .steps = l.steps,
                     .checkpoints = l.checkpoints,
                     .proceed = l.proceed,
                     .context = l.context,
                     .ids = calloc(2 * (n + loop_results(&l)) + 1, sizeof *d.ids),
                     .tangent_of = loop + 1,
                     .along = malloc(n + 1)};
    if (d.along)
        memcpy(d.along, along, n);
    if (!d.body || !d.ids || !d.along || !record_tangent(&l, along, &d)) {
        ad_tape_free(d.body);
        d.body = NULL; /* refused */
    }
    return ad_append_loop(tape, d);
}

/* ---- nodes of D ---- */

/* Of a node of loop F: its operands and their tangents (id 0: none), and D with its operands. */
struct derivative {
    ad_tape *tape;
    uint32_t loop, tangent;
    uint32_t n, n_tangent; /* operands of F and of D */
    ad_var *z, *u, *operands;
    uint8_t *wanted; /* operands of D */
    ad_var scan;     /* the node of D */
};

/* Reads the operands; `u` is to be filled. */
static bool begin(struct derivative *d, ad_tape *tape, const struct node *n)
{
    *d = (struct derivative){.tape = tape, .loop = n->in[1]};
    d->n = loop_operands(&tape->loops[d->loop]);
    d->z = calloc(4 * (size_t)d->n + 3, sizeof *d->z);
    d->wanted = calloc(2 * (size_t)d->n + 1, 1);
    if (!d->z || !d->wanted) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory in the gradient");
        return false;
    }
    d->u = d->z + d->n;
    d->operands = d->u + d->n;
    for (uint32_t k = 0; k < d->n; k++) {
        d->z[k] = ad_at(tape, input_of(tape, n, k));
        d->u[k] = ad_at(tape, 0);
    }
    return true;
}

static void finish(struct derivative *d) { AD_FREE(d->z, d->wanted); }

/* Whether F's adjoint by operand k is wanted. */
static bool is_wanted(const ad_tape *tape, const struct node *n, uint32_t k)
{
    return tape->lists[n->aux + 1 + 3 * k + 1];
}

/* Makes D and its node; `wanted` marks F's operands among D's, those that `of` does. */
static void append_tangent(struct derivative *d, const uint8_t *of)
{
    const struct loop *l = &d->tape->loops[d->loop];
    uint8_t *along = d->wanted;
    for (uint32_t k = 0; k < d->n; k++)
        along[k] = k >= l->n_state && d->u[k].id;
    d->tangent = ad_tangent_loop(d->tape, d->loop, along);
    if (d->tangent == UINT32_MAX)
        return;
    l = &d->tape->loops[d->loop];
    memset(d->wanted, 0, 2 * (size_t)d->n);
    uint32_t at = 0;
    const uint32_t end[] = {l->n_state, l->n_state + l->n_in, d->n};
    for (uint32_t kind = 0, k = 0; kind < 3; kind++) {
        const uint32_t first = k;
        for (; k < end[kind]; k++) {
            d->wanted[at] = of[k];
            d->operands[at++] = d->z[k];
        }
        for (uint32_t i = first; i < k; i++)
            if (kind == 0 || d->u[i].id)
                d->operands[at++] = ad_broadcast(d->u[i], ad_rows(d->z[i]), ad_cols(d->z[i]));
    }
    d->n_tangent = at;
    d->scan = ad_append_scan(d->tape, AD_OP_scan, d->tangent, at, d->operands, NULL);
}

/* Sizes of the next states and outs of F: the value of F has one after the other, that of D each
   twice. */
static void halves(const struct derivative *d, size_t *states, size_t *outs)
{
    const struct loop *l = &d->tape->loops[d->loop];
    *states = *outs = 0;
    for (uint32_t k = 0; k < loop_results(l); k++)
        *(k < l->n_state ? states : outs) += loop_size(l, d->n + k);
}

/* F's tangent out of the value of D. */
static ad_var tangent_half(const struct derivative *d)
{
    size_t states, outs;
    halves(d, &states, &outs);
    if (!outs)
        return ad_slice_cols(d->scan, states, states);
    ad_var out = ad_slice_cols(d->scan, 2 * states + outs, outs);
    if (!states)
        return out;
    return ad_concat_cols(2, (ad_var[]){ad_slice_cols(d->scan, states, states), out});
}

/* D's adjoint by F's operands with a seed of v for F's value (id 0: none) and w for its tangent. */
static ad_var adjoint_of_tangent(const struct derivative *d, ad_var v, ad_var w)
{
    size_t states, outs, n = 0;
    ad_var parts[4];
    size_t row[4] = {0}, col[4];
    halves(d, &states, &outs);
    if (d->tape->error.status != AD_OK)
        return ad_at(d->tape, 0);
    for (int half = 0; half < 2; half++) {
        ad_var seed = half ? w : v;
        if (!seed.id)
            continue;
        seed = ad_broadcast(seed, 1, states + outs);
        col[n] = half ? states : 0;
        if (states)
            parts[n++] = ad_slice_cols(seed, 0, states);
        col[n] = 2 * states + (half ? outs : 0);
        if (outs)
            parts[n++] = ad_slice_cols(seed, states, outs);
    }
    ad_var operands[2] = {d->scan, ad_place(d->tape, 1, 2 * (states + outs), n, parts, row, col)};
    memcpy(d->operands + d->n_tangent, operands, sizeof operands);
    return ad_append_scan(d->tape, AD_OP_scan_adjoint, d->tangent, d->n_tangent + 2, d->operands,
                          d->wanted);
}

/* ---- rules ---- */

/* Hands the adjoints in y, of those operands that `wanted` marks, to the operands. */
static void pass_on(struct sweep *s, const struct derivative *d, const uint8_t *wanted, ad_var y)
{
    size_t at = 0;
    for (uint32_t k = 0; k < d->n && s->tape->error.status == AD_OK; k++) {
        size_t rows = ad_rows(d->z[k]), cols = ad_cols(d->z[k]);
        if (!wanted[k])
            continue;
        ad_accumulate(s, d->z[k].id, ad_reshape(ad_slice_cols(y, at, rows * cols), rows, cols));
        at += rows * cols;
    }
}

static void scan_rule(struct sweep *s, const struct derivative *d, const uint8_t *wanted, ad_var y,
                      ad_var g)
{
    memcpy(d->operands, d->z, d->n * sizeof *d->z);
    d->operands[d->n] = y;
    d->operands[d->n + 1] = g;
    pass_on(s, d, wanted,
            ad_append_scan(s->tape, AD_OP_scan_adjoint, d->loop, d->n + 2, d->operands, wanted));
}

static void adjoint_rule(struct sweep *s, struct derivative *d, const struct node *n,
                         const uint8_t *wanted, ad_var g)
{
    ad_tape *tape = s->tape;
    ad_var w = ad_at(tape, input_of(tape, n, d->n + 1));
    size_t at = 0;
    bool any = false;
    for (uint32_t k = 0; k < d->n; k++) {
        size_t rows = ad_rows(d->z[k]), cols = ad_cols(d->z[k]);
        any = any || wanted[k];
        if (!is_wanted(tape, n, k))
            continue;
        d->u[k] = ad_reshape(ad_slice_cols(g, at, rows * cols), rows, cols);
        at += rows * cols;
    }
    append_tangent(d, wanted);
    if (is_needed(s, w.id))
        ad_accumulate(s, w.id, tangent_half(d));
    if (any)
        pass_on(s, d, wanted, adjoint_of_tangent(d, ad_at(tape, 0), w));
}

void ad_scan_rule(struct sweep *s, const struct node *node, ad_var y, ad_var g)
{
    const struct node n = *node;
    struct derivative d;
    uint8_t *wanted = NULL;
    if (begin(&d, s->tape, &n) && (wanted = calloc(d.n + 1, 1))) {
        for (uint32_t k = 0; k < d.n; k++)
            wanted[k] = is_needed(s, d.z[k].id);
        if (n.op == AD_OP_scan)
            scan_rule(s, &d, wanted, y, g);
        else
            adjoint_rule(s, &d, &n, wanted, g);
    } else {
        ad_fail(&s->tape->error, AD_E_MEMORY, "out of memory in the gradient");
    }
    free(wanted);
    finish(&d);
}

ad_var ad_scan_tangent(const struct node *n, ad_var y, const uint32_t *tangent)
{
    ad_tape *tape = y.tape;
    ad_var none = ad_at(tape, 0), result = none, w = none, v = none;
    struct derivative d;
    uint8_t *wanted = NULL;
    bool any = false, adjoint = n->op == AD_OP_scan_adjoint;
    if (!begin(&d, tape, n) || !(wanted = calloc(d.n + 1, 1))) {
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory in the derivative");
        finish(&d);
        return none;
    }
    for (uint32_t k = 0; k < d.n; k++) {
        d.u[k] = ad_at(tape, tangent[d.z[k].id]);
        any = any || d.u[k].id;
        wanted[k] = adjoint && is_wanted(tape, n, k);
    }
    if (adjoint) {
        w = ad_at(tape, input_of(tape, n, d.n + 1));
        v = ad_at(tape, tangent[w.id]);
    }
    if (any) {
        append_tangent(&d, wanted);
        result = adjoint ? adjoint_of_tangent(&d, v, w) : tangent_half(&d);
    } else if (v.id) { /* linear in the seed */
        memcpy(d.operands, d.z, d.n * sizeof *d.z);
        d.operands[d.n] = ad_at(tape, input_of(tape, n, d.n));
        d.operands[d.n + 1] = v;
        result = ad_append_scan(tape, AD_OP_scan_adjoint, d.loop, d.n + 2, d.operands, wanted);
    }
    free(wanted);
    finish(&d);
    return result;
}
