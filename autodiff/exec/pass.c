/* Runs a pass over columns (compile/passes.c): the segments take a block of columns one after the
   other; what passes between them lies in windows, of which each thread has its own. */
#include "exec.h"
#include "pool.h"

#include <stddef.h>

/* The n segments of a pass. */
struct pass {
    const ad_program *p;
    const struct segment *g;
    size_t n;
};

static void run_columns(const ad_program *p, const struct segment *g, struct tile t, uint32_t col,
                        uint32_t end, struct check *check)
{
    t.col = col;
    t.cols = end - col;
    if (g->code)
        g->code(p->memory, t.base[BASE_WINDOW], p->lists, t.chunk, 0, g->rows, col, end);
    else
        ad_run_range(p, g, &t, check);
}

/* The columns beyond the block come first: its own then overwrite the sums. */
static void run_block(const struct pass *of, uint32_t number, char *tiles, struct check *check)
{
    const ad_program *p = of->p;
    struct tile t = ad_extent(of->g, number);
    uint32_t end = t.col + t.cols;
    t.base[BASE_MEMORY] = p->memory;
    t.base[BASE_TILE] = tiles;
    t.base[BASE_WINDOW] =
        tiles + p->window - ((ptrdiff_t)t.col - WINDOW_MARGIN) * (ptrdiff_t)p->element;
    for (const struct segment *g = of->g; g < of->g + of->n; g++) {
        uint32_t before = t.col < g->before ? t.col : g->before;
        uint32_t after = g->cols - end < g->after ? g->cols - end : g->after;
        t.rows = g->rows;
        if (before)
            run_columns(p, g, t, t.col - before, t.col, NULL);
        if (after)
            run_columns(p, g, t, end, end + after, NULL);
        run_columns(p, g, t, t.col, end, check);
        for (uint32_t k = 0; check && k < g->n_sinks; k++) {
            const struct instruction *in =
                &p->instructions[p->sinks[g->first_sink + k].instruction];
            if (p->locs[in->value].base == BASE_WINDOW)
                ad_inspect_tile(p, in, &t, check);
        }
    }
}

static void run_block_piece(void *context, size_t thread, size_t number)
{
    const struct pass *of = context;
    run_block(of, (uint32_t)number, tiles_of(of->p, thread), NULL);
}

void ad_run_pass(const ad_program *p, const struct segment *g, size_t n, struct check *check)
{
    struct pass pass = {p, g, n};
    if (check)
        for (uint32_t c = 0; c < g->chunks; c++)
            run_block(&pass, c, p->tiles, check);
    else
        ad_parallel(p->threads, g->chunks, run_block_piece, &pass);
    for (size_t k = 0; k < n; k++)
        ad_collect_sinks(p, &g[k], check);
}
