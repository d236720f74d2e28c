/* Groups values into segments. A segment is a set of elementwise operations of one shape that read
   each other lane by lane.

   Each value gets the earliest level at which its operands are available: the level of an operand
   it reads lane by lane, or one more where it needs the complete operand. sink.c then moves some to
   a later level. Values of one level and shape form a segment; operations that cannot be fused form
   one each. */
#include "graph.h"

#include <stdlib.h>
#include <string.h>

/* ---- levels ---- */

/* Constants, values fixed by held inputs, and the rest are scheduled one after the other. */
enum { STAGES = 3 };

static int stage(const struct value *v)
{
    return v->flags & VALUE_CONSTANT ? 0 : v->flags & VALUE_HELD ? 1 : 2;
}

static uint32_t earliest(const struct graph *g, const struct value *v, const uint32_t *level)
{
    uint32_t earliest = 0;
    for (size_t k = 0; k < n_operands(g, v); k++) {
        uint32_t root = operand_loc(g, v, k)->root;
        const struct value *x = &g->values[root];
        if (is_leaf(x) || stage(x) < stage(v))
            continue;
        uint32_t after = level[root] + !reads_in_step(g, v, k);
        earliest = after > earliest ? after : earliest;
    }
    return earliest;
}

/* Constants take the first levels; their segments run once, at compile time. */
static void assign_levels(const struct graph *g, uint32_t *level)
{
    uint32_t end[STAGES] = {0};
    for (uint32_t i = 0; i < g->n; i++) {
        const struct value *v = &g->values[i];
        if (is_given(v))
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
}

/* ---- groups ---- */

/* What the values of a group have in common. */
struct member {
    uint32_t level, rows, cols; /* of the segment's iteration space */
    uint32_t alone; /* 1 + the value if it forms its own segment: last of its level, so that a
                       product can accumulate onto values of that level */
    uint32_t value;
};

static struct member member_of(const struct graph *g, uint32_t i, uint32_t level)
{
    const struct value *v = &g->values[i], *space = is_sink(v->op) ? &g->values[v->in[0]] : v;
    return (struct member){level, space->rows, space->cols, is_alone(v->op) ? i + 1 : 0, i};
}

static int by_group(const void *a, const void *b)
{
    const struct member *p = a, *q = b;
    const uint32_t x[] = {p->level, p->alone, p->rows, p->cols},
                   y[] = {q->level, q->alone, q->rows, q->cols};
    for (size_t k = 0; k < LENGTH(x); k++)
        if (x[k] != y[k])
            return x[k] < y[k] ? -1 : 1;
    return 0;
}

static int by_group_and_value(const void *a, const void *b)
{
    const struct member *p = a, *q = b;
    int order = by_group(a, b);
    return order ? order : (p->value > q->value) - (p->value < q->value);
}

/* Members by group, in time linear in their number: they come by value and go by level, most of
   which are of one shape and then in order. */
static bool sort_members(size_t n, struct member members[])
{
    size_t levels = 0;
    for (size_t i = 0; i < n; i++)
        levels = members[i].level < levels ? levels : (size_t)members[i].level + 1;
    size_t *end = calloc(levels + 1, sizeof *end);
    struct member *sorted = malloc((n + 1) * sizeof *sorted);
    bool done = end && sorted;
    for (size_t i = 0; done && i < n; i++)
        end[members[i].level + 1]++;
    for (size_t k = 1; done && k < levels; k++)
        end[k + 1] += end[k];
    for (size_t i = 0; done && i < n; i++)
        sorted[end[members[i].level]++] = members[i];
    for (size_t first = 0, last; done && first < n; first = last) {
        bool ordered = true;
        for (last = first + 1; last < n && sorted[last].level == sorted[first].level; last++)
            ordered = ordered && by_group_and_value(&sorted[last - 1], &sorted[last]) < 0;
        if (!ordered)
            qsort(sorted + first, last - first, sizeof *sorted, by_group_and_value);
    }
    if (done)
        memcpy(members, sorted, n * sizeof *sorted);
    free(end);
    free(sorted);
    return done;
}

static void cut_groups(struct graph *g, size_t n, const struct member members[])
{
    for (size_t i = 0; i < n; i++) {
        const struct value *v = &g->values[members[i].value];
        if (!i || by_group(&members[i - 1], &members[i])) {
            g->groups[g->n_groups++] = (struct group){(uint32_t)i, 0};
            g->n_constant_groups += (v->flags & VALUE_CONSTANT) != 0;
            g->n_held_groups += (v->flags & VALUE_HELD) != 0;
        }
        g->groups[g->n_groups - 1].count++;
        g->group_of[members[i].value] = (uint32_t)g->n_groups - 1;
        g->order[i] = members[i].value;
    }
}

bool ad_graph_schedule(struct graph *g)
{
    size_t n = 0, room = g->n + 1;
    uint32_t *level = calloc(room, sizeof *level);
    struct member *members = malloc(room * sizeof *members);
    g->order = malloc(room * sizeof *g->order);
    g->group_of = malloc(room * sizeof *g->group_of);
    g->groups = malloc(room * sizeof *g->groups);
    bool done = level && members && g->order && g->group_of && g->groups;
    if (done)
        assign_levels(g, level);
    done = done && ad_graph_sink(g, level);
    for (uint32_t i = 0; done && i < g->n; i++) {
        g->group_of[i] = UINT32_MAX;
        if (!is_given(&g->values[i]))
            members[n++] = member_of(g, i, level[i]);
    }
    done = done && sort_members(n, members);
    if (done)
        cut_groups(g, n, members);
    free(level);
    free(members);
    return done;
}
