/* The executor: walks each segment tile by tile, one kernel call an instruction and tile.

   Large segments are split into chunks whose number and borders depend on sizes alone; each chunk adds
   into a private copy of the sums, and the copies are added in order. Threads only decide who runs
   which chunk, so they change no bit of the result. */
#include "blas.h"
#include "program.h"

#include <string.h>

struct tile {
    uint32_t row, rows, col, cols;
    char *base[2];
    uint32_t chunk;
};

/* Address of row r of the tile. */
static inline char *row_at(const ad_program *p, const struct loc *l, const struct tile *t,
                           uint32_t r)
{
    if (l->base == BASE_TILE)
        return t->base[BASE_TILE] + l->off + (size_t)r * l->rs * p->element;
    size_t row = (size_t)t->row + r;
    if (l->list)
        row = p->lists[l->list - 1 + row];
    return t->base[BASE_MEMORY] + l->off + (row * l->rs + (size_t)t->col * l->cs) * p->element;
}

/* ---- instructions over one tile ---- */

static inline void elementwise(const ad_program *p, const struct instruction *in,
                               const struct tile *t)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    const struct loc *b = in->n_in > 1 ? &p->locs[in->loc[2]] : a;
    const struct loc *c = in->n_in > 2 ? &p->locs[in->loc[3]] : a;
    size_t n = t->cols;
    uint32_t calls = t->rows;
    if (in->flat) {
        n *= t->rows;
        calls = 1;
    }
    for (uint32_t r = 0; r < calls; r++)
        in->run(n, row_at(p, o, t, r), row_at(p, a, t, r), row_at(p, b, t, r), row_at(p, c, t, r));
}

/* Start of row r of a whole value in memory. */
static inline char *value_row(const ad_program *p, const struct loc *l, size_t r)
{
    return p->memory + l->off + (l->list ? p->lists[l->list - 1 + r] : r) * l->rs * p->element;
}

static inline double get(const ad_program *p, const char *at, size_t i)
{
    return p->type == AD_F32 ? (double)((const float *)(const void *)at)[i]
                             : ((const double *)(const void *)at)[i];
}

static inline void put(const ad_program *p, char *at, size_t i, double x)
{
    if (p->type == AD_F32)
        ((float *)(void *)at)[i] = (float)x;
    else
        ((double *)(void *)at)[i] = x;
}

/* Columns [t->col, t->col + t->cols) of scale*(x[i+1] - x[i]); a repeated last column is the one
   before it again. */
static void diff(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct loc *o = &p->locs[in->loc[0]], *x = &p->locs[in->loc[1]];
    uint32_t width = p->values[in->value].cols;
    bool last = in->loc[3] && t->col + t->cols == width;
    double scale = p->numbers[in->loc[2]];
    for (uint32_t r = 0; r < t->rows; r++) {
        const char *a = value_row(p, x, t->row + r) + t->col * p->element;
        char *y = row_at(p, o, t, r);
        p->kernels->diff(t->cols - last, y, a, scale);
        if (last) /* reads before the tile where it is one column wide */
            p->kernels->diff(1, y + (t->cols - 1) * p->element,
                             a + ((ptrdiff_t)t->cols - 2) * (ptrdiff_t)p->element, scale);
    }
}

/* Columns of the adjoint: g[i] = scale*(u[i-1] - u[i]) inside, with the repeated column of u counted
   to the one before it. */
static void diff_adjoint(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct loc *o = &p->locs[in->loc[0]], *x = &p->locs[in->loc[1]];
    uint32_t width = p->values[in->value].cols, end = t->col + t->cols;
    double scale = p->numbers[in->loc[2]];
    for (uint32_t r = 0; r < t->rows; r++) {
        const char *u = value_row(p, x, t->row + r);
        char *y = row_at(p, o, t, r);
        double extra = in->loc[3] ? get(p, u, width - 1) : 0;
        uint32_t from = t->col ? t->col : 1, to = end < width ? end : width - 1;
        if (from < to)
            p->kernels->diff(to - from, y + (from - t->col) * p->element,
                             u + (from - 1) * p->element, -scale);
        if (t->col == 0)
            put(p, y, 0, -scale * (get(p, u, 0) + (width == 2 ? extra : 0)));
        if (width > 2 && t->col <= width - 2 && end > width - 2)
            put(p, y, width - 2 - t->col,
                scale * (get(p, u, width - 3) - (get(p, u, width - 2) + extra)));
        if (end == width)
            put(p, y, width - 1 - t->col, scale * (get(p, u, width - 2) + extra));
    }
}

