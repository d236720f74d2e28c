/* Orders the groups so that those over the same columns follow each other where dependences allow,
   to form a pass (passes.c): what has no place in a pass waits until one ends. */
#include "autodiff/free.h"
#include "graph.h"

#include <stdlib.h>
#include <string.h>

enum {
    LEAST_COLUMNS = 64, /* of a pass */
    MOST_ROUNDS = 256   /* beyond these the order stays: time is linear in the program */
};

/* A product that adds its columns up has a place in passes of some blocks at least. */
static uint32_t columns_of_product(const struct graph *g, const struct value *v)
{
    enum { BLOCKS = 4 };
    uint32_t cols = g->values[v->in[0]].cols;
    if (!(v->aux & MATMUL_TB))
        return v->cols;
    return !(v->aux & MATMUL_TA) && v->cols != cols && ad_least_block(v) <= cols / BLOCKS ? cols
                                                                                          : 0;
}

uint32_t ad_pass_columns(const struct graph *g, const struct value *v)
{
    if (is_sink(v->op))
        return g->values[v->in[0]].cols;
    if (v->op == AD_OP_matmul)
        return columns_of_product(g, v);
    for (size_t k = 0; v->op == AD_OP_place && k < n_operands(g, v); k++)
        if (g->values[operand(g, v, k)].cols != v->cols)
            return 0;
    return is_alone(v->op) && v->op != AD_OP_place && v->op != AD_OP_gather_cols ? 0 : v->cols;
}

/* Groups to order, and the edges between them: readers of group k are those from start[k] on. */
struct order {
    const struct graph *g;
    size_t first, n;
    uint32_t *space; /* columns; 0 where no pass has a place for it */
    uint32_t *waits, *start, *readers;
    uint32_t *left; /* groups not yet in order */
    size_t n_left;
    uint32_t *done; /* groups in order */
    size_t n_done;
};

/* Counts or lists the edges to group k. */
static void visit_operands(struct order *o, size_t k, bool list)
{
    const struct graph *g = o->g;
    const struct group *group = &g->groups[o->first + k];
    for (uint32_t m = 0; m < group->count; m++) {
        const struct value *v = &g->values[g->order[group->first + m]];
        for (size_t j = 0; j < n_operands(g, v); j++) {
            uint32_t root = operand_root(g, v, j);
            size_t of = is_given(&g->values[root]) ? SIZE_MAX : g->group_of[root] - o->first;
            if (of >= o->n || of == k)
                continue; /* an input, or of an earlier stage */
            if (list)
                o->readers[--o->start[of]] = (uint32_t)k;
            else
                o->start[of]++;
            o->waits[k] += list;
        }
    }
}

static bool find_edges(struct order *o)
{
    for (size_t k = 0; k < o->n; k++)
        visit_operands(o, k, false);
    for (size_t k = 1; k <= o->n; k++)
        o->start[k] += o->start[k - 1];
    o->readers = malloc((o->start[o->n] + 1) * sizeof *o->readers);
    for (size_t k = 0; o->readers && k < o->n; k++)
        visit_operands(o, k, true);
    return o->readers;
}

/* Takes what is ready, over so many columns, in order. */
static void take(struct order *o, uint32_t space)
{
    size_t kept = 0;
    for (size_t i = 0; i < o->n_left; i++) {
        uint32_t k = o->left[i];
        if (o->waits[k] || o->space[k] != space) {
            o->left[kept++] = k;
            continue;
        }
        o->done[o->n_done++] = k;
        for (uint32_t r = o->start[k]; r < o->start[k + 1]; r++)
            o->waits[o->readers[r]]--;
    }
    o->n_left = kept;
}

static void take_all(struct order *o)
{
    for (size_t k = 0; k < o->n; k++)
        o->left[o->n_left++] = (uint32_t)k;
    for (int round = 0; o->n_left && round < MOST_ROUNDS; round++) {
        size_t i = 0;
        take(o, 0);
        while (i < o->n_left && o->waits[o->left[i]])
            i++;
        if (i < o->n_left)
            take(o, o->space[o->left[i]]);
    }
    for (size_t i = 0; i < o->n_left; i++)
        o->done[o->n_done++] = o->left[i];
}

/* Puts the groups into the order found. */
static bool apply(const struct order *o)
{
    struct group *groups = malloc((o->n + 1) * sizeof *groups);
    if (!groups)
        return false;
    memcpy(groups, o->g->groups + o->first, o->n * sizeof *groups);
    for (size_t k = 0; k < o->n; k++) {
        const struct group *group = &groups[o->done[k]];
        o->g->groups[o->first + k] = *group;
        for (uint32_t m = 0; m < group->count; m++)
            o->g->group_of[o->g->order[group->first + m]] = (uint32_t)(o->first + k);
    }
    free(groups);
    return true;
}

/* Finds the columns of the groups; false where those of a pass are not parted anyway. */
static bool find_spaces(struct order *o)
{
    const struct graph *g = o->g;
    bool parted = false;
    uint32_t wide = 0;
    for (size_t k = 0; k < o->n; k++) {
        const struct group *group = &g->groups[o->first + k];
        uint32_t cols = ad_pass_columns(g, &g->values[g->order[group->first]]);
        o->space[k] = cols < LEAST_COLUMNS ? 0 : cols;
        parted = parted || (wide && o->space[k] != wide);
        wide = o->space[k] ? o->space[k] : wide;
    }
    return parted;
}

bool ad_graph_order(struct graph *g)
{
    size_t n = g->n_groups - g->n_held_groups;
    struct order o = {.g = g, .first = g->n_held_groups, .n = n};
    uint32_t *room = ad_allocate_zeroed(5 * n + 1, sizeof *room);
    if (!room)
        return false;
    bool done = true;
    o.space = room;
    o.waits = room + n;
    o.left = room + 2 * n;
    o.done = room + 3 * n;
    o.start = room + 4 * n; /* n + 1 */
    if (find_spaces(&o) && (done = find_edges(&o))) {
        take_all(&o);
        done = apply(&o);
    }
    AD_FREE(o.readers, room);
    return done;
}
