/* Groups values into segments. A segment is a set of elementwise operations of one shape that read
   each other lane by lane.

   Each value gets the earliest level at which its operands are available: the level of an operand
   it reads lane by lane, or one more where it needs the complete operand. sink.c then moves some to
   a later level. Values of one level and shape form a segment; operations that cannot be fused form
   one each. order.c puts these in order. */
#include "autodiff/free.h"
#include "graph.h"

#include <stdlib.h>

/* ---- levels ---- */

/* Constants, values fixed by held inputs, and the rest are scheduled one after the other. */
enum { STAGES = 3 };
static const uint32_t none = UINT32_MAX; /* level of what no instruction computes */

static int stage(const struct value *v)
{
    return v->flags & VALUE_CONSTANT ? 0 : v->flags & VALUE_HELD ? 1 : 2;
}

static uint32_t earliest(const struct graph *g, const struct value *v, const uint32_t *level)
{
    uint32_t earliest = 0;
    for (size_t k = 0, n = n_operands(g, v); k < n; k++) {
        uint32_t root = operand_root(g, v, k);
        const struct value *x = &g->values[root];
        if (is_leaf(x) || stage(x) < stage(v))
            continue;
        uint32_t after = level[root] + !reads_in_step(g, v, k);
        earliest = after > earliest ? after : earliest;
    }
    return earliest;
}

/* Constants take the first levels; their segments run once, at compile time. Returns how many
   levels there are, and in *within whether a stage has several. */
static uint32_t assign_levels(const struct graph *g, uint32_t *level, bool *within)
{
    uint32_t end[STAGES] = {0};
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        level[i] = is_given(v) ? none : earliest(g, v, level);
        if (level[i] == none)
            continue;
        if (level[i] >= end[stage(v)])
            end[stage(v)] = level[i] + 1;
    }
    *within = end[0] > 1 || end[1] > 1 || end[2] > 1;
    for (int k = 1; k < STAGES; k++)
        end[k] += end[k - 1];
    for (uint32_t i = 0; end[1] && i < g->n; i++)
        if (level[i] != none && stage(&g->values[i]) > 0)
            level[i] += end[stage(&g->values[i]) - 1];
    return end[STAGES - 1];
}

/* Postpones numbers made of sums that nothing but outputs needs, behind all other levels, where
   they do not part the segments of a pass (passes.c). Returns the number of levels, 0 when out of
   memory.
 */
static uint32_t postpone_numbers(const struct graph *g, uint32_t levels, uint32_t *level)
{
    enum { NEEDED = 1, POSTPONED = 2 };
    uint32_t most = levels;
    uint8_t *is = ad_allocate_zeroed(g->n + 1, 1);
    for (uint32_t i = (uint32_t)g->n; is && i-- > 0;) {
        const struct value *v = &g->values[i];
        if (!ad_ops[v->op].elementwise || v->rows > 1 || v->cols > 1 || stage(v) != 2)
            is[i] = NEEDED;
        for (size_t k = 0; !is_given(v) && is[i] && k < n_operands(g, v); k++)
            is[operand_root(g, v, k)] = NEEDED;
    }
    for (uint32_t i = 0; is && i < g->n; i++) {
        const struct value *v = &g->values[i];
        for (size_t k = 0; !is_given(v) && !is[i] && k < n_operands(g, v); k++) {
            uint32_t root = operand_root(g, v, k);
            if (g->values[root].op == AD_OP_sum || is[root] == POSTPONED)
                is[i] = POSTPONED;
        }
        if (is[i] == POSTPONED) {
            level[i] += levels;
            most = 2 * levels;
        }
    }
    free(is);
    return is ? most : 0;
}

/* ---- groups ---- */

/* What the values of one level that form a group have in common: a segment's iteration space. */
struct member {
    uint32_t rows, cols;
    uint32_t alone; /* 1 + the value if it forms its own segment: last of its level, so that a
                       product can accumulate onto values of that level */
    uint32_t value;
};

static struct member member_of(const struct graph *g, uint32_t i)
{
    const struct value *v = &g->values[i], *space = is_sink(v->op) ? &g->values[v->in[0]] : v;
    return (struct member){space->rows, space->cols, is_alone(v->op) ? i + 1 : 0, i};
}

