/* Which values are only views of others, and which values one segment computes together.

   A segment is a set of elementwise operations of one shape that read each other lane by lane.
   Every value gets the earliest level at which its operands are ready: the level of an operand it
   reads in step with, one more where it needs the operand whole. Some then wait for a later one
   (postpone.c). Values of one level and shape make a segment. */
#include "program.h"

#include <stdlib.h>
#include <string.h>

/* ---- views ---- */

static struct loc own_loc(const struct graph *g, uint32_t i)
{
    return (struct loc){.root = i, .rs = g->values[i].cols, .cs = 1};
}

static bool append_loc(struct graph *g, struct loc loc)
{
    if (!ad_reserve((void **)&g->locs, g->n_locs, &g->max_locs, 1, sizeof *g->locs))
        return false;
    g->locs[g->n_locs++] = loc;
    return true;
}

/* Turns a view into a copy of what it sees; in[1] numbers where from. */
static bool make_copy(struct graph *g, uint32_t i)
{
    struct value *v = &g->values[i];
    if (!(v->flags & VALUE_VIEW))
        return true;
    if (!append_loc(g, g->locs[i]))
        return false;
    v->flags &= (uint16_t)~VALUE_VIEW;
    v->op = AD_OP_copy;
    v->in[1] = (uint32_t)g->n_locs - 1;
    g->locs[i] = own_loc(g, i);
    return true;
}

/* Copies an index list of the tape; returns 1 + its offset, 0 when out of memory. */
static uint32_t copy_list(struct graph *g, uint32_t at)
{
    const uint32_t *list = g->tape->lists + at;
    if (!ad_reserve((void **)&g->lists, g->n_lists, &g->max_lists, list[0], sizeof *g->lists))
        return 0;
    memcpy(g->lists + g->n_lists, list + 1, list[0] * sizeof *list);
    g->n_lists += list[0];
    return (uint32_t)(g->n_lists - list[0]) + 1;
}

static bool contiguous(const struct value *x, const struct loc *l)
{
    return !l->list && (l->cs == 1 || x->cols == 1) && (l->rs == x->cols || x->rows == 1);
}

/* Where v lies, from where its operand x does. */
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
                      (v->op == AD_OP_reshape && !contiguous(x, &g->locs[v->in[0]]));
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

/* Operands that the operation cannot read through any view. */
static bool copy_unreadable(struct graph *g, const struct value *v)
{
    for (uint32_t k = 0; k < n_inputs(v); k++) {
        const struct loc *l = &g->locs[v->in[k]];
        const struct value *x = &g->values[v->in[k]];
        bool repeats = (l->cs == 0 && x->cols > 1) || (l->rs == 0 && x->rows > 1);
        bool unreadable =
            is_alone(v->op) ? l->list || repeats : is_stencil(v->op) && l->cs == 0 && x->cols > 1;
        if (unreadable && !make_copy(g, v->in[k]))
            return false;
    }
    return true;
}

static bool find_views(struct graph *g)
{
    g->locs = malloc((g->n + 1) * sizeof *g->locs);
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
        if (v->op == AD_OP_scatter && !(v->in[1] = copy_list(g, v->aux)))
            return false;
        if ((is_alone(v->op) || is_stencil(v->op)) && !copy_unreadable(g, v))
            return false;
    }
    return true;
}

/* ---- levels ---- */

/* Constants, what held inputs fix, and the rest are scheduled one after the other. */
enum { STAGES = 3 };

static int stage(const struct value *v)
{
    return v->flags & VALUE_CONSTANT ? 0 : v->flags & VALUE_HELD ? 1 : 2;
}

static uint32_t after(const struct graph *g, const struct value *v, uint32_t root, bool in_step,
                      const uint32_t *level)
{
    const struct value *x = &g->values[root];
    if (is_leaf(x) || stage(x) < stage(v))
        return 0;
    return level[root] + !in_step;
}

static uint32_t earliest(const struct graph *g, const struct value *v, const uint32_t *level)
{
    uint32_t earliest = 0;
    for (uint32_t k = 0; k < n_inputs(v); k++) {
        uint32_t l = after(g, v, operand_loc(g, v, k)->root, reads_in_step(g, v, k), level);
        if (l > earliest)
            earliest = l;
    }
    if (v->op == AD_OP_place) {
        const uint32_t *list = g->tape->lists + v->aux;
        for (size_t k = 0; k < list[0]; k++) {
            uint32_t l = after(g, v, g->locs[g->renumber[list[1 + 3 * k]]].root, false, level);
            if (l > earliest)
                earliest = l;
        }
    }
    return earliest;
}

/* ---- groups ---- */

struct space {
    uint32_t rows, cols;
};

/* The shape a value's segment runs over. */
static struct space space_of(const struct graph *g, const struct value *v)
{
    const struct value *s = is_sink(v->op) ? &g->values[v->in[0]] : v;
    return (struct space){s->rows, s->cols};
}

