/* Kernel calls with precomputed addresses, for segments of few tiles: operand addresses are known
   at compile time, so the segment becomes a list of calls. 1.1 to 1.3 times as fast at a hundred
   slices, 1.8 times at one. */
#include "exec.h"

#include <stdlib.h>

enum { MAX_CALLS = 1024 }; /* calls of a segment at most; longer ones gain little */

static bool is_short(const struct segment *g)
{
    return g->fused && g->chunks == 1 && g->cols <= g->tile_cols &&
           (size_t)g->count * g->rows <= MAX_CALLS;
}

static struct call call_at(const struct instruction *in, size_t n, const struct cursor c[4],
                           uint32_t row)
{
    return (struct call){in->run,
                         n,
                         cursor_row(&c[0], row),
                         NULL,
                         cursor_row(&c[1], row),
                         in->n_in > 1 ? cursor_row(&c[2], row) : NULL,
                         in->n_in > 2 ? cursor_row(&c[3], row) : NULL};
}

static size_t resolve(const ad_program *p, const struct instruction *in, const struct tile *t,
                      struct call *calls)
{
    struct cursor c[4];
    if (in->joined == JOINED_BEHIND)
        return 0;
    if (in->joined) {
        for (uint32_t r = 0; r < (in->flat ? 1 : t->rows); r++)
            calls[r] = ad_joined_call(p, in, t, r);
        return in->flat ? 1 : t->rows;
    }
    if (in->kind != DO_ELEMENTWISE && in->kind != DO_ADD_ROWS) {
        calls[0] = (struct call){.a = in, .n = t->row};
        return 1;
    }
    for (uint32_t k = 0; k <= in->n_in; k++)
        c[k] = cursor_at(p, &p->locs[in->loc[k]], t);
    if (in->kind == DO_ELEMENTWISE && in->flat) {
        calls[0] = call_at(in, (size_t)t->rows * t->cols, c, 0);
        return 1;
    }
    for (uint32_t r = 0; r < t->rows; r++) {
        calls[r] = call_at(in, t->cols, c, r);
        if (in->kind == DO_ADD_ROWS) {
            calls[r].b = calls[r].a;
            calls[r].a = calls[r].o;
        }
    }
    return t->rows;
}

static size_t resolve_tiles(const ad_program *p, const struct segment *g, struct call *calls)
{
    struct tile t = {.cols = g->cols, .base = {p->memory, p->tiles}};
    size_t n = 0;
    for (; t.row < g->rows; t.row += g->tile_rows) {
        t.rows = tile_rows_at(g, t.row);
        for (uint32_t k = 0; k < g->count; k++)
            n += resolve(p, &p->instructions[g->first + k], &t, calls + n);
    }
    return n;
}

bool ad_resolve_calls(ad_program *p)
{
    size_t most = 0, n = 0;
    for (size_t i = 0; i < p->n_segments; i++)
        if (is_short(&p->segments[i]))
            most += (size_t)p->segments[i].count * p->segments[i].rows;
    p->calls = malloc((most + 1) * sizeof *p->calls);
    if (!p->calls)
        return false;
    for (size_t i = 0; i < p->n_segments; i++) {
        struct segment *g = &p->segments[i];
        if (!is_short(g))
            continue;
        g->first_call = (uint32_t)n;
        g->n_calls = (uint32_t)resolve_tiles(p, g, p->calls + n);
        n += g->n_calls;
    }
    struct call *trimmed = realloc(p->calls, (n + 1) * sizeof *p->calls);
    if (trimmed)
        p->calls = trimmed;
    p->n_calls = n;
    return true;
}
