/* Blocks of a pass, and windows: memory of values that nothing but the pass reads. */
#include "passes.h"

#include <stdlib.h>

enum {
    WINDOW_BYTES = 128 << 10, /* windows of a pass: with what it reads and writes, in the cache */
    LEAST_BYTES = 6 * WINDOW_BYTES, /* in memory otherwise: smaller programs stay in the cache */
    MIN_BLOCK = 256,
    MAX_BLOCK = 4096
};

/* Columns of a block for windows of so many rows; 0: no pass. LEASTACTION_COLUMNS in the
   environment sets it (used by tests). */
static uint32_t block_columns(const struct passes *s, size_t rows)
{
    size_t bytes = rows * s->plan->program->element;
    const char *wanted = getenv("LEASTACTION_COLUMNS");
    if (wanted && rows)
        return (uint32_t)strtoul(wanted, NULL, 10);
    if (bytes * s->cols < LEAST_BYTES)
        return 0;
    size_t block = WINDOW_BYTES / bytes;
    return (uint32_t)(block < MIN_BLOCK ? MIN_BLOCK : block > MAX_BLOCK ? MAX_BLOCK : block);
}

static size_t count_rows(struct passes *s)
{
    const struct graph *g = s->g;
    size_t rows = 0;
    for (uint32_t group = s->first; group < s->end; group++)
        for (uint32_t m = 0; m < g->groups[group].count; m++) {
            uint32_t i = g->order[g->groups[group].first + m], o = owner_of(g, i);
            if (!(g->values[i].flags & VALUE_STORED) || !is_window(s, o) || s->owners[o].counted)
                continue;
            s->owners[o].counted = true;
            rows += g->values[o].rows;
        }
    return rows;
}

/* The memory of value i becomes a window, or lives until the pass ends. */
static void place_window(struct passes *s, uint32_t i, size_t *bytes)
{
    struct graph *g = s->g;
    uint32_t o = owner_of(g, i);
    if (!is_window(s, o)) {
        if (s->plan->last[o] >= s->first && s->plan->last[o] < s->end)
            s->plan->last[o] = s->end - 1;
        return;
    }
    if (!(g->values[o].flags & VALUE_WINDOW)) {
        g->locs[o].off = *bytes;
        *bytes += aligned((size_t)g->values[o].rows * g->groups[s->first].width *
                          s->plan->program->element);
    }
    for (uint32_t h = i;; h = g->host[h]) {
        g->values[h].flags |= VALUE_WINDOW;
        if (h == o)
            break;
    }
}

static void make_pass(struct passes *s, uint32_t blocks)
{
    struct graph *g = s->g;
    uint32_t steps = (s->cols - 1) / WINDOW_STEP + 1;
    size_t bytes = ALIGNMENT; /* a lane before the first and one behind the last are read */
    for (uint32_t k = s->first; k < s->end; k++) {
        g->groups[k].pass = s->first + 1;
        g->groups[k].blocks = blocks;
        g->groups[k].width = /* an odd number of steps: rows do not fall on the same cache lines */
            (((steps - 1) / blocks + 1) * WINDOW_STEP + 2 * WINDOW_MARGIN) |
            WINDOW_STEP; /* not a power of 2 */
    }
    for (uint32_t k = s->first; k < s->end; k++)
        for (uint32_t m = 0; m < g->groups[k].count; m++) {
            uint32_t i = g->order[g->groups[k].first + m];
            const struct value *v = &g->values[i];
            if (v->flags & VALUE_STORED)
                place_window(s, i, &bytes);
            for (size_t j = 0; j < n_operands(g, v); j++) {
                uint32_t root = operand_loc(g, v, j)->root, o = owner_of(g, root);
                if (!is_given(&g->values[root]) && !is_window(s, o))
                    place_window(s, root, &bytes);
            }
        }
    if (s->plan->window_bytes < bytes + ALIGNMENT)
        s->plan->window_bytes = bytes + ALIGNMENT;
}

bool ad_make_windows(struct passes *s)
{
    uint32_t steps = (s->cols - 1) / WINDOW_STEP + 1;
    uint32_t block = block_columns(s, count_rows(s)), blocks = block ? s->cols / block : 0;
    blocks = blocks < steps / 2 ? blocks : steps / 2;
    if (blocks < 2)
        return false;
    make_pass(s, blocks);
    return true;
}
