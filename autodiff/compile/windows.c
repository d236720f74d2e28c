/* Blocks of a pass, and windows: memory of values that nothing but the pass reads. */
#include "passes.h"

#include <stdlib.h>

enum {
    WINDOW_BYTES = 128 << 10, /* windows of a pass: with what it reads and writes, in the cache */
    LEAST_BYTES = 6 * WINDOW_BYTES, /* in memory otherwise: smaller programs stay in the cache */
    ROW_BYTES = 768,                /* least of a row of a block */
    MARGIN_BLOCK = 256,             /* least columns where some beyond a block are computed, too */
    MAX_BLOCK = 4096,
    MOST_SPARE = 64
};

static uint32_t least_columns(const struct passes *s)
{
    const struct graph *g = s->g;
    uint32_t least = s->margin ? MARGIN_BLOCK : ROW_BYTES / (uint32_t)s->plan->program->element;
    for (uint32_t k = s->first; k < s->end; k++) {
        const struct value *v = &g->values[g->order[g->groups[k].first]];
        if (g->groups[k].count && v->op == AD_OP_matmul)
            least = larger(least, ad_least_block(adds_columns(v) ? v : &g->values[v->in[0]]));
    }
    return least;
}

/* Columns of a block for windows of so many rows; 0: no pass. LEASTACTION_COLUMNS in the
   environment sets it (used by tests). */
static uint32_t block_columns(const struct passes *s, size_t rows)
{
    size_t bytes = rows * s->plan->program->element;
    const char *wanted = getenv("LEASTACTION_COLUMNS");
    if (wanted && rows)
        return (uint32_t)strtoul(wanted, NULL, 10);
    size_t block = WINDOW_BYTES / (bytes + 1), least = least_columns(s);
    if (bytes * s->cols < (block < least ? 4 : 1) * LEAST_BYTES)
        return 0;
    return (uint32_t)(block < least ? least : block > MAX_BLOCK ? MAX_BLOCK : block);
}

/* Rows of windows that nothing reads any more. */
struct spare {
    uint32_t rows, at;
};
struct rows {
    struct spare spare[MOST_SPARE];
    size_t n_spare;
    size_t n; /* in all */
};

/* The first row of a window: one of spare rows, or new ones. */
static uint32_t take_rows(struct rows *r, uint32_t rows)
{
    for (size_t k = 0; k < r->n_spare; k++)
        if (r->spare[k].rows == rows) {
            uint32_t at = r->spare[k].at;
            r->spare[k] = r->spare[--r->n_spare];
            return at;
        }
    r->n += rows;
    return (uint32_t)r->n - rows;
}

/* What group k is the last to read. */
static void release(struct passes *s, struct rows *r, uint32_t i, uint32_t k)
{
    uint32_t o = owner_of(s->g, i);
    struct owner *owner = &s->owners[o];
    if (owner->last != k || owner->placed != s->first + 1 || r->n_spare == MOST_SPARE)
        return;
    owner->placed = 0;
    r->spare[r->n_spare++] = (struct spare){s->g->values[o].rows, owner->at};
}

/* Gives windows their rows; returns how many there are. */
static size_t place_rows(struct passes *s)
{
    const struct graph *g = s->g;
    struct rows r = {.n = 0};
    for (uint32_t k = s->first; k < s->end; k++) {
        const uint32_t *member = g->order + g->groups[k].first, count = g->groups[k].count;
        for (uint32_t m = 0; m < count; m++) {
            uint32_t o = owner_of(g, member[m]);
            if (!(g->values[member[m]].flags & VALUE_STORED) || !is_window(s, o) ||
                s->owners[o].placed)
                continue;
            s->owners[o].placed = s->first + 1;
            s->owners[o].at = take_rows(&r, g->values[o].rows);
        }
        for (uint32_t m = 0; m < count; m++) {
            const struct value *v = &g->values[member[m]];
            release(s, &r, member[m], k);
            for (size_t j = 0; j < n_operands(g, v); j++)
                if (!is_given(&g->values[operand_root(g, v, j)]))
                    release(s, &r, operand_root(g, v, j), k);
        }
    }
    return r.n;
}

/* The memory of value i becomes a window, or lives until the pass ends. */
static void place_window(struct passes *s, uint32_t i)
{
    struct graph *g = s->g;
    uint32_t o = owner_of(g, i);
    if (!is_window(s, o)) {
        if (s->plan->last[o] >= s->first && s->plan->last[o] < s->end)
            s->plan->last[o] = s->end - 1;
        return;
    }
    g->locs[o].off =
        ALIGNMENT + (size_t)s->owners[o].at * g->groups[s->first].width * s->plan->program->element;
    for (uint32_t h = i;; h = g->host[h]) {
        g->values[h].flags |= VALUE_WINDOW;
        if (h == o)
            break;
    }
}

/* Products that add columns up wait until the block before has passed the last one into the same
   memory. */
static void number_products(const struct passes *s)
{
    struct graph *g = s->g;
    uint32_t n = 0;
    for (uint32_t k = s->first; k < s->end; k++) {
        uint32_t i = g->order[g->groups[k].first];
        if (!g->groups[k].count || !adds_columns(&g->values[i]))
            continue;
        g->groups[k].adds = g->groups[k].turn = ++n;
        for (uint32_t h = s->first; h < k; h++)
            if (g->groups[h].adds && owner_of(g, g->order[g->groups[h].first]) == owner_of(g, i))
                g->groups[h].turn = n;
    }
}

static void make_pass(struct passes *s, size_t rows, uint32_t blocks)
{
    struct graph *g = s->g;
    uint32_t steps = (s->cols - 1) / WINDOW_STEP + 1;
    for (uint32_t k = s->first; k < s->end; k++) {
        g->groups[k].pass = s->first + 1;
        g->groups[k].blocks = blocks;
        g->groups[k].margin = s->margin;
        g->groups[k].width = /* an odd number of steps: rows do not fall on the same cache lines */
            (((steps - 1) / blocks + 1) * WINDOW_STEP + 2 * s->margin) | WINDOW_STEP;
    }
    for (uint32_t k = s->first; k < s->end; k++)
        for (uint32_t m = 0; m < g->groups[k].count; m++) {
            uint32_t i = g->order[g->groups[k].first + m];
            const struct value *v = &g->values[i];
            if (v->flags & VALUE_STORED)
                place_window(s, i);
            for (size_t j = 0; j < n_operands(g, v); j++) {
                uint32_t root = operand_root(g, v, j), o = owner_of(g, root);
                if (!is_given(&g->values[root]) && !is_window(s, o))
                    place_window(s, root);
            }
        }
    /* a lane before the first and one behind the last are read */
    size_t bytes = 2 * ALIGNMENT + rows * g->groups[s->first].width * s->plan->program->element;
    if (s->plan->window_bytes < bytes)
        s->plan->window_bytes = bytes;
    number_products(s);
}

bool ad_make_windows(struct passes *s)
{
    uint32_t steps = (s->cols - 1) / WINDOW_STEP + 1;
    size_t rows = place_rows(s);
    uint32_t block = block_columns(s, rows), blocks = block ? s->cols / block : 0;
    blocks = blocks < steps / 2 ? blocks : steps / 2;
    if (blocks < 2)
        return false;
    make_pass(s, rows, blocks);
    return true;
}