static double row_sum(const ad_program *p, const struct loc *a, const char *row, size_t n)
{
    return a->cs ? p->kernels->sum(n, row) : (double)n * get(p, row, 0);
}

static double *partial(const ad_program *p, const struct sink *s, uint32_t chunk)
{
    return (double *)(void *)(p->memory + s->partial + chunk * s->stride);
}

static void sum(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    const struct sink *s = &p->sinks[in->loc[3]];
    const struct loc *a = &p->locs[in->loc[1]];
    double *into = partial(p, s, t->chunk);
    if (in->flat)
        *into += row_sum(p, a, row_at(p, a, t, 0), (size_t)t->rows * t->cols);
    else
        for (uint32_t r = 0; r < t->rows; r++)
            *into += row_sum(p, a, row_at(p, a, t, r), t->cols);
}

static void sum_cols(const ad_program *p, const struct segment *g, const struct instruction *in,
                     const struct tile *t)
{
    const struct sink *s = &p->sinks[in->loc[3]];
    const struct loc *a = &p->locs[in->loc[1]];
    double *into = partial(p, s, g->by_rows ? 0 : t->chunk) + t->row;
    for (uint32_t r = 0; r < t->rows; r++)
        into[r] += row_sum(p, a, row_at(p, a, t, r), t->cols);
}

static void add_rows(const ad_program *p, const struct segment *g, const struct instruction *in,
                     const struct tile *t)
{
    const struct sink *s = &p->sinks[in->loc[3]];
    const struct loc *a = &p->locs[in->loc[1]];
    struct loc o = p->locs[in->loc[0]];
    if (g->by_rows && g->chunks > 1) {
        o.off = s->partial + t->chunk * s->stride;
        o.rs = o.rs ? s->cols : 0;
    }
    for (uint32_t r = 0; r < t->rows; r++) {
        char *into = row_at(p, &o, t, r);
        in->run(t->cols, into, into, row_at(p, a, t, r), NULL);
    }
}

/* ---- looking for values that are not finite ---- */

static void look(const ad_program *p, const struct instruction *in, const struct tile *t,
                 struct check *check)
{
    const struct loc *o = &p->locs[in->loc[0]];
    size_t lane;
    if (in->value >= check->value)
        return;
    for (uint32_t r = 0; r < t->rows; r++) {
        const char *row = row_at(p, o, t, r);
        if (!p->kernels->nonfinite(t->cols, row, &lane))
            continue;
        *check = (struct check){in->value, t->row + r, t->col + (uint32_t)lane, get(p, row, lane)};
        return;
    }
}

static void look_at_value(const ad_program *p, const struct instruction *in, struct check *check)
{
    const struct value *v = &p->values[in->value];
    const struct loc *o = &p->locs[in->value];
    size_t lane;
    for (uint32_t r = 0; r < v->rows && in->value < check->value; r++)
        if (p->kernels->nonfinite(v->cols, value_row(p, o, r), &lane))
            *check = (struct check){in->value, r, (uint32_t)lane, get(p, value_row(p, o, r), lane)};
}

/* ---- fused segments ---- */

static void run_tile(const ad_program *p, const struct segment *g, const struct tile *t,
                     struct check *check)
{
    const struct instruction *in = p->instructions + g->first, *end = in + g->count;
    for (; in < end; in++) {
        switch (in->kind) {
        case DO_ELEMENTWISE: elementwise(p, in, t); break;
        case DO_DIFF: diff(p, in, t); break;
        case DO_DIFF_ADJOINT: diff_adjoint(p, in, t); break;
        case DO_SUM: sum(p, in, t); continue;
        case DO_SUM_COLS: sum_cols(p, g, in, t); continue;
        default: add_rows(p, g, in, t); continue;
        }
        if (check)
            look(p, in, t, check);
    }
}

