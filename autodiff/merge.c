/* Sums of sums: where the results of several sums over rows or scatters of one segment are only
   added up or subtracted, they all add into the memory of the total. A pair law's gradient is such
   a sum: one scatter for each side and coordinate. */
#include "program.h"

#include <stdlib.h>

static bool is_adder(const struct value *v)
{
    return v->op == AD_OP_sum_rows || v->op == AD_OP_scatter || (v->flags & VALUE_MERGED);
}

/* How often each value is read. */
static void count_uses(const struct graph *g, uint32_t *uses)
{
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        if (v->flags & VALUE_OUTPUT)
            uses[i]++;
        if (is_leaf(v) || (v->flags & VALUE_VIEW))
            continue;
        for (uint32_t k = 0; k < n_inputs(v); k++)
            uses[operand_loc(g, v, k)->root]++;
        if (v->op == AD_OP_place) {
            const uint32_t *list = g->tape->lists + v->aux;
            for (size_t k = 0; k < list[0]; k++)
                uses[g->locs[g->renumber[list[1 + 3 * k]]].root]++;
        }
    }
}

static bool can_merge(const struct graph *g, const struct value *v, const uint32_t *uses)
{
    uint32_t a = v->in[0], b = v->in[1];
    if ((v->op != AD_OP_add && v->op != AD_OP_sub) || a == b)
        return false;
    for (int k = 0; k < 2; k++) {
        const struct value *x = &g->values[v->in[k]];
        if (!is_adder(x) || (x->flags & VALUE_VIEW) || uses[v->in[k]] != 1 || x->rows != v->rows ||
            x->cols != v->cols)
            return false;
    }
    bool subtracts_total = v->op == AD_OP_sub && (g->values[b].flags & VALUE_MERGED);
    return g->group_of[a] == g->group_of[b] && !subtracts_total;
}

/* Merged values leave their groups: nothing computes them. */
static void drop_merged(struct graph *g)
{
    for (size_t i = 0; i < g->n_groups; i++) {
        uint32_t *member = g->order + g->groups[i].first, kept = 0;
        for (uint32_t k = 0; k < g->groups[i].count; k++)
            if (!(g->values[member[k]].flags & VALUE_MERGED))
                member[kept++] = member[k];
        g->groups[i].count = kept;
    }
}

bool ad_graph_merge(struct graph *g)
{
    uint32_t *uses = calloc(g->n + 1, sizeof *uses);
    g->host = calloc(g->n + 1, sizeof *g->host);
    if (!uses || !g->host) {
        free(uses);
        return false;
    }
    count_uses(g, uses);
    for (uint32_t i = 0; i < g->n; i++) {
        struct value *v = &g->values[i];
        if (is_leaf(v) || (v->flags & VALUE_VIEW) || !can_merge(g, v, uses))
            continue;
        for (int k = 0; k < 2; k++) {
            g->values[v->in[k]].flags |= VALUE_BORROWED | VALUE_STORED;
            g->host[v->in[k]] = i;
        }
        if (v->op == AD_OP_sub)
            g->values[v->in[1]].flags |= VALUE_NEGATED;
        v->flags |= VALUE_MERGED | VALUE_STORED;
        g->group_of[i] = g->group_of[v->in[0]];
    }
    drop_merged(g);
    free(uses);
    return true;
}