/* Numbers the distinct shapes; operations that stand alone get numbers of their own. */
static uint32_t number_spaces(const struct graph *g, uint32_t *space, struct space *spaces,
                              uint32_t *table, size_t mask)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        if (is_leaf(v) || (v->flags & VALUE_VIEW))
            continue;
        struct space s = space_of(g, v);
        size_t slot = (s.rows * 0x9e3779b1u ^ s.cols * 0x85ebca77u) & mask;
        while (!is_alone(v->op) && table[slot] &&
               memcmp(&spaces[table[slot] - 1], &s, sizeof s) != 0)
            slot = (slot + 1) & mask;
        if (is_alone(v->op)) {
            space[i] = n;
            spaces[n++] = (struct space){0, 0};
            continue;
        }
        if (!table[slot]) {
            spaces[n++] = s;
            table[slot] = n;
        }
        space[i] = table[slot] - 1;
    }
    return n;
}

/* Stable counting sort of `from` by key into `to`. */
static bool counting_sort(size_t n, const uint32_t *from, uint32_t *to, const uint32_t *key,
                          size_t keys)
{
    size_t *start = calloc(keys + 1, sizeof *start);
    if (!start)
        return false;
    for (size_t i = 0; i < n; i++)
        start[key[from[i]] + 1]++;
    for (size_t k = 0; k < keys; k++)
        start[k + 1] += start[k];
    for (size_t i = 0; i < n; i++)
        to[start[key[from[i]]]++] = from[i];
    free(start);
    return true;
}

static bool cut_groups(struct graph *g, size_t n, const uint32_t *level, const uint32_t *space)
{
    g->groups = malloc((n + 1) * sizeof *g->groups);
    if (!g->groups)
        return false;
    for (size_t i = 0; i < n; i++) {
        uint32_t v = g->order[i], before = i ? g->order[i - 1] : 0;
        if (!i || level[v] != level[before] || space[v] != space[before]) {
            g->groups[g->n_groups++] = (struct group){(uint32_t)i, 0};
            g->n_constant_groups += (g->values[v].flags & VALUE_CONSTANT) != 0;
            g->n_held_groups += (g->values[v].flags & VALUE_HELD) != 0;
        }
        g->groups[g->n_groups - 1].count++;
        g->group_of[v] = (uint32_t)g->n_groups - 1;
    }
    struct group *shrunk = realloc(g->groups, (g->n_groups + 1) * sizeof *g->groups);
    if (shrunk)
        g->groups = shrunk;
    return true;
}

/* Levels of constants come first, whose segments run once, when compiling. */
static uint32_t assign_levels(struct graph *g, uint32_t *level)
{
    uint32_t end[STAGES] = {0};
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        if (is_leaf(v) || (v->flags & VALUE_VIEW))
            continue;
        level[i] = earliest(g, v, level);
        if (level[i] >= end[stage(v)])
            end[stage(v)] = level[i] + 1;
    }
    for (int k = 1; k < STAGES; k++)
        end[k] += end[k - 1];
    for (uint32_t i = 0; i < g->n; i++)
        if (stage(&g->values[i]) > 0)
            level[i] += end[stage(&g->values[i]) - 1];
    return end[STAGES - 1];
}

bool ad_graph_schedule(struct graph *g)
{
    bool done = false;
    size_t mask = 16, n = 0;
    while (mask < 2 * g->n)
        mask *= 2;
    uint32_t *level = NULL, *space = NULL, *scratch = NULL, *table = NULL;
    struct space *spaces = NULL;
    if (!find_views(g))
        return false;
    level = calloc(g->n, sizeof *level);
    space = calloc(g->n, sizeof *space);
    scratch = malloc(g->n * sizeof *scratch);
    spaces = malloc(g->n * sizeof *spaces);
    table = calloc(mask, sizeof *table);
    g->order = malloc(g->n * sizeof *g->order);
    g->group_of = malloc(g->n * sizeof *g->group_of);
    if (!level || !space || !scratch || !spaces || !table || !g->order || !g->group_of)
        goto out;
    uint32_t n_spaces = number_spaces(g, space, spaces, table, mask - 1);
    uint32_t levels = assign_levels(g, level);
    if (!ad_graph_postpone(g, level))
        goto out;
    for (uint32_t i = 0; i < g->n; i++) {
        g->group_of[i] = UINT32_MAX;
        if (!is_leaf(&g->values[i]) && !(g->values[i].flags & VALUE_VIEW))
            g->order[n++] = i;
    }
    done = counting_sort(n, g->order, scratch, space, n_spaces) &&
           counting_sort(n, scratch, g->order, level, levels) && cut_groups(g, n, level, space);
out:
    free(level);
    free(space);
    free(scratch);
    free(spaces);
    free(table);
    return done;
}
