/* Tiles of a segment: slots by lifetime, tile shape, and chunks for threads.

   Where operands allow, the iteration space is flattened to one long row, which fills the vectors
   of machine code whatever the number of columns: two to five times as fast at three to seven
   columns. */
#include "plan.h"

#include <stdlib.h>

enum {
    CACHE_BYTES = 48 << 10, /* bytes for the tiles of a segment: measured, a little above the
                               first-level cache */
    MIN_TILE = 128,
    MAX_TILE = 1024,
    PARALLEL_WORK = 1 << 19, /* elements times instructions worth splitting */
    MAX_CHUNKS = 32,
    ROW_CHUNKS = 4 /* most private copies of results into which rows are accumulated */
};

/* The space can be flattened: all operands are contiguous or numbers. */
static bool is_flat(const struct plan *p, const struct group *group)
{
    const struct graph *g = p->graph;
    for (uint32_t i = 0; i < group->count; i++) {
        const struct value *v = &g->values[g->order[group->first + i]];
        const struct value *space = is_sink(v->op) ? &g->values[v->in[0]] : v;
        if (is_stencil(v->op) || (is_sink(v->op) && v->op != AD_OP_sum))
            return false;
        for (uint32_t k = 0; k < ad_ops[v->op].arity; k++) {
            const struct loc *l = operand_loc(g, v, k);
            const struct value *x = v->op == AD_OP_copy && v->in[1] ? v : &g->values[v->in[k]];
            bool number = (x->rows == 1 && x->cols == 1) || ad_is_number(l);
            bool whole = x->rows == space->rows && x->cols == space->cols && !l->list &&
                         l->cs == 1 && (l->rs == x->cols || x->rows == 1);
            if (!number && !whole)
                return false;
        }
    }
    return true;
}

static bool in_tile(const struct graph *g, const struct value *v, uint32_t k)
{
    return reads_in_step(g, v, k) && !(g->values[v->in[k]].flags & VALUE_STORED);
}

/* Gives slots to the group's unstored values, as few as their lifetimes allow: from the last value
   to the first, so that what is seen first of a value is its last use. */
static bool assign_slots(struct plan *p, const struct group *group, uint32_t *n_slots)
{
    struct graph *g = p->graph;
    uint32_t n_free = 0, n = 0, *idle = malloc((group->count + 4) * sizeof *idle);
    if (!idle)
        return false;
    for (uint32_t i = group->count; i-- > 0;) {
        uint32_t id = g->order[group->first + i];
        const struct value *v = &g->values[id];
        if (!(v->flags & VALUE_STORED)) {
            if (!p->spot[id]) /* nothing reads it */
                g->locs[id].off = n_free ? idle[--n_free] : n++;
            idle[n_free++] = (uint32_t)g->locs[id].off;
        }
        for (uint32_t k = 0; k < ad_ops[v->op].arity; k++) {
            uint32_t x = v->in[k];
            if (in_tile(g, v, k) && !p->spot[x]) {
                g->locs[x].off = n_free ? idle[--n_free] : n++;
                p->spot[x] = 1;
            }
        }
    }
    *n_slots = n;
    free(idle);
    return true;
}

static void shape_tiles(struct plan *p, struct segment *segment, uint32_t n_slots)
{
    size_t tile = CACHE_BYTES / p->program->element / (n_slots + 2);
    tile = tile < MIN_TILE ? MIN_TILE : tile > MAX_TILE ? MAX_TILE : tile & ~(size_t)15;
    if (segment->cols > tile) {
        segment->tile_rows = 1;
        segment->tile_cols = (uint32_t)tile;
    } else {
        size_t most = tile / segment->cols, tiles = (segment->rows - 1) / most + 1;
        segment->tile_rows = (uint32_t)((segment->rows - 1) / tiles + 1); /* about equal */
        segment->tile_cols = segment->cols;
    }
}

static void split_chunks(struct segment *s)
{
    double work = (double)s->rows * s->cols * s->count;
    uint32_t col_tiles = (s->cols - 1) / s->tile_cols + 1;
    uint32_t row_tiles = (s->rows - 1) / s->tile_rows + 1;
    s->chunks = 1;
    s->by_rows = false;
    if (work < PARALLEL_WORK)
        return;
    if (col_tiles >= 8) {
        s->chunks = col_tiles < MAX_CHUNKS ? col_tiles : MAX_CHUNKS;
    } else if (row_tiles >= 8) {
        s->chunks = ROW_CHUNKS;
        s->by_rows = true;
    }
}

/* Unstored values lie on tiles, one behind the other. */
static void lay_on_tiles(struct plan *p, const struct group *group, const struct segment *s,
                         uint32_t n_slots)
{
    struct graph *g = p->graph;
    size_t slot_bytes = ad_slot_bytes(p->program->element, s);
    for (uint32_t i = 0; i < group->count; i++) {
        uint32_t id = g->order[group->first + i];
        struct loc *l = &g->locs[id];
        if (!(g->values[id].flags & VALUE_STORED))
            *l = (struct loc){
                .off = l->off * slot_bytes, .rs = s->tile_cols, .cs = 1, .base = BASE_TILE};
    }
    if (p->tile_bytes < n_slots * slot_bytes)
        p->tile_bytes = n_slots * slot_bytes;
}

bool ad_plan_tiles(struct plan *p, const struct group *group, struct segment *s)
{
    uint32_t n_slots;
    bool number = s->rows == 1 && s->cols == 1;
    if (!number && !group->pass && (size_t)s->rows * s->cols <= INT32_MAX && is_flat(p, group)) {
        s->cols *= s->rows;
        s->rows = 1;
    }
    if (!assign_slots(p, group, &n_slots))
        return false;
    shape_tiles(p, s, n_slots);
    split_chunks(s);
    if (group->pass) {
        s->tile_rows = 1;
        s->chunks = group->blocks;
        s->by_rows = false;
    }
    lay_on_tiles(p, group, s, n_slots);
    return true;
}
