/* Passes over columns: consecutive segments whose columns depend on the same and on neighbouring
   columns of each other run a block of columns one after the other. Products with a matrix that all
   columns share are among them, and products that add the columns up, block after block. What they
   alone read needs memory for one block then, a window, which stays in the second-level cache.

   Where a later segment reads neighbouring columns, an earlier one computes some columns `before`
   and `after` the block too, which the neighbouring block computes again: blocks are independent of
   each other, and threads change no result. A sum over columns adds those of each block and then
   the blocks, in order. */
#include "passes.h"

#include <stdlib.h>

enum { MOST_GROUPS = 250, LEAST_COLUMNS = 4 * WINDOW_STEP }; /* of a pass */

static void find_owners(struct passes *s)
{
    const struct graph *g = s->g;
    for (uint32_t i = 0; i < g->n; i++)
        s->owners[i].first = UINT32_MAX;
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        uint32_t group = g->group_of[i], o = owner_of(g, i);
        struct owner *owner = &s->owners[o];
        if (is_given(v))
            continue;
        owner->first = group < owner->first ? group : owner->first;
        owner->last = larger(owner->last, larger(group, s->plan->last[i]));
        owner->fixed |= (v->flags & (VALUE_OUTPUT | VALUE_CONSTANT | VALUE_HELD)) != 0 ||
                        v->cols != g->values[o].cols;
    }
}

/* ---- which groups ---- */

/* The value that operand k of v lies in, if another instruction of the pass stores it. */
static bool stored_in_pass(const struct passes *s, uint32_t group, const struct value *v, size_t k,
                           uint32_t *root)
{
    const struct graph *g = s->g;
    *root = operand_root(g, v, k);
    return !is_given(&g->values[*root]) && g->group_of[*root] >= s->first &&
           (g->group_of[*root] != group || g->values[*root].flags & VALUE_STORED);
}

/* Its column c lies in column c of the memory. */
static bool is_local(const struct passes *s, const struct value *v, size_t k)
{
    const struct graph *g = s->g;
    const struct loc *l = operand_loc(g, v, k);
    const struct value *x = v->op == AD_OP_copy && v->in[1] ? v : &g->values[operand(g, v, k)];
    return x->cols == s->cols && g->values[l->root].cols == s->cols && l->cs == 1 &&
           l->off % s->cols == 0 && l->rs % s->cols == 0;
}

/* What products share, and columns are gathered from, is complete before the pass begins. */
static bool is_shared(const struct value *v, size_t k)
{
    return k == 0 && (v->op == AD_OP_gather_cols || (v->op == AD_OP_matmul && !adds_columns(v)));
}

/* A product that accumulates onto a sum over columns, which is complete when the pass has ended. */
static bool adds_to_sum(const struct passes *s, uint32_t i)
{
    const struct graph *g = s->g;
    const struct value *sum = &g->values[g->host[i]];
    if (!(g->values[i].flags & VALUE_ADDS))
        return false;
    uint32_t other = sum->in[sum->in[0] == i];
    return g->group_of[other] >= s->first && is_sink(g->values[other].op);
}

static bool joins(const struct passes *s, uint32_t group)
{
    const struct graph *g = s->g;
    uint32_t root;
    for (uint32_t m = 0; m < g->groups[group].count; m++) {
        uint32_t i = g->order[g->groups[group].first + m];
        const struct value *v = &g->values[i];
        if (ad_pass_columns(g, v) != s->cols || adds_to_sum(s, i))
            return false;
        for (size_t k = 0; k < n_operands(g, v); k++)
            if (stored_in_pass(s, group, v, k, &root) && (is_shared(v, k) || !is_local(s, v, k)))
                return false;
    }
    return true;
}

/* ---- columns beyond a block ---- */

static void reset(struct passes *s, uint32_t i)
{
    struct owner *owner = &s->owners[owner_of(s->g, i)];
    owner->before = owner->after = 0;
    owner->placed = 0;
}

