/* Recording of loops: a node of the tape runs a copy of the body a given number of times. All
   results of the node are concatenated in one row, of which the caller receives slices. */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "autodiff/internal.h"

#include <stdlib.h>
#include <string.h>

/* ---- loops of a tape ---- */

static void free_loop(struct loop *l)
{
    ad_scan_free(l->run);
    ad_scan_adjoint_free(l->adjoint);
    ad_tape_free(l->body);
    AD_FREE(l->ids, l->along);
}

void ad_loops_free(ad_tape *tape)
{
    for (size_t k = 0; k < tape->n_loops; k++)
        free_loop(&tape->loops[k]);
    tape->n_loops = 0;
}

static void mark_held(const struct loop *l)
{
    const uint32_t first = l->n_state + l->n_in;
    for (uint32_t k = 0; k < loop_operands(l); k++) {
        struct node *n = node_at(l->body, l->ids[k]);
        n->flags = (uint16_t)(k < first ? n->flags & ~NODE_HELD : n->flags | NODE_HELD);
    }
}

uint32_t ad_append_loop(ad_tape *tape, struct loop loop)
{
    bool complete = loop.body && loop.ids && (loop.along || !loop.tangent_of);
    if (!complete || !ad_reserve((void **)&tape->loops, tape->n_loops, &tape->max_loops, 1,
                                 sizeof *tape->loops)) {
        free_loop(&loop);
        ad_fail(&tape->error, AD_E_MEMORY, "out of memory for a loop");
        return UINT32_MAX;
    }
    mark_held(&loop);
    tape->loops[tape->n_loops] = loop;
    return (uint32_t)tape->n_loops++;
}

static void *duplicate(const void *from, size_t bytes)
{
    void *to = from ? malloc(bytes + 1) : NULL;
    return to ? memcpy(to, from, bytes) : NULL;
}

bool ad_loops_copy(ad_tape *copy, const ad_tape *tape)
{
    for (size_t k = 0; k < tape->n_loops; k++) {
        struct loop l = tape->loops[k];
        const struct loop *parent = l.tangent_of ? &tape->loops[l.tangent_of - 1] : NULL;
        l.body = ad_tape_copy(l.body);
        l.ids = duplicate(l.ids, (loop_operands(&l) + loop_results(&l)) * sizeof *l.ids);
        l.along = parent ? duplicate(l.along, loop_operands(parent)) : NULL;
        l.run = NULL;
        l.adjoint = NULL;
        if (ad_append_loop(copy, l) == UINT32_MAX)
            return false;
    }
    return true;
}

/* ---- nodes ---- */

/* Elements of the value of a node. */
static size_t length(const struct loop *l, enum ad_op op, const uint8_t wanted[])
{
    size_t n = 0, operands = loop_operands(l);
    for (uint32_t k = 0; k < loop_results(l) && op == AD_OP_scan; k++)
        n += loop_size(l, (uint32_t)operands + k);
    for (uint32_t k = 0; k < operands && op != AD_OP_scan; k++)
        n += wanted[k] ? loop_size(l, k) : 0;
    return n;
}

ad_var ad_append_scan(ad_tape *tape, enum ad_op op, uint32_t loop, size_t n,
                      const ad_var operands[], const uint8_t wanted[])
{
    uint32_t list = UINT32_MAX, *entries = malloc((3 * n + 1) * sizeof *entries);
    if (tape->error.status != AD_OK || loop == UINT32_MAX || !entries) {
        free(entries);
        return ad_refuse(tape, AD_E_MEMORY, "out of memory for a loop");
    }
    size_t size = length(&tape->loops[loop], op, wanted);
    for (size_t k = 0; k < n; k++) {
        entries[3 * k] = operands[k].id;
        entries[3 * k + 1] = wanted && k < loop_operands(&tape->loops[loop]) ? wanted[k] : 0;
        entries[3 * k + 2] = 0;
    }
    if (ad_shape_fits(tape, op, 0, NULL, 1, size))
        list = ad_append_list(tape, 3 * n, entries);
    free(entries);
    if (list == UINT32_MAX)
        return ad_at(tape, 0);
    tape->lists[list] = (uint32_t)n; /* of three numbers each */
    return ad_append(
        tape,
        (struct node){
            .op = (uint16_t)op, .rows = 1, .cols = (uint32_t)size, .in = {0, loop}, .aux = list});
}

/* ---- what a user gives ---- */

static bool refuse(ad_tape *tape, enum ad_status status, const char *what, size_t k,
                   const char *wrong)
{
    ad_refuse_operands(tape, status, AD_OP_scan, 0, NULL, "%s %zu %s", what, k, wrong);
    return false;
}

