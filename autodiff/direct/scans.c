/* Loops in direct evaluation (direct.h). Their steps are compiled the first time, and kept with the
   tape. Backward, all adjoints are computed, from states stored on a run of their own. */
#include "autodiff/free.h"
#include "autodiff/gradient/sweep.h"
#include "autodiff/scan/scan.h"
#include "direct.h"

#include <stdlib.h>
#include <string.h>

/* A loop ready to run, and room for its operands, value and adjoints. */
struct ready {
    const struct loop *loop;
    struct matrix_at *z;
    char *value, *adjoints;
    size_t element;
};

static size_t total(const struct loop *l, uint32_t from, uint32_t to)
{
    size_t n = 0;
    for (uint32_t k = from; k < to; k++)
        n += loop_size(l, k);
    return n;
}

static bool prepare(const ad_tape *tape, uint32_t number, struct ready *r, struct ad_error *error)
{
    struct loop *l = &tape->loops[number];
    const uint32_t n = loop_operands(l);
    *r = (struct ready){.loop = l, .element = type_bytes(tape->type)};
    r->z = calloc((size_t)n + 1, sizeof *r->z);
    r->value = calloc(total(l, n, n + loop_results(l)) + 1, r->element);
    r->adjoints = calloc(total(l, 0, n) + 1, r->element);
    uint8_t *all = malloc((size_t)n + 1);
    bool done = r->z && r->value && r->adjoints && all;
    if (done) {
        memset(all, 1, n);
        l->run = l->run ? l->run : ad_scan_new(l, error);
        l->adjoint = l->adjoint ? l->adjoint : ad_scan_adjoint_new(l, all, error);
        done = l->run && l->adjoint && ad_scan_keep(l->run);
    }
    free(all);
    if (!done)
        ad_fail(error, AD_E_MEMORY, "out of memory for a loop");
    return done;
}

static void release(struct ready *r) { AD_FREE(r->z, r->value, r->adjoints); }

static void keep_error(const struct ad_error *found, uint32_t id, const struct node *n,
                       struct ad_error *error)
{
    if (found->status != AD_OK)
        ad_fail(error, found->status, "node %u (%s): %s", id, ad_op_name((enum ad_op)n->op),
                found->message);
}

static void run(struct ready *r, uint32_t id, const struct node *n, struct ad_error *error)
{
    ad_scan_run(r->loop->run, r->z, r->value, false);
    keep_error(ad_scan_error(r->loop->run), id, n, error);
}

/* Back from `seed`, after run(). */
static void run_back(struct ready *r, const char *seed, uint32_t id, const struct node *n,
                     struct ad_error *error)
{
    ad_scan_adjoint_run(r->loop->adjoint, r->loop->run, r->z, seed, r->adjoints, false);
    keep_error(ad_scan_adjoint_error(r->loop->adjoint), id, n, error);
}

static struct matrix_at operand_at(const ad_tape *tape, const struct ad_direct *d, uint32_t id)
{
    const size_t element = type_bytes(tape->type);
    return (struct matrix_at){(const char *)d->value + direct_offset(d, id) * element,
                              node_at(tape, id)->cols * element};
}

/* to += from */
static void add(enum ad_type type, size_t n, void *to, const void *from)
{
    for (size_t i = 0; i < n; i++)
        if (type == AD_F32)
            ((float *)to)[i] += ((const float *)from)[i];
        else
            ((double *)to)[i] += ((const double *)from)[i];
}

static char *adjoint_at(const ad_tape *tape, const struct ad_direct *d, uint32_t id)
{
    return (char *)d->adjoint + direct_offset(d, id) * type_bytes(tape->type);
}

static bool wants(const ad_tape *tape, const struct node *n, uint32_t k)
{
    return tape->lists[n->aux + 1 + 3 * k + 1];
}

void ad_direct_scan(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    struct ready r;
    if (prepare(tape, n->in[1], &r, &d->error)) {
        const uint32_t operands = loop_operands(r.loop);
        char *y = (char *)d->value + direct_offset(d, id) * r.element;
        const char *from = r.adjoints;
        for (uint32_t k = 0; k < operands; k++)
            r.z[k] = operand_at(tape, d, input_of(tape, n, k));
        run(&r, id, n, &d->error);
        if (n->op == AD_OP_scan) {
            memcpy(y, r.value, node_size(n) * r.element);
        } else {
            run_back(&r, operand_at(tape, d, input_of(tape, n, operands + 1)).start, id, n,
                     &d->error);
            for (uint32_t k = 0; k < operands; k++) {
                const size_t bytes = loop_size(r.loop, k) * r.element;
                if (wants(tape, n, k))
                    memcpy(y, from, bytes);
                y += wants(tape, n, k) ? bytes : 0;
                from += bytes;
            }
        }
    }
    release(&r);
}

