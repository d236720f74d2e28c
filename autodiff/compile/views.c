/* Finds the values that are views of others: slices, gathers, reshapes and broadcasts are read from
   their operand's memory by strides and row lists. A view that is an output, or an operand of an
   operation that needs contiguous memory, becomes a copy. */
#include "autodiff/hash.h"
#include "graph.h"

#include <string.h>

static struct loc own_loc(const struct graph *g, uint32_t i)
{
    return (struct loc){.root = i, .rs = g->values[i].cols, .cs = 1};
}

bool ad_graph_add_loc(struct graph *g, struct loc loc, uint32_t *index)
{
    if (!ad_reserve((void **)&g->locs, g->n_locs, &g->max_locs, 1, sizeof *g->locs))
        return false;
    *index = (uint32_t)g->n_locs++;
    g->locs[*index] = loc;
    return true;
}

/* Turns a view into a copy of its source; in[1] is the number of the source's location. */
static bool make_copy(struct graph *g, uint32_t i)
{
    struct value *v = &g->values[i];
    if (!(v->flags & VALUE_VIEW))
        return true;
    if (!ad_graph_add_loc(g, g->locs[i], &v->in[1]))
        return false;
    v->flags &= (uint16_t)~VALUE_VIEW;
    v->op = AD_OP_copy;
    g->locs[i] = own_loc(g, i);
    return true;
}

/* Copies an index list of the tape, or finds a copy: those of a gradient or of several directions
   stay in the cache as one. Returns 1 + its offset, 0 when out of memory. */
static uint32_t copy_list(struct graph *g, uint32_t at)
{
    const uint32_t *list = g->tape->lists + at;
    const size_t bytes = list[0] * sizeof *list;
    struct known_list *known =
        &g->known_lists[ad_hash(AD_HASH_BEGIN, list, bytes + sizeof *list) % KNOWN_LISTS];
    if (known->n && known->n == list[0] && !memcmp(g->lists + known->first, list + 1, bytes))
        return known->first + 1;
    if (!ad_reserve((void **)&g->lists, g->n_lists, &g->max_lists, list[0], sizeof *g->lists))
        return 0;
    memcpy(g->lists + g->n_lists, list + 1, bytes);
    *known = (struct known_list){(uint32_t)g->n_lists, list[0]};
    g->n_lists += list[0];
    return known->first + 1;
}

/* The location of v, given that of its operand x. */
static bool look_through(struct graph *g, const struct value *v, const struct value *x,
                         struct loc *l)
{
    switch (v->op) {
    case AD_OP_slice:
        if (l->list)
            l->list += v->in[1];
        else
            l->off += (size_t)v->in[1] * l->rs;
        l->off += (size_t)v->in[2] * l->cs;
        return true;
    case AD_OP_gather:
        l->list = copy_list(g, v->aux);
        return l->list != 0;
    case AD_OP_reshape:
        l->rs = v->cols;
        l->cs = 1;
        return true;
    default: /* broadcast */
        if (x->rows == 1 && v->rows > 1) {
            if (l->list)
                l->off += (size_t)g->lists[l->list - 1] * l->rs;
            l->list = 0;
            l->rs = 0;
        }
        if (x->cols == 1 && v->cols > 1)
            l->cs = 0;
        return true;
    }
}

static bool view_of(struct graph *g, uint32_t i)
{
    struct value *v = &g->values[i];
    const struct value *x = &g->values[v->in[0]];
    bool copy_first = (v->op == AD_OP_gather && g->locs[v->in[0]].list) ||
                      (v->op == AD_OP_reshape && !is_contiguous(x, &g->locs[v->in[0]]));
    if (copy_first && !make_copy(g, v->in[0]))
        return false;
    struct loc l = g->locs[v->in[0]];
    if (!look_through(g, v, x, &l))
        return false;
    v->flags |= VALUE_VIEW;
    v->in[1] = v->in[2] = 0;
    g->locs[i] = l;
    return !(v->flags & VALUE_OUTPUT) || make_copy(g, i);
}

static bool is_view_op(uint16_t op)
{
    return op == AD_OP_slice || op == AD_OP_gather || op == AD_OP_reshape || op == AD_OP_broadcast;
}

static bool has_list(uint16_t op)
{
    return op == AD_OP_scatter || op == AD_OP_gather_cols || op == AD_OP_scatter_cols;
}

/* Copies views that the operation cannot read; place reads its parts through any view. */
static bool copy_unreadable(struct graph *g, const struct value *v)
{
    if (v->op == AD_OP_place || !(is_alone(v->op) || is_stencil(v->op)))
        return true;
    for (size_t k = 0; k < n_operands(g, v); k++) {
        const struct loc *l = &g->locs[operand(g, v, k)];
        const struct value *x = &g->values[operand(g, v, k)];
        bool repeats_cols = l->cs == 0 && x->cols > 1, repeats_rows = l->rs == 0 && x->rows > 1;
        bool unreadable = repeats_cols || (is_alone(v->op) && (l->list || repeats_rows));
        if (unreadable && !make_copy(g, operand(g, v, k)))
            return false;
    }
    return true;
}

bool ad_graph_find_views(struct graph *g)
{
    g->locs = ad_allocate_large((g->n + 1) * sizeof *g->locs);
    if (!g->locs)
        return false;
    g->n_locs = g->max_locs = g->n;
    for (uint32_t i = 0; i < g->n; i++) {
        struct value *v = &g->values[i];
        if (is_view_op(v->op)) {
            if (!view_of(g, i))
                return false;
            continue;
        }
        g->locs[i] = own_loc(g, i);
        if (v->op == AD_OP_copy)
            v->in[1] = 0;
        if (has_list(v->op) && !(v->in[1] = copy_list(g, v->aux)))
            return false;
        if (!copy_unreadable(g, v))
            return false;
    }
    return true;
}