/* Numbers of the variables x[0..n-1] of the body, which are inputs, named once, or any. */
static bool take(ad_tape *tape, const ad_tape *body, const char *what, size_t n, const ad_var x[],
                 bool inputs, uint32_t *ids, uint8_t *seen)
{
    for (size_t k = 0; k < n; k++) {
        if (!x || x[k].tape != body || !ad_is_current(x[k]))
            return refuse(tape, AD_E_TAPE, what, k, "is no variable of the body's tape");
        if (inputs && node_at(body, x[k].id)->op != AD_OP_input)
            return refuse(tape, AD_E_ARGUMENT, what, k, "is no input of the body");
        if (inputs && seen[x[k].id]++)
            return refuse(tape, AD_E_ARGUMENT, what, k, "was named before");
        ids[k] = x[k].id;
    }
    return true;
}

static bool same_shape(const ad_tape *tape, uint32_t a, uint32_t b)
{
    const struct node *p = node_at(tape, a), *q = node_at(tape, b);
    return p->rows == q->rows && p->cols == q->cols;
}

static bool take_all(ad_tape *tape, const struct ad_body *b, struct loop *l, uint8_t *seen)
{
    uint32_t *in = l->ids + l->n_state, *shared = in + l->n_in, *next = shared + l->n_shared;
    if (!take(tape, b->tape, "state", b->n_state, b->state, true, l->ids, seen) ||
        !take(tape, b->tape, "input of a step", b->n_in, b->in, true, in, seen) ||
        !take(tape, b->tape, "shared input", b->n_shared, b->shared, true, shared, seen) ||
        !take(tape, b->tape, "next state", b->n_state, b->next, false, next, NULL) ||
        !take(tape, b->tape, "output of a step", b->n_out, b->out, false, next + l->n_state, NULL))
        return false;
    for (size_t k = 0; k < b->n_state; k++)
        if (!same_shape(b->tape, l->ids[k], next[k]))
            return refuse(tape, AD_E_SHAPE, "next state", k, "has another shape than the state");
    for (uint32_t id = 0; id < b->tape->n_nodes; id++)
        if (node_at(b->tape, id)->op == AD_OP_input && !seen[id])
            return refuse(tape, AD_E_ARGUMENT, "input of the body recorded as operation", id,
                          "is neither state nor input of a step nor shared");
    return true;
}

enum { VARIABLES_MOST = 1 << 20 }; /* of a kind */

static bool is_body(ad_tape *tape, const struct ad_body *b, size_t steps)
{
    const char *wrong = !b->tape          ? "got no body, or none with a tape (NULL)"
                        : b->tape == tape ? "the body is recorded on the tape of the loop"
                        : b->tape->type != tape->type ? "the body's tape is of another type"
                        : b->n_state > VARIABLES_MOST || b->n_in > VARIABLES_MOST ||
                                b->n_shared > VARIABLES_MOST || b->n_out > VARIABLES_MOST
                            ? "too many variables"
                        : steps > INT32_MAX               ? "got more than 2^31 - 1 steps"
                        : !steps && (b->n_in || b->n_out) ? "0 steps have no inputs and outputs"
                                                          : NULL;
    if (wrong)
        ad_refuse_operands(tape, AD_E_ARGUMENT, AD_OP_scan, 0, NULL, "%s", wrong);
    else if (b->tape->error.status != AD_OK)
        ad_refuse_operands(tape, b->tape->error.status, AD_OP_scan, 0, NULL, "in the body: %s",
                           b->tape->error.message);
    return tape->error.status == AD_OK;
}

static uint32_t new_loop(ad_tape *tape, const struct ad_body *b, size_t steps)
{
    struct loop l = {.body = ad_tape_copy(b->tape),
                     .steps = steps,
                     .checkpoints = b->checkpoints,
                     .proceed = b->proceed,
                     .context = b->context,
                     .n_state = (uint32_t)b->n_state,
                     .n_in = (uint32_t)b->n_in,
                     .n_shared = (uint32_t)b->n_shared,
                     .n_out = (uint32_t)b->n_out};
    l.ids = calloc(loop_operands(&l) + loop_results(&l) + 1, sizeof *l.ids);
    uint8_t *seen = calloc(b->tape->n_nodes, 1);
    bool complete = l.body && l.ids && seen;
    bool taken = complete && take_all(tape, b, &l, seen);
    free(seen);
    if (!complete || taken)
        return ad_append_loop(tape, l);
    free_loop(&l);
    return UINT32_MAX;
}