static void scan_back(const ad_tape *tape, struct ad_direct *d, uint32_t id, const struct node *n)
{
    struct ready r;
    if (prepare(tape, n->in[1], &r, &d->error)) {
        const char *from = r.adjoints;
        for (uint32_t k = 0; k < loop_operands(r.loop); k++)
            r.z[k] = operand_at(tape, d, input_of(tape, n, k));
        run(&r, id, n, &d->error);
        run_back(&r, adjoint_at(tape, d, id), id, n, &d->error);
        for (uint32_t k = 0; k < loop_operands(r.loop); k++) {
            add(tape->type, loop_size(r.loop, k), adjoint_at(tape, d, input_of(tape, n, k)), from);
            from += loop_size(r.loop, k) * r.element;
        }
    }
    release(&r);
}

/* Operands of the loop and its tangent, which moves along what the adjoint of this node says; of
   operands not wanted along 0. */
static void set_tangent_operands(const ad_tape *tape, const struct ad_direct *d,
                                 const struct node *n, uint32_t id, const struct loop *l,
                                 const char *zeros, struct matrix_at *z)
{
    const size_t element = type_bytes(tape->type);
    const char *u = adjoint_at(tape, d, id);
    const uint32_t end[] = {l->n_state, l->n_state + l->n_in, loop_operands(l)};
    for (uint32_t kind = 0, k = 0; kind < 3; kind++) {
        const uint32_t first = k, count = end[kind] - first;
        for (; k < end[kind]; k++, z++) {
            const bool moves = wants(tape, n, k);
            z[0] = operand_at(tape, d, input_of(tape, n, k));
            z[count] = (struct matrix_at){moves ? u : zeros, loop_cols(l, k) * element};
            u += moves ? loop_size(l, k) * element : 0;
        }
        z += count;
    }
}

/* As in gradient/rules_scan.c. */
static void adjoint_back(const ad_tape *tape, struct ad_direct *d, uint32_t id,
                         const struct node *n)
{
    const uint32_t number = n->in[1], operands = loop_operands(&tape->loops[number]),
                   w = input_of(tape, n, operands + 1);
    const size_t e = type_bytes(tape->type);
    uint8_t *along = malloc((size_t)operands + 1);
    uint32_t tangent = UINT32_MAX;
    for (uint32_t k = 0; along && k < operands; k++)
        along[k] = k >= tape->loops[number].n_state;
    if (along) /* loops may be added to the tape: nothing that was recorded changes */
        tangent = ad_tangent_loop((ad_tape *)(uintptr_t)tape, number, along);
    free(along);
    const struct loop l = tape->loops[number];
    const size_t states = total(&l, operands, operands + l.n_state),
                 outs = total(&l, operands + l.n_state, operands + loop_results(&l));
    struct ready r = {0};
    char *zeros = calloc(total(&l, 0, operands) + 1, e), *seed = calloc(2 * (states + outs) + 1, e);
    if (tangent == UINT32_MAX || !zeros || !seed) {
        ad_fail(&d->error, AD_E_MEMORY, "out of memory for a loop");
    } else if (prepare(tape, tangent, &r, &d->error)) {
        const char *of_w = operand_at(tape, d, w).start, *from = r.adjoints;
        char *to_w = adjoint_at(tape, d, w);
        set_tangent_operands(tape, d, n, id, &l, zeros, r.z);
        run(&r, id, n, &d->error);
        add(tape->type, states, to_w, r.value + states * e);
        add(tape->type, outs, to_w + states * e, r.value + (2 * states + outs) * e);
        memcpy(seed + states * e, of_w, states * e);
        memcpy(seed + (2 * states + outs) * e, of_w + states * e, outs * e);
        run_back(&r, seed, id, n, &d->error);
        const uint32_t end[] = {l.n_state, l.n_state + l.n_in, operands};
        for (uint32_t kind = 0, k = 0; kind < 3; kind++) {
            const uint32_t first = k;
            for (; k < end[kind]; k++) {
                add(tape->type, loop_size(&l, k), adjoint_at(tape, d, input_of(tape, n, k)), from);
                from += loop_size(&l, k) * e;
            }
            from += total(&l, first, end[kind]) * e;
        }
    }
    release(&r);
    AD_FREE(zeros, seed);
}

void ad_direct_scan_back(const ad_tape *tape, struct ad_direct *d, uint32_t id)
{
    const struct node *n = node_at(tape, id);
    (n->op == AD_OP_scan ? scan_back : adjoint_back)(tape, d, id, n);
}
