/* Builds the graph of the nodes that the outputs need: removes dead nodes, shares equal ones
   (common subexpressions), and marks values that depend on constants or held inputs alone.

   Folding constants makes equations of motion 1.6 times as fast, because masses and index lists are
   most of their nodes; sharing reciprocals 1.05 to 1.2 times. */
#include "graph.h"
#include "autodiff/free.h"

#include <stdlib.h>
#include <string.h>

static void mark_live(const ad_tape *tape, uint8_t *live)
{
    for (size_t id = tape->n_nodes; id-- > 0;) {
        const struct node *n = node_at(tape, (uint32_t)id);
        if (n->op == AD_OP_input)
            live[id] = 1; /* programs keep all inputs: they can always be set */
        for (size_t k = 0, inputs = live[id] ? n_inputs(tape, n) : 0; k < inputs; k++)
            live[input_of(tape, n, k)] = 1;
    }
}

/* ---- equal nodes ---- */

static uint64_t mix(uint64_t h, uint64_t x)
{
    h = (h ^ x) * 0x9e3779b97f4a7c15u;
    return h ^ h >> 29;
}

static uint64_t hash_bytes(uint64_t h, const void *data, size_t bytes)
{
    const char *p = data;
    for (; bytes >= 8; p += 8, bytes -= 8) {
        uint64_t x;
        memcpy(&x, p, 8);
        h = mix(h, x);
    }
    uint64_t x = 0;
    memcpy(&x, p, bytes);
    return mix(h, x);
}

/* The data of a node beside its inputs. */
static const void *payload(const ad_tape *tape, const struct value *v, size_t *bytes)
{
    *bytes = 0;
    switch (v->op) {
    case AD_OP_constant:
        *bytes = (size_t)v->rows * v->cols * sizeof(double);
        return tape->numbers + v->aux;
    case AD_OP_diff:
    case AD_OP_diff_adjoint:
        *bytes = sizeof(double);
        return tape->numbers + v->aux;
    case AD_OP_gather:
    case AD_OP_scatter:
    case AD_OP_gather_cols:
    case AD_OP_scatter_cols:
        *bytes = (tape->lists[v->aux] + 1) * sizeof(uint32_t);
        return tape->lists + v->aux;
    case AD_OP_matmul:
    case AD_OP_cumsum:
    case AD_OP_factor:
    case AD_OP_solve:
    case AD_OP_logdet:
    case AD_OP_custom:
    case AD_OP_custom_adjoint:
        *bytes = sizeof v->aux;
        return &v->aux;
    default:
        return NULL;
    }
}

static uint64_t hash(const ad_tape *tape, const struct value *v)
{
    uint64_t h = mix((uint64_t)v->in[2] << 16 ^ v->op, (uint64_t)v->in[0] << 32 | v->in[1]);
    h = mix(h, (uint64_t)v->rows << 32 | v->cols);
    size_t bytes;
    const void *data = payload(tape, v, &bytes);
    return data ? hash_bytes(h, data, bytes) : h;
}

static bool equal(const ad_tape *tape, const struct value *a, const struct value *b)
{
    if (a->op != b->op || a->rows != b->rows || a->cols != b->cols ||
        memcmp(a->in, b->in, sizeof a->in) != 0)
        return false;
    size_t na, nb;
    const void *da = payload(tape, a, &na), *db = payload(tape, b, &nb);
    return na == nb && (!na || memcmp(da, db, na) == 0);
}

static bool commutes(uint16_t op)
{
    return op == AD_OP_add || op == AD_OP_mul || op == AD_OP_eq || op == AD_OP_ne;
}

/* Hash table of values, open addressing: 1 + their number, and half of their hash, so that a probe
   rarely reads another value. The first cache line probed goes by the sum of two operands: as
   programs go through their values in some order, it is often in the cache. */
enum { LINE = 8 };
struct known {
    struct known_value {
        uint32_t number, hash;
    } * table;
    size_t mask;
};

/* The slot of a value equal to v, or the free slot where it belongs, with its hash. */
static struct known_value *look_up(const struct graph *g, const struct value *v,
                                   const struct known *known)
{
    uint64_t full = hash(g->tape, v);
    uint32_t half = (uint32_t)(full >> 32);
    size_t line = ((size_t)v->in[0] + v->in[1]) & known->mask & ~(size_t)(LINE - 1), probe = 0;
    struct known_value *slot = &known->table[line];
    while (slot->number &&
           (slot->hash != half || !equal(g->tape, &g->values[slot->number - 1], v))) {
        size_t far = full + ++probe * (half | 1); /* steps differ: neighbouring lines may be full */
        slot = &known->table[probe < LINE ? line + probe : far & known->mask];
    }
    if (!slot->number)
        slot->hash = half;
    return slot;
}

/* Gradients of roots need recip0(x), and potentials have already divided by x: selecting that
   quotient, or x itself where it is 0, is cheaper than a second division. */
static void reuse_reciprocal(const struct graph *g, struct value *v, const struct known *known)
{
    struct value reciprocal = *v;
    reciprocal.op = AD_OP_recip;
    uint32_t found = look_up(g, &reciprocal, known)->number;
    if (!found)
        return;
    v->op = AD_OP_select;
    v->in[1] = found - 1;
    v->in[2] = v->in[0];
}