static uint32_t border(uint32_t extent, uint32_t tile, uint32_t chunk, uint32_t chunks)
{
    uint64_t tiles = (extent - 1) / tile + 1;
    uint64_t at = tiles * chunk / chunks * tile;
    return at < extent ? (uint32_t)at : extent;
}

/* Rows and columns of a chunk. */
static struct tile extent(const struct segment *g, uint32_t chunk)
{
    struct tile t = {.rows = g->rows, .cols = g->cols, .chunk = chunk};
    if (g->chunks == 1)
        return t;
    if (g->by_rows) {
        t.row = border(g->rows, g->tile_rows, chunk, g->chunks);
        t.rows = border(g->rows, g->tile_rows, chunk + 1, g->chunks) - t.row;
    } else {
        t.col = border(g->cols, g->tile_cols, chunk, g->chunks);
        t.cols = border(g->cols, g->tile_cols, chunk + 1, g->chunks) - t.col;
    }
    return t;
}

/* Zero what the chunk adds into. */
static void clear_sinks(const ad_program *p, const struct segment *g, const struct tile *chunk)
{
    for (uint32_t k = 0; k < g->n_sinks; k++) {
        const struct sink *s = &p->sinks[g->first_sink + k];
        const struct loc *o = &p->locs[p->instructions[s->instruction].value];
        bool copies = g->by_rows && g->chunks > 1;
        if (s->kind == DO_SUM)
            *partial(p, s, chunk->chunk) = 0;
        else if (s->kind == DO_SUM_COLS)
            memset(partial(p, s, g->by_rows ? 0 : chunk->chunk) + chunk->row, 0,
                   chunk->rows * sizeof(double));
        else if (copies)
            memset(partial(p, s, chunk->chunk), 0, s->stride);
        else
            for (uint32_t r = 0; r < s->rows; r++)
                memset(value_row(p, o, r) + chunk->col * p->element, 0, chunk->cols * p->element);
    }
}

static void run_chunk(const ad_program *p, const struct segment *g, uint32_t number, char *tiles,
                      struct check *check)
{
    const struct tile chunk = extent(g, number);
    clear_sinks(p, g, &chunk);
    struct tile t = chunk;
    t.base[BASE_MEMORY] = p->memory;
    t.base[BASE_TILE] = tiles;
    uint32_t row_end = chunk.row + chunk.rows, col_end = chunk.col + chunk.cols;
    for (t.row = chunk.row; t.row < row_end; t.row += g->tile_rows) {
        t.rows = row_end - t.row < g->tile_rows ? row_end - t.row : g->tile_rows;
        for (t.col = chunk.col; t.col < col_end; t.col += g->tile_cols) {
            t.cols = col_end - t.col < g->tile_cols ? col_end - t.col : g->tile_cols;
            run_tile(p, g, &t, check);
        }
    }
}

/* Adds the private copies of the chunks, in order. */
static void collect_sinks(const ad_program *p, const struct segment *g, struct check *check)
{
    for (uint32_t k = 0; k < g->n_sinks; k++) {
        const struct sink *s = &p->sinks[g->first_sink + k];
        const struct instruction *in = &p->instructions[s->instruction];
        char *o = p->memory + p->locs[in->value].off;
        size_t n = (size_t)s->rows * s->cols;
        if (s->kind == DO_SUM) {
            p->kernels->collect(1, o, g->chunks, partial(p, s, 0));
        } else if (s->kind == DO_SUM_COLS) {
            p->kernels->collect(s->rows, o, g->by_rows ? 1 : g->chunks, partial(p, s, 0));
        } else if (g->by_rows && g->chunks > 1) {
            p->kernels->op[AD_OP_copy][0](n, o, partial(p, s, 0), NULL, NULL);
            for (uint32_t c = 1; c < g->chunks; c++)
                p->kernels->op[AD_OP_add][0](n, o, o, partial(p, s, c), NULL);
        }
        if (check)
            look_at_value(p, in, check);
    }
}

