/* Segments of a single tile, as most are at a hundred slices: where every operand lies is known
   when compiling, so the segment becomes a plain list of kernel calls. */
#include "exec.h"

#include <stdlib.h>

enum { MAX_CALLS = 1024 }; /* a segment; longer ones lose little by finding their operands */

static bool is_single_tile(const struct segment *g)
{
    return g->fused && g->chunks == 1 && g->rows <= g->tile_rows && g->cols <= g->tile_cols &&
           (size_t)g->count * g->rows <= MAX_CALLS;
}

static struct call call_at(const struct instruction *in, size_t n, const struct cursor c[4],
                           uint32_t row)
{
    return (struct call){in->run,
                         n,
                         cursor_row(&c[0], row),
                         cursor_row(&c[1], row),
                         in->n_in > 1 ? cursor_row(&c[2], row) : NULL,
                         in->n_in > 2 ? cursor_row(&c[3], row) : NULL};
}

static size_t resolve(const ad_program *p, const struct segment *g, const struct instruction *in,
                      const struct tile *t, struct call *calls)
{
    struct cursor c[4];
    if (in->kind != DO_ELEMENTWISE && in->kind != DO_ADD_ROWS) {
        calls[0] = (struct call){.a = in};
        return 1;
    }
    for (uint32_t k = 0; k <= in->n_in; k++)
        c[k] = cursor_at(p, &p->locs[in->loc[k]], t);
    if (in->kind == DO_ELEMENTWISE && in->flat) {
        calls[0] = call_at(in, (size_t)g->rows * g->cols, c, 0);
        return 1;
    }
    for (uint32_t r = 0; r < g->rows; r++) {
        calls[r] = call_at(in, g->cols, c, r);
        if (in->kind == DO_ADD_ROWS) {
            calls[r].b = calls[r].a;
            calls[r].a = calls[r].o;
        }
    }
    return g->rows;
}

bool ad_resolve_calls(ad_program *p)
{
    size_t most = 0, n = 0;
    for (size_t i = 0; i < p->n_segments; i++)
        if (is_single_tile(&p->segments[i]))
            most += (size_t)p->segments[i].count * p->segments[i].rows;
    p->calls = malloc((most + 1) * sizeof *p->calls);
    if (!p->calls)
        return false;
    for (size_t i = 0; i < p->n_segments; i++) {
        struct segment *g = &p->segments[i];
        if (!is_single_tile(g))
            continue;
        const struct tile t = {.rows = g->rows, .cols = g->cols, .base = {p->memory, p->tiles}};
        g->first_call = (uint32_t)n;
        for (uint32_t k = 0; k < g->count; k++)
            n += resolve(p, g, &p->instructions[g->first + k], &t, p->calls + n);
        g->n_calls = (uint32_t)n - g->first_call;
    }
    struct call *trimmed = realloc(p->calls, (n + 1) * sizeof *p->calls);
    if (trimmed)
        p->calls = trimmed;
    p->n_calls = n;
    return true;
}
