/* Loop order of a compiled segment: which dimension fills the vectors, which loop is the inner one,
   and where chunks are split. */
#include "writer.h"

/* Rows are combined, and lie in registers or the first-level cache if the loop over rows is the
   inner one. Rows that are read or written once each then are as many streams through memory, and
   where most are, the processor keeps up with a few only. */
static bool runs_rows_inside(const ad_program *p, const struct segment *g)
{
    enum { STREAMS = 16 };
    size_t combined = 0, once = 0;
    for (const struct instruction *in = p->instructions + g->first, *end = in + g->count; in < end;
         in++) {
        combined += in->kind == DO_ADD_ROWS;
        for (uint32_t k = 0; in->kind == DO_ELEMENTWISE && k <= in->n_in; k++) {
            const struct loc *l = &p->locs[in->loc[k]];
            combined += l->list != 0;
            once += !l->list && l->rs && l->cs && l->base != BASE_TILE;
        }
    }
    return combined && (combined > once || once * g->rows <= STREAMS);
}

/* Results are contiguous, and no operand reads neighbouring columns. */
static bool rows_are_lanes(const ad_program *p, const struct segment *g)
{
    for (const struct instruction *in = p->instructions + g->first, *end = in + g->count; in < end;
         in++) {
        const struct loc *o = &p->locs[in->loc[0]];
        if (in->kind == DO_DIFF || in->kind == DO_DIFF_ADJOINT)
            return false;
        if (in->kind == DO_ELEMENTWISE && o->base == BASE_MEMORY && o->rs != 1)
            return false;
    }
    return g->cols == 1 && g->rows > 1;
}

/* The widest vector that the extent fills: complete registers, or single numbers. */
static uint32_t lanes_of(size_t element, uint32_t extent, size_t bytes)
{
    enum { SMALLEST_VECTOR = 16 };
    for (; bytes >= SMALLEST_VECTOR; bytes /= 2)
        if (extent >= bytes / element)
            return (uint32_t)(bytes / element);
    return 1;
}

bool ad_native_is_literal(const struct loop_order *w)
{
    enum { MOST = 640 }; /* instructions */
    const struct segment *g = &w->segment;
    return !w->along_rows && g->rows <= MAX_LITERAL_ROWS && g->rows * g->count <= MOST &&
           !(g->by_rows && g->chunks > 1);
}

/* Accumulated rows need no private copies when columns are split instead of rows. A chunk is at
   least two vectors wide: its last vector is moved back to end with the chunk, and must stay
   inside. */
static void split(const ad_program *p, struct loop_order *w)
{
    struct segment *g = &w->segment;
    bool sums_rows = false;
    uint32_t extent = w->along_rows ? g->rows : g->cols;
    for (uint32_t k = 0; k < g->n_sinks; k++)
        sums_rows = sums_rows || p->sinks[g->first_sink + k].kind == DO_SUM_COLS;
    if (g->chunks == 1 || g->pass)
        return;
    if (g->by_rows && w->rows_inside && !sums_rows && extent >= 8 * w->lanes)
        g->by_rows = false;
    uint32_t most = (extent - 1) / w->lanes / 2;
    g->chunks = g->by_rows || g->chunks < most ? g->chunks : most;
    g->tile_rows = w->along_rows ? w->lanes : 1;
    g->tile_cols = w->lanes;
}

struct loop_order ad_native_loop_order(const ad_program *p, uint32_t number, size_t bytes)
{
    struct loop_order w = {.segment = p->segments[number], .number = number};
    const struct segment *g = &w.segment;
    w.along_rows = rows_are_lanes(p, g);
    w.rows_inside = !w.along_rows && runs_rows_inside(p, g);
    w.lanes = lanes_of(p->element, w.along_rows ? g->rows : g->cols, bytes);
    split(p, &w);
    w.literal = w.rows_inside && ad_native_is_literal(&w);
    w.joined = 1;
    return w;
}
