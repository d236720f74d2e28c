/* Which consecutive segments share one loop over columns: each takes a vector of columns through
   all its rows, which are few, and the next one finds them in registers.

   Run one after the other they would read and write whole rows. In one loop a segment may read what
   another one of it wrote in the same columns, and in the column before (the adjoint of time
   differences). It may not write what another one has read or written, because the last vector of a
   loop computes some columns again. */
#include "writer.h"

enum { MOST_ROWS = MAX_PLACES, MOST_TOGETHER = 1024 }; /* instructions */

/* Rows of memory that the segments of a loop read or write. */
struct row {
    size_t at, bytes;
    uint8_t base;
    bool written;
};
struct together {
    const ad_program *p;
    struct row rows[MOST_ROWS];
    size_t n, instructions;
    bool late; /* a column is right in the last vector alone, which computes it again */
};

static bool is_candidate(const ad_program *p, const struct loop_order *w)
{
    const struct segment *g = &w->segment;
    bool sums = false;
    for (uint32_t k = 0; k < g->n_sinks; k++)
        sums = sums || p->sinks[g->first_sink + k].kind == DO_SUM_COLS;
    return g->fused && (g->pass || g->chunks == 1) && w->lanes > 1 && !sums &&
           ad_native_is_literal(w);
}

static bool continues(const ad_program *p, const struct loop_order *before,
                      const struct loop_order *w)
{
    const struct segment *a = &before->segment, *b = &w->segment;
    return is_candidate(p, w) && a->cols == b->cols && a->chunks == b->chunks &&
           a->pass == b->pass && w->number != p->n_held_segments &&
           a->first_sink + a->n_sinks == b->first_sink;
}

/* Row r of operand k, or of the result. Rows of windows begin at different places or are the same.
 */
static struct row row_of(const ad_program *p, const struct segment *g, const struct instruction *in,
                         uint32_t k, uint32_t r)
{
    const struct loc *l = &p->locs[in->loc[k]];
    bool number = !l->cs || (k == 0 && in->kind == DO_SUM);
    size_t row = l->list && !(k == 0 && is_sum(in)) ? p->lists[l->list - 1 + r] : r;
    return (struct row){.at = l->off + row * l->rs * p->element,
                        .bytes = l->base == BASE_WINDOW ? 1 : (number ? 1 : g->cols) * p->element,
                        .base = l->base,
                        .written = k == 0};
}

/* The row is one that no earlier segment has touched, or is read as it may be. */
static bool is_free(const struct together *loop, struct row row, bool same_columns)
{
    for (size_t i = 0; i < loop->n; i++) {
        const struct row *o = &loop->rows[i];
        bool touches =
            o->base == row.base && o->at < row.at + row.bytes && row.at < o->at + o->bytes;
        bool in_step = !row.written && same_columns && o->at == row.at && o->bytes == row.bytes;
        if (touches && (row.written || o->written) && !in_step)
            return false;
    }
    return true;
}

/* An instruction finds what it reads in the vector of columns at hand, and the one before. An
   adjoint of differences reads a column further for columns beyond a block. */
static bool reads_behind(const struct loop_order *w, const struct instruction *in)
{
    const struct segment *g = &w->segment;
    return in->kind != DO_DIFF && !(in->kind == DO_DIFF_ADJOINT && (g->before || g->after));
}

/* An adjoint of differences reads a column further for the last column but one, too: a later vector
   has that where the last column, which is repeated, fills a vector alone. */
static bool is_late(const struct loop_order *w, const struct instruction *in)
{
    return in->kind == DO_DIFF_ADJOINT && in->loc[3] && w->segment.cols % w->lanes == 1;
}

/* Columns that a later vector computes again have no part in a second sum. */
static bool adds_columns_up(const ad_program *p, const struct segment *g)
{
    bool any = false;
    for (uint32_t k = 0; k < g->n_sinks; k++)
        any = any || p->sinks[g->first_sink + k].kind != DO_ADD_ROWS;
    return any;
}

/* Operand k of an instruction, or its result, allows its segment to join; `rows` takes the rows. */
static bool joins(const struct together *loop, const struct loop_order *w,
                  const struct instruction *in, uint32_t k, struct row rows[MOST_ROWS], size_t *n)
{
    const struct segment *g = &w->segment;
    const struct loc *l = &loop->p->locs[in->loc[k]];
    bool same_columns = l->cs && reads_behind(w, in);
    uint32_t count = k == 0 && is_sum(in) ? loop->p->sinks[in->loc[3]].rows : g->rows;
    for (uint32_t r = 0; l->base != BASE_TILE && r < count; r++) {
        if (*n == MOST_ROWS)
            return false;
        rows[*n] = row_of(loop->p, g, in, k, r);
        if (!is_free(loop, rows[(*n)++], same_columns))
            return false;
    }
    return true;
}

static bool join(struct together *loop, const struct loop_order *w)
{
    const struct segment *g = &w->segment;
    const struct instruction *first = loop->p->instructions + g->first;
    size_t n = loop->n;
    for (const struct instruction *in = first; in < first + g->count; in++) {
        loop->late = loop->late || is_late(w, in);
        for (uint32_t k = 0; k <= in->n_in; k++)
            if (!joins(loop, w, in, k, loop->rows, &n))
                return false;
    }
    if (loop->late && adds_columns_up(loop->p, g))
        return false;
    loop->n = n;
    loop->instructions += (size_t)g->rows * g->count;
    return loop->instructions <= MOST_TOGETHER;
}

uint32_t ad_native_joined(const ad_program *p, size_t n, const struct loop_order walks[])
{
    struct together loop = {.p = p};
    uint32_t k = 0;
    while (k < n && (k ? continues(p, &walks[k - 1], &walks[k]) : is_candidate(p, &walks[0])) &&
           join(&loop, &walks[k]))
        k++;
    return k ? k : 1;
}