/* The number of an earlier value equal to the one behind the last, or that of this new one. */
static uint32_t share(struct graph *g, const struct known *known)
{
    struct value *v = &g->values[g->n];
    if (v->op == AD_OP_detach || v->op == AD_OP_copy)
        return v->in[0];
    if (v->op == AD_OP_recip0)
        reuse_reciprocal(g, v, known);
    if (v->op != AD_OP_input && !has_operand_list(v->op)) {
        struct known_value *slot = look_up(g, v, known);
        if (slot->number)
            return slot->number - 1;
        slot->number = (uint32_t)g->n + 1;
    }
    g->has[v->op] = true;
    return (uint32_t)g->n++;
}

/* What a custom operation points to may change between runs, in the steps of a loop, too. */
static bool has_custom(const ad_tape *tape, const struct node *n)
{
    if (n->op != AD_OP_scan && n->op != AD_OP_scan_adjoint)
        return ad_is_custom(n->op);
    const ad_tape *body = tape->loops[n->in[1]].body;
    for (uint32_t id = 0; id < body->n_nodes; id++)
        if (has_custom(body, node_at(body, id)))
            return true;
    return false;
}

/* The operands of n as values, in one order where it does not matter. */
static void renumber_operands(const struct graph *g, const struct node *n, uint32_t in[3])
{
    for (size_t k = 0; k < 3; k++)
        in[k] = k < ad_ops[n->op].arity ? g->renumber[n->in[k]] : n->in[k];
    if (commutes(n->op) && in[0] > in[1]) {
        uint32_t swap = in[0];
        in[0] = in[1];
        in[1] = swap;
    }
}

/* Makes the value behind the last. */
static void renumber(struct graph *g, uint32_t id)
{
    const struct node *n = node_at(g->tape, id);
    struct value *v = &g->values[g->n];
    *v = (struct value){.op = n->op, .rows = n->rows, .cols = n->cols, .aux = n->aux};
    g->nodes[g->n] = id;
    renumber_operands(g, n, v->in);
    uint16_t fixed = n->op != AD_OP_input     ? VALUE_CONSTANT | VALUE_HELD
                     : (n->flags & NODE_HELD) ? VALUE_HELD
                                              : 0;
    if (n->op < AD_OP_copy && has_custom(g->tape, n))
        fixed = 0;
    for (size_t k = 0, inputs = n_inputs(g->tape, n); k < inputs; k++)
        fixed &= g->values[g->renumber[input_of(g->tape, n, k)]].flags;
    v->flags = fixed;
}

/* ---- inputs and outputs by node ---- */

static int by_node(const void *a, const void *b)
{
    const struct port *p = a, *q = b;
    return p->node != q->node ? (p->node > q->node) - (p->node < q->node) : q->input - p->input;
}

static bool list_ports(struct graph *g, size_t n_out, const ad_var out[])
{
    size_t inputs = 0;
    const uint32_t last = g->tape->last_input;
    for (uint32_t id = last; id; id = node_at(g->tape, id)->in[0])
        inputs++;
    g->ports = malloc((inputs + n_out + 1) * sizeof *g->ports);
    if (!g->ports)
        return false;
    for (uint32_t id = last; id; id = node_at(g->tape, id)->in[0])
        g->ports[g->n_ports++] = (struct port){id, g->renumber[id], true};
    for (size_t k = 0; k < n_out; k++) {
        uint32_t value = g->renumber[out[k].id];
        g->values[value].flags |= VALUE_OUTPUT;
        g->ports[g->n_ports++] = (struct port){out[k].id, value, false};
    }
    qsort(g->ports, g->n_ports, sizeof *g->ports, by_node);
    return true;
}

static size_t power_of_two_above(size_t n)
{
    size_t p = 16;
    while (p < n)
        p *= 2;
    return p;
}

bool ad_graph_build(struct graph *g, const ad_tape *tape, size_t n_out, const ad_var out[])
{
    bool built = false;
    size_t live_nodes = 0;
    struct known known = {0};
    uint8_t *live = ad_allocate_zeroed(tape->n_nodes, 1);
    g->tape = tape;
    g->renumber = ad_allocate_large(tape->n_nodes * sizeof *g->renumber);
    if (!live || !g->renumber)
        goto done;
    memset(g->renumber, 0xff, tape->n_nodes * sizeof *g->renumber); /* UINT32_MAX: not live */
    for (size_t k = 0; k < n_out; k++)
        live[out[k].id] = 1;
    mark_live(tape, live);
    for (size_t id = 0; id < tape->n_nodes; id++)
        live_nodes += live[id];
    known.mask = power_of_two_above(2 * live_nodes) - 1;
    known.table = ad_allocate_zeroed(known.mask + 1, sizeof *known.table);
    g->values = ad_allocate_large((live_nodes + 1) * sizeof *g->values);
    g->nodes = ad_allocate_large((live_nodes + 1) * sizeof *g->nodes);
    if (!known.table || !g->values || !g->nodes)
        goto done;
    for (uint32_t id = 0; id < tape->n_nodes; id++) {
        if (!live[id])
            continue;
        renumber(g, id);
        g->renumber[id] = share(g, &known);
    }
    built = list_ports(g, n_out, out);
done:
    AD_FREE(live, known.table);
    return built;
}

void ad_graph_release(struct graph *g)
{
    AD_FREE(g->values, g->nodes, g->locs, g->ports, g->lists, g->renumber, g->order, g->group_of,
            g->host, g->groups);
    *g = (struct graph){0};
}
