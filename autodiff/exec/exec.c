/* The executor: runs each segment tile by tile, one kernel call per instruction and tile.

   Large segments are split into chunks whose number and bounds depend on sizes alone. Each chunk
   accumulates into a private copy of the sums, and the copies are added in order: the number of
   threads decides who runs which chunk, and changes no bit of the result. */
#include "autodiff/blas.h"
#include "exec.h"
#include "pool.h"

#include <math.h>
#include <string.h>

static uint32_t border(uint32_t extent, uint32_t tile, uint32_t chunk, uint32_t chunks)
{
    uint64_t tiles = (extent - 1) / tile + 1;
    uint64_t at = tiles * chunk / chunks * tile;
    return at < extent ? (uint32_t)at : extent;
}

/* Rows and columns of a chunk. */
struct tile ad_extent(const struct segment *g, uint32_t chunk)
{
    struct tile t = {.rows = g->rows, .cols = g->cols, .chunk = chunk};
    if (g->chunks == 1)
        return t;
    if (g->by_rows) {
        t.row = border(g->rows, g->tile_rows, chunk, g->chunks);
        t.rows = border(g->rows, g->tile_rows, chunk + 1, g->chunks) - t.row;
    } else {
        uint32_t step = g->pass ? WINDOW_STEP : g->tile_cols;
        t.col = border(g->cols, step, chunk, g->chunks);
        t.cols = border(g->cols, step, chunk + 1, g->chunks) - t.col;
    }
    return t;
}

/* Zeroes the memory that the chunk, or the calls of the segment, accumulate into. */
static void clear_sinks(const ad_program *p, const struct segment *g, const struct tile *chunk,
                        bool calls)
{
    for (uint32_t k = 0; k < g->n_sinks; k++) {
        const struct sink *s = &p->sinks[g->first_sink + k];
        const struct loc *o = &p->locs[p->instructions[s->instruction].value];
        char *rows = chunk->base[o->base] + o->off;
        bool copies = g->by_rows && g->chunks > 1;
        if (calls && s->begun)
            continue;
        if (s->kind == DO_SUM)
            *sink_copy(p, s, chunk->chunk) = 0;
        else if (s->kind == DO_SUM_COLS)
            memset(sink_copy(p, s, g->by_rows ? 0 : chunk->chunk) + chunk->row, 0,
                   chunk->rows * sizeof(double));
        else if (copies)
            memset(sink_copy(p, s, chunk->chunk), 0, s->stride);
        else if (chunk->cols == s->cols)
            memset(rows, 0, (size_t)s->rows * s->cols * p->element);
        else
            for (uint32_t r = 0; r < s->rows; r++)
                memset(rows + ((size_t)r * o->rs + chunk->col) * p->element, 0,
                       chunk->cols * p->element);
    }
}

void ad_run_range(const ad_program *p, const struct segment *g, const struct tile *range,
                  struct check *check)
{
    clear_sinks(p, g, range, false);
    struct tile t = *range;
    uint32_t row_end = range->row + range->rows, col_end = range->col + range->cols;
    for (t.row = range->row; t.row < row_end; t.row += g->tile_rows) {
        t.rows = row_end - t.row < g->tile_rows ? row_end - t.row : g->tile_rows;
        for (t.col = range->col; t.col < col_end; t.col += g->tile_cols) {
            t.cols = col_end - t.col < g->tile_cols ? col_end - t.col : g->tile_cols;
            ad_run_tile(p, g, &t, check);
        }
    }
}

static void run_chunk(const ad_program *p, const struct segment *g, uint32_t number, char *tiles,
                      struct check *check)
{
    struct tile t = ad_extent(g, number);
    t.base[BASE_MEMORY] = p->memory;
    t.base[BASE_TILE] = tiles;
    ad_run_range(p, g, &t, check);
}

/* Adds the private copies of the chunks, in order. */
void ad_collect_sinks(const ad_program *p, const struct segment *g, struct check *check)
{
    for (uint32_t k = 0; k < g->n_sinks; k++) {
        const struct sink *s = &p->sinks[g->first_sink + k];
        const struct instruction *in = &p->instructions[s->instruction];
        char *o = p->memory + p->locs[in->value].off;
        size_t n = (size_t)s->rows * s->cols;
        if (s->kind == DO_SUM) {
            p->kernels->collect(1, o, g->chunks, sink_copy(p, s, 0));
        } else if (s->kind == DO_SUM_COLS) {
            p->kernels->collect(s->rows, o, g->by_rows ? 1 : g->chunks, sink_copy(p, s, 0));
        } else if (g->by_rows && g->chunks > 1) {
            p->kernels->op[AD_OP_copy][0](n, o, sink_copy(p, s, 0), NULL, NULL);
            for (uint32_t c = 1; c < g->chunks; c++)
                p->kernels->op[AD_OP_add][0](n, o, o, sink_copy(p, s, c), NULL);
        }
        if (check && p->locs[in->value].base != BASE_WINDOW)
            ad_inspect_value(p, in, check);
    }
}

