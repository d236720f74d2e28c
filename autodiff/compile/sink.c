/* Sinks values to a later level: one that is read lane by lane only in later segments is computed
   in the first of these, unless that keeps more values in memory than it saves. It then never
   passes through memory. In a gradient these are the factors of the chain rule that depend on the
   forward pass alone, and adjoints of time differences, whose operand is complete early.

   First-order gradients gain nothing; the product of a gas's Hessian with a vector, with some
   seventy values of pairs x slices, is 1.8 times as fast, compiled (where it would run out of
   registers) 16 times. */
#include "graph.h"

#include <stdlib.h>

enum { DEPTH = 6 }; /* depth of operands of operands that are considered */

struct uses {
    uint32_t first; /* level of the first use, after sinking */
    uint32_t last;  /* of the last use, before sinking */
    uint32_t count;
    bool whole; /* read otherwise than lane by lane, by another stage, or by an accumulated sum */
};

static bool is_product(const struct graph *g, uint32_t i)
{
    return g->values[i].op == AD_OP_matmul;
}

/* Records what value i requires of its operands. */
static void note_uses(const struct graph *g, uint32_t i, const uint32_t *level, struct uses *uses)
{
    const struct value *v = &g->values[i];
    bool in_place = v->op == AD_OP_add && (is_product(g, v->in[0]) || is_product(g, v->in[1]));
    for (size_t k = 0; k < n_operands(g, v); k++) {
        uint32_t root = operand_root(g, v, k);
        const uint16_t stage = VALUE_CONSTANT | VALUE_HELD;
        struct uses *u = &uses[root];
        u->whole |= in_place || !reads_in_step(g, v, k) ||
                    ((v->flags ^ g->values[root].flags) & stage) != 0;
        u->count++;
        u->last = level[i] > u->last ? level[i] : u->last;
    }
}

static bool can_wait(const struct graph *g, uint32_t i, const struct uses *u)
{
    const struct value *v = &g->values[i];
    return (ad_ops[v->op].elementwise || is_stencil(v->op)) && !(v->flags & VALUE_OUTPUT) &&
           !u->whole;
}

/* How many values of v's size would have to live until `level` for v, counted up to a few. An
   operand read by v alone can be sunk with it, which extends its own operands instead; the depth of
   this search is bounded, so that the time stays linear in the program. */
static unsigned kept_alive(const struct graph *g, const struct value *v, uint32_t level,
                           const struct uses *uses, int depth)
{
    unsigned n = 0;
    for (size_t k = 0; k < n_operands(g, v); k++) {
        uint32_t root = operand_root(g, v, k);
        const struct value *x = &g->values[root];
        bool again = (k > 0 && v->in[0] == v->in[k]) || (k > 1 && v->in[1] == v->in[k]);
        bool lives = is_leaf(x) || (x->flags & VALUE_OUTPUT) || uses[root].last >= level;
        if (lives || again || (size_t)x->rows * x->cols < (size_t)v->rows * v->cols)
            continue;
        unsigned instead = 1;
        if (depth > 0 && uses[root].count == 1 && can_wait(g, root, &uses[root]))
            instead = kept_alive(g, x, level, uses, depth - 1);
        n += instead < 1 ? instead : 1;
    }
    return n;
}

bool ad_graph_sink(const struct graph *g, uint32_t *level)
{
    struct uses *uses = ad_allocate_zeroed(g->n + 1, sizeof *uses);
    if (!uses)
        return false;
    for (uint32_t i = 0; i < g->n; i++) {
        uses[i].first = UINT32_MAX;
        if (!is_given(&g->values[i]))
            note_uses(g, i, level, uses);
    }
    for (uint32_t i = (uint32_t)g->n; i-- > 0;) {
        const struct value *v = &g->values[i];
        const struct uses *u = &uses[i];
        if (is_given(v))
            continue;
        if (can_wait(g, i, u) && u->first != UINT32_MAX && u->first > level[i] &&
            kept_alive(g, v, u->first, uses, DEPTH) <= 1)
            level[i] = u->first;
        for (size_t k = 0; k < n_operands(g, v); k++) {
            struct uses *x = &uses[operand_root(g, v, k)];
            x->first = level[i] < x->first ? level[i] : x->first;
        }
    }
    free(uses);
    return true;
}
