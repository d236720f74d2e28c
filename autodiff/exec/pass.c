/* Runs a pass over columns (compile/passes.c): the segments take a block of columns one after the
   other; what passes between them lies in windows, of which each thread has its own. */
#include "exec.h"
#include "pool.h"

#include <pthread.h>
#include <stddef.h>

/* The n segments of a pass; how many blocks each product has added that adds columns up. */
struct pass {
    const ad_program *p;
    const struct segment *g;
    size_t n;
    uint32_t added[UINT8_MAX + 1];
    pthread_mutex_t lock;
    pthread_cond_t next;
};

/* Blocks are taken in order, and so the block waited for is under way. */
static void add_in_turn(struct pass *of, const struct segment *g, const struct tile *t)
{
    pthread_mutex_lock(&of->lock);
    while (of->added[g->turn] < t->chunk)
        pthread_cond_wait(&of->next, &of->lock);
    pthread_mutex_unlock(&of->lock);
    ad_run_alone(of->p, g, t);
    pthread_mutex_lock(&of->lock);
    of->added[g->adds]++;
    pthread_cond_broadcast(&of->next);
    pthread_mutex_unlock(&of->lock);
}

static void run_columns(const ad_program *p, const struct segment *g, struct tile t, uint32_t col,
                        uint32_t end, struct check *check)
{
    t.col = col;
    t.cols = end - col;
    if (!g->fused)
        ad_run_alone(p, g, &t);
    else if (g->code)
        g->code(p->memory, t.base[BASE_WINDOW], p->lists, t.chunk, 0, g->rows, col, end);
    else
        ad_run_range(p, g, &t, check);
}

/* The columns beyond the block come first: its own then overwrite the sums. */
static void run_block(struct pass *of, uint32_t number, char *tiles, struct check *check)
{
    const ad_program *p = of->p;
    struct tile t = ad_extent(of->g, number);
    uint32_t end = t.col + t.cols;
    t.base[BASE_MEMORY] = p->memory;
    t.base[BASE_TILE] = tiles;
    t.base[BASE_WINDOW] =
        tiles + p->window - ((ptrdiff_t)t.col - of->g->margin) * (ptrdiff_t)p->element;
    for (const struct segment *g = of->g; g < of->g + of->n; g++) {
        uint32_t before = t.col < g->before ? t.col : g->before;
        uint32_t after = g->cols - end < g->after ? g->cols - end : g->after;
        t.rows = g->rows;
        if (g->adds) {
            add_in_turn(of, g, &t);
            continue;
        }
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
        if (check && !g->fused)
            ad_inspect_tile(p, &p->instructions[g->first], &t, check);
    }
}

static void run_block_piece(void *context, size_t thread, size_t number)
{
    struct pass *of = context;
    run_block(of, (uint32_t)number, tiles_of(of->p, thread), NULL);
}

void ad_run_pass(const ad_program *p, const struct segment *g, size_t n, struct check *check)
{
    struct pass pass = {p, g, n, {0}, PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER};
    if (check)
        for (uint32_t c = 0; c < g->chunks; c++)
            run_block(&pass, c, p->tiles, check);
    else
        ad_parallel(p->threads, g->chunks, run_block_piece, &pass);
    for (size_t k = 0; k < n; k++) {
        ad_collect_sinks(p, &g[k], check);
        if (check && g[k].adds)
            ad_inspect_value(p, &p->instructions[g[k].first], check);
    }
}