/* A segment of few tiles. */
static void run_calls(const ad_program *p, const struct segment *g)
{
    struct tile t = {.rows = g->rows, .cols = g->cols, .base = {p->memory, p->tiles}};
    const struct call *c = p->calls + g->first_call, *end = c + g->n_calls;
    if (g->n_sinks)
        clear_sinks(p, g, &t, true);
    for (; c < end; c++) {
        if (c->run) {
            c->run(c->n, c->o, c->a, c->b, c->c);
            continue;
        }
        if (c->second) {
            p->kernels->sin_and_cos(c->n, c->o, c->second, c->a);
            continue;
        }
        t.row = (uint32_t)c->n;
        t.rows = tile_rows_at(g, t.row);
        ad_run_instruction(p, g, c->a, &t);
    }
}

static void run_code_chunk(const ad_program *p, const struct segment *g, uint32_t number)
{
    const struct tile t = ad_extent(g, number);
    g->code(p->memory, NULL, p->lists, number, t.row, t.row + t.rows, t.col, t.col + t.cols);
}

/* A chunk of a segment, for the pool. */
struct piece {
    const ad_program *p;
    const struct segment *g;
};

static void run_code_piece(void *context, size_t thread, size_t number)
{
    const struct piece *of = context;
    (void)thread;
    run_code_chunk(of->p, of->g, (uint32_t)number);
}

static void run_fused_piece(void *context, size_t thread, size_t number)
{
    const struct piece *of = context;
    const ad_program *p = of->p;
    run_chunk(p, of->g, (uint32_t)number, tiles_of(p, thread), NULL);
}

/* ---- all segments ---- */

/* Segments from i on that run together. */
static size_t together(const struct segment *segments, size_t i, size_t last)
{
    size_t n = 1;
    while (segments[i].pass && i + n < last && segments[i + n].pass == segments[i].pass)
        n++;
    return n;
}

static void run_code(const ad_program *p, const struct segment *g)
{
    if (g->chunks == 1) { /* whole segments leave their sums where they belong */
        g->code(p->memory, NULL, p->lists, 0, 0, g->rows, 0, g->cols);
        return;
    }
    ad_parallel(p->threads, g->chunks, run_code_piece, &(struct piece){p, g});
    ad_collect_sinks(p, g, NULL);
}

static void run_fused(const ad_program *p, const struct segment *g, struct check *check)
{
    if (g->n_calls && !check)
        run_calls(p, g);
    else if (check)
        for (uint32_t c = 0; c < g->chunks; c++)
            run_chunk(p, g, c, p->tiles, check);
    else
        ad_parallel(p->threads, g->chunks, run_fused_piece, &(struct piece){p, g});
    if (g->n_sinks)
        ad_collect_sinks(p, g, check);
}

void ad_execute(const ad_program *p, const struct segment *segments, size_t first, size_t last,
                struct check *check)
{
    if (p->has_matmul)
        ad_blas_single_thread();
    for (size_t i = first, n; i < last; i += n) {
        const struct segment *g = &segments[i];
        n = together(segments, i, last);
        if (g->pass) {
            ad_run_pass(p, g, n, check);
        } else if (g->code) {
            run_code(p, g);
        } else if (g->fused) {
            run_fused(p, g, check);
        } else if (p->instructions[g->first].kind == DO_SCAN) {
            ad_run_scan(p, &p->instructions[g->first], check);
        } else {
            ad_run_alone(p, g, &(struct tile){.cols = g->cols, .base = {p->memory}});
            if (check)
                ad_inspect_value(p, &p->instructions[g->first], check);
        }
    }
    if (p->has_matmul)
        ad_blas_threads();
}

/* Segments to run, [*first, *last). A rerun skips those that depend only on held inputs. */
static const struct segment *segments_of(ad_program *p, bool again, size_t *first, size_t *last)
{
    *first = again ? p->n_held_segments : p->n_constant_segments;
    *last = p->n_segments;
    const struct segment *others = p->back_end ? p->back_end->prepare(p, again, first, last) : NULL;
    return others ? others : p->segments;
}

static void run(ad_program *p, bool again)
{
    size_t first, last;
    const struct segment *segments = segments_of(p, again, &first, &last);
    ad_execute(p, segments, first, last, NULL);
    ad_report_run(p, &p->error);
}

void ad_run(ad_program *p)
{
    if (!p)
        return;
    run(p, false);
    p->was_run = true;
    p->held_stand = p->error.status != AD_E_ACCURACY; /* interrupted */
}

enum ad_status ad_rerun(ad_program *p)
{
    if (!p)
        return AD_E_ARGUMENT;
    p->error.status = AD_OK;
    if (!p->was_run)
        return ad_fail(&p->error, AD_E_ARGUMENT,
                       "ad_rerun before any ad_run: what depends on held inputs has no values");
    if (!p->held_stand)
        return ad_fail(
            &p->error, AD_E_ARGUMENT,
            "ad_rerun after a held input was set or a run was interrupted: ad_run comes first");
    run(p, true);
    return p->error.status;
}

const struct ad_error *ad_program_error(const ad_program *p)
{
    static const struct ad_error no_program = {AD_E_ARGUMENT, "no program (NULL)"};
    return p ? &p->error : &no_program;
}

double ad_run_timed(ad_program *p)
{
    double products = 0;
    if (!p)
        return (double)NAN;
    size_t threads = p->threads;
    p->products = &products;
    p->threads = 1;
    ad_run(p);
    p->threads = threads;
    p->products = NULL;
    return products;
}