/* The operands x, of the shapes of ids[first ...]. */
static bool take_operands(ad_tape *tape, uint32_t loop, const char *what, uint32_t first, size_t n,
                          const ad_var x[], bool broadcasts, ad_var *operands)
{
    if (n && !x)
        return refuse(tape, AD_E_ARGUMENT, what, 0, "is missing (NULL)");
    if (!ad_all_on(tape, AD_OP_scan, what, n, x))
        return false;
    for (uint32_t k = 0; k < n; k++) {
        size_t rows = loop_rows(&tape->loops[loop], first + k);
        size_t cols = loop_cols(&tape->loops[loop], first + k);
        bool fits = ad_rows(x[k]) == rows && ad_cols(x[k]) == cols;
        if (!fits && !(broadcasts && (ad_rows(x[k]) == rows || ad_rows(x[k]) == 1) &&
                       (ad_cols(x[k]) == cols || ad_cols(x[k]) == 1))) {
            ad_refuse_operands(tape, AD_E_SHAPE, AD_OP_scan, 1, &x[k], "%s %u; expected %zu x %zu",
                               what, k, rows, cols);
            return false;
        }
        operands[first + k] = ad_broadcast(x[k], rows, cols);
    }
    return tape->error.status == AD_OK;
}

/* The results as the user sees them. */
static void hand_out(ad_var y, uint32_t loop, ad_var last[], ad_var out[])
{
    ad_tape *tape = y.tape;
    const uint32_t operands = loop_operands(&tape->loops[loop]), n = tape->loops[loop].n_state;
    size_t at = 0;
    for (uint32_t k = 0; k < loop_results(&tape->loops[loop]); k++) {
        const struct loop *l = &tape->loops[loop];
        size_t size = loop_size(l, operands + k);
        ad_var x = ad_reshape(ad_slice_cols(y, at, size), loop_rows(l, operands + k),
                              loop_cols(l, operands + k));
        ad_var *to = k < n ? last : out;
        if (to)
            to[k < n ? k : k - n] = x;
        at += size;
    }
}

static void set_refused(ad_tape *tape, size_t n, ad_var x[])
{
    for (size_t k = 0; x && k < n; k++)
        x[k] = ad_refused(tape);
}

static enum ad_status record(ad_tape *tape, const struct ad_body *b, size_t steps,
                             const ad_var start[], const ad_var in[], const ad_var shared[],
                             ad_var last[], ad_var out[])
{
    struct ad_body own;
    struct ad_error lacks = {0};
    if (tape->error.status != AD_OK)
        return tape->error.status;
    if (!AD_TAKE(&own, b, context, &lacks))
        ad_refuse_operands(tape, AD_E_ARGUMENT, AD_OP_scan, 0, NULL, "got no body: %s",
                           lacks.message);
    else
        is_body(tape, &own, steps);
    if (tape->error.status != AD_OK)
        return tape->error.status;
    b = &own;
    uint32_t loop = new_loop(tape, b, steps);
    if (loop == UINT32_MAX)
        return tape->error.status;
    const uint32_t n = loop_operands(&tape->loops[loop]), at_in = tape->loops[loop].n_state,
                   at_shared = at_in + tape->loops[loop].n_in;
    ad_var *operands = malloc((n + 1) * sizeof *operands);
    if (!operands)
        return ad_fail(&tape->error, AD_E_MEMORY, "out of memory for a loop");
    if (take_operands(tape, loop, "start", 0, b->n_state, start, true, operands) &&
        take_operands(tape, loop, "input of steps", at_in, b->n_in, in, false, operands) &&
        take_operands(tape, loop, "shared", at_shared, b->n_shared, shared, true, operands)) {
        if (steps)
            hand_out(ad_append_scan(tape, AD_OP_scan, loop, n, operands, NULL), loop, last, out);
        else
            for (size_t k = 0; last && k < b->n_state; k++)
                last[k] = operands[k];
    }
    free(operands);
    return tape->error.status;
}

/* last may be the array of start, so it is not written before. */
enum ad_status ad_scan(ad_tape *tape, const struct ad_body *b, size_t steps, const ad_var start[],
                       const ad_var in[], const ad_var shared[], ad_var last[], ad_var out[])
{
    enum ad_status status = tape ? record(tape, b, steps, start, in, shared, last, out) : AD_E_TAPE;
    if (status != AD_OK && b && b->n_state <= VARIABLES_MOST && b->n_out <= VARIABLES_MOST) {
        set_refused(tape, b->n_state, last);
        set_refused(tape, b->n_out, out);
    }
    return status;
}