static void run_fused(const ad_program *p, const struct segment *g, struct check *check)
{
    if (g->chunks == 1 || p->threads == 1 || check) {
        for (uint32_t c = 0; c < g->chunks; c++)
            run_chunk(p, g, c, p->tiles, check);
    } else {
#pragma omp parallel for num_threads((int)p->threads) schedule(static, 1)
        for (size_t thread = 0; thread < p->threads; thread++)
            for (size_t c = thread; c < g->chunks; c += p->threads)
                run_chunk(p, g, (uint32_t)c, p->tiles + thread * p->tile_bytes, NULL);
    }
    if (g->n_sinks)
        collect_sinks(p, g, check);
}

/* ---- operations that stand alone ---- */

static void matmul(const ad_program *p, const struct segment *g, const struct instruction *in)
{
    enum { PIECE = 64, MAX_PIECES = 16 };
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]], *b = &p->locs[in->loc[2]];
    const struct value *va = &p->values[in->loc[1]];
    bool ta = in->loc[3] & 1, tb = in->loc[3] >> 1;
    size_t m = g->rows, n = g->cols, k = ta ? va->rows : va->cols, e = p->element;
    bool by_rows = m > n;
    size_t extent_of = by_rows ? m : n, pieces = 1;
    if ((double)m * (double)n * (double)k > 1e6)
        pieces = extent_of / PIECE < MAX_PIECES ? extent_of / PIECE : MAX_PIECES;
    pieces += pieces == 0;
#pragma omp parallel for num_threads((int)p->threads) schedule(static, 1) if (pieces > 1 && p->threads > 1)
    for (size_t i = 0; i < pieces; i++) {
        size_t from = extent_of * i / pieces, size = extent_of * (i + 1) / pieces - from;
        const char *pa = p->memory + a->off, *pb = p->memory + b->off;
        char *po = p->memory + o->off;
        pa += by_rows ? from * (ta ? 1 : a->rs) * e : 0;
        pb += by_rows ? 0 : from * (tb ? b->rs : 1) * e;
        po += from * (by_rows ? o->rs : 1) * e;
        ad_blas_gemm(p->type, ta, tb, by_rows ? size : m, by_rows ? n : size, k, pa, a->rs, pb, b->rs,
                     po, o->rs);
    }
}

static void place(const ad_program *p, const struct segment *g, const struct instruction *in)
{
    const struct loc *o = &p->locs[in->loc[0]];
    if (g->clear)
        memset(p->memory + o->off, 0, (size_t)g->rows * g->cols * p->element);
    for (uint32_t k = 0; k < in->loc[2]; k++) {
        const struct part *part = &p->parts[in->loc[1] + k];
        const struct loc *x = &p->locs[part->loc];
        ad_kernel *copy = p->kernels->op[AD_OP_copy][x->cs == 0];
        ad_kernel *add = p->kernels->op[AD_OP_add][x->cs == 0 ? VARIANT_B_NUMBER : 0];
        for (uint32_t r = 0; r < part->rows; r++) {
            char *to = value_row(p, o, part->row + r) + part->col * p->element;
            const char *from = value_row(p, x, r);
            if (g->clear)
                add(part->cols, to, to, from, NULL);
            else
                copy(part->cols, to, from, NULL, NULL);
        }
    }
}

static void run_alone(const ad_program *p, const struct segment *g, struct check *check)
{
    const struct instruction *in = &p->instructions[g->first];
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]];
    if (in->kind == DO_MATMUL)
        matmul(p, g, in);
    else if (in->kind == DO_PLACE)
        place(p, g, in);
    else
        p->kernels->transpose(g->cols, g->rows, p->memory + o->off, o->rs, p->memory + a->off, a->rs);
    if (check)
        look_at_value(p, in, check);
}

void ad_program_execute(ad_program *p, size_t first, size_t last, struct check *check)
{
    int before = p->has_matmul ? ad_blas_single_thread() : 1;
    for (size_t i = first; i < last; i++) {
        const struct segment *g = &p->segments[i];
        if (g->fused)
            run_fused(p, g, check);
        else
            run_alone(p, g, check);
    }
    ad_blas_threads(before);
}

void ad_run(ad_program *p)
{
    ad_program_execute(p, p->n_constant_segments, p->n_segments, NULL);
}