static bool same_group(const struct member *p, const struct member *q)
{
    return p->alone == q->alone && p->rows == q->rows && p->cols == q->cols;
}

static int by_group_and_value(const void *a, const void *b)
{
    const struct member *p = a, *q = b;
    const uint32_t x[] = {p->alone, p->rows, p->cols, p->value},
                   y[] = {q->alone, q->rows, q->cols, q->value};
    for (size_t k = 0; k < LENGTH(x); k++)
        if (x[k] != y[k])
            return x[k] < y[k] ? -1 : 1;
    return 0;
}

/* Sorts the values of a level by group. */
static void sort_level(const struct graph *g, size_t n, uint32_t order[], struct member members[])
{
    for (size_t i = 0; i < n; i++)
        members[i] = member_of(g, order[i]);
    qsort(members, n, sizeof *members, by_group_and_value);
    for (size_t i = 0; i < n; i++)
        order[i] = members[i].value;
}

/* Makes groups of the values of a level; false, having made some, if they are not in order, as
   those of one group are. */
static bool cut_groups(struct graph *g, size_t first, size_t end)
{
    struct member of = {0};
    for (size_t i = first; i < end; i++) {
        struct member next = member_of(g, g->order[i]);
        const struct value *v = &g->values[next.value];
        if (i == first || !same_group(&of, &next)) {
            if (i > first && by_group_and_value(&of, &next) > 0)
                return false;
            of = next;
            g->groups[g->n_groups++] = (struct group){.first = (uint32_t)i};
            g->n_constant_groups += (v->flags & VALUE_CONSTANT) != 0;
            g->n_held_groups += (v->flags & VALUE_HELD) != 0;
        }
        g->groups[g->n_groups - 1].count++;
        g->group_of[next.value] = (uint32_t)g->n_groups - 1;
    }
    return true;
}

static void make_level(struct graph *g, size_t first, size_t end, struct member members[])
{
    const size_t all = g->n_groups, constant = g->n_constant_groups, held = g->n_held_groups;
    if (cut_groups(g, first, end))
        return;
    g->n_groups = all;
    g->n_constant_groups = constant;
    g->n_held_groups = held;
    sort_level(g, end - first, g->order + first, members);
    cut_groups(g, first, end);
}

/* Orders the values by level, in time linear in their number, and within each by group. */
static bool make_groups(struct graph *g, size_t levels, const uint32_t level[])
{
    size_t *end = calloc(levels + 1, sizeof *end), most = 0, n = 0;
    if (!end)
        return false;
    for (uint32_t i = 0; i < g->n; i++) {
        g->group_of[i] = UINT32_MAX;
        if (level[i] != none)
            end[level[i] + 1]++;
    }
    for (size_t k = 0; k < levels; k++) {
        most = end[k + 1] > most ? end[k + 1] : most;
        end[k + 1] += end[k];
    }
    for (uint32_t i = 0; i < g->n; i++)
        if (level[i] != none)
            g->order[end[level[i]]++] = i;
    struct member *members = malloc((most + 1) * sizeof *members);
    for (size_t k = 0; members && k < levels; n = end[k++])
        make_level(g, n, end[k], members);
    AD_FREE(end, members);
    return members;
}

bool ad_graph_schedule(struct graph *g)
{
    size_t room = g->n + 1, levels = 0;
    bool within = false;
    uint32_t *level = ad_allocate_zeroed(room, sizeof *level);
    g->order = ad_allocate_large(room * sizeof *g->order);
    g->group_of = ad_allocate_large(room * sizeof *g->group_of);
    g->groups = ad_allocate_large(room * sizeof *g->groups);
    bool done = level && g->order && g->group_of && g->groups;
    if (done)
        levels = assign_levels(g, level, &within);
    done = done &&
           (!within ||
            (ad_graph_sink(g, level) && (levels = postpone_numbers(g, (uint32_t)levels, level)))) &&
           make_groups(g, levels, level) && (!within || ad_graph_order(g));
    free(level);
    return done;
}