/* What one group has to compute beyond a block, and what it reads there; false where it may not.
   Products of other widths may differ in rounding. */
static bool widen(struct passes *s, uint32_t number)
{
    struct graph *g = s->g;
    struct group *group = &g->groups[number];
    group->before = group->after = 0;
    for (uint32_t m = 0; m < group->count; m++) {
        const struct owner *o = &s->owners[owner_of(g, g->order[group->first + m])];
        group->before = larger(group->before, o->before);
        group->after = larger(group->after, o->after);
    }
    for (uint32_t m = 0; m < group->count; m++) {
        uint32_t i = g->order[group->first + m], root;
        const struct value *v = &g->values[i];
        uint32_t beyond = is_stencil(v->op) ? WINDOW_STEP : 0;
        bool own = v->op == AD_OP_matmul || (v->cols == s->cols && (v->flags & VALUE_STORED) &&
                                             !is_window(s, owner_of(g, i)));
        if ((group->before || group->after) && own)
            return false; /* belongs to the neighbouring block */
        for (size_t k = 0; k < n_operands(g, v); k++) {
            if (!stored_in_pass(s, number, v, k, &root))
                continue;
            struct owner *o = &s->owners[owner_of(g, root)];
            o->before = larger(o->before, group->before + beyond);
            o->after = larger(o->after, group->after + beyond);
        }
    }
    return group->before <= WINDOW_MARGIN && group->after <= WINDOW_MARGIN;
}

static bool widen_all(struct passes *s)
{
    const struct graph *g = s->g;
    uint32_t root;
    for (uint32_t group = s->first; group < s->end; group++)
        for (uint32_t m = 0; m < g->groups[group].count; m++) {
            uint32_t i = g->order[g->groups[group].first + m];
            reset(s, i);
            for (size_t k = 0; k < n_operands(g, &g->values[i]); k++)
                if (stored_in_pass(s, group, &g->values[i], k, &root))
                    reset(s, root);
        }
    s->margin = 0;
    for (uint32_t group = s->end; group-- > s->first;) {
        if (!widen(s, group))
            return false;
        s->margin = larger(s->margin, larger(g->groups[group].before, g->groups[group].after));
    }
    return true;
}

/* ---- all passes ---- */

/* The columns of a pass that a group could begin. */
static uint32_t columns_of(const struct graph *g, uint32_t group)
{
    const struct group *of = &g->groups[group];
    return of->count ? ad_pass_columns(g, &g->values[g->order[of->first]]) : 0;
}

/* Makes the longest pass that begins with a group; returns the group behind it. */
static uint32_t pass_from(struct passes *s, uint32_t first)
{
    const struct graph *g = s->g;
    if (!g->groups[first].count)
        return first + 1;
    s->first = s->end = first;
    s->cols = columns_of(g, first);
    while (s->cols >= LEAST_COLUMNS && s->end < g->n_groups && s->end - first < MOST_GROUPS &&
           joins(s, s->end))
        s->end++;
    for (; s->end > first + 1; s->end--)
        if (widen_all(s)) /* a shorter one gains less */
            return ad_make_windows(s) ? s->end : first + 1;
    return first + 1;
}

bool ad_plan_passes(struct plan *plan)
{
    struct graph *g = plan->graph;
    struct passes s = {.plan = plan, .g = g};
    uint32_t cols = 0;
    for (uint32_t group = 0; group < g->n_groups; group++)
        cols = larger(cols, columns_of(g, group));
    if (cols < LEAST_COLUMNS)
        return true;
    s.owners = ad_allocate_zeroed(g->n + 1, sizeof *s.owners);
    if (!s.owners)
        return false;
    find_owners(&s);
    for (uint32_t group = (uint32_t)g->n_held_groups; group < g->n_groups;)
        group = pass_from(&s, group);
    for (uint32_t group = 0; group < g->n_groups; group++)
        if (!g->groups[group].pass)
            g->groups[group].before = g->groups[group].after = 0;
    free(s.owners);
    return true;
}
