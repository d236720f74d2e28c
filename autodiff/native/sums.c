/* Sums of compiled segments. a<number of the sink> is, for a sum over everything, a vector of
   doubles; for a sum over columns, the same for one row, or, where the loop over rows is inside,
   the doubles of all rows in memory; for accumulated rows, a vector of columns, or an array with
   one for every row, stored after the loop over rows. Where such an array is too large, or the loop
   over columns inside, rows accumulate in memory.

   These are local variables of the segment's function; in a segment of several parts, members of a
   structure that the parts share. */
#include "sums.h"

#include <stdlib.h>

bool ad_native_find_targets(struct writer *w)
{
    free(w->targets);
    w->targets = calloc(w->g->n_sinks + 1, sizeof *w->targets);
    for (const struct instruction *in = w->first; in < w->end && w->targets; in++)
        if (in->kind == DO_ADD_ROWS && w->p->locs[in->loc[0]].list)
            w->targets[in->loc[3] - w->g->first_sink].listed = true;
    return w->targets;
}

bool ad_native_scatters(const struct writer *w, uint32_t sink)
{
    return w->targets[sink - w->g->first_sink].listed;
}

const char *ad_native_sum(const struct writer *w) { return w->crosses ? "a->a" : "a"; }

static bool in_array(const struct writer *w, uint32_t sink)
{
    return w->walk->rows_inside &&
           w->p->sinks[sink].rows * w->walk->lanes * w->p->element <= MAX_ARRAY_BYTES;
}

size_t ad_native_row_bytes(const struct writer *w, uint32_t sink)
{
    const struct loc *o = &w->p->locs[w->p->instructions[w->p->sinks[sink].instruction].value];
    return (o->base == BASE_WINDOW ? o->rs : w->p->sinks[sink].cols) * w->p->element;
}

void ad_native_rows(const struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (w->g->by_rows && w->g->chunks > 1)
        ad_native_say(w, "m + %zu + chunk * %zu", s->partial, s->stride);
    else
        ad_native_start(w, &w->p->locs[w->p->instructions[s->instruction].loc[0]]);
}

static void write_partial(const struct writer *w, const struct sink *s)
{
    bool shared = s->kind == DO_SUM_COLS && w->g->by_rows; /* chunks have rows of their own */
    ad_native_say(w, "((double *)(m + %zu + %s * %zu))", s->partial, shared ? "0" : "chunk",
                  s->stride);
}

bool ad_native_kept_for_columns(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].kind == DO_ADD_ROWS && w->walk->rows_inside &&
           (in_array(w, sink) || !ad_native_scatters(w, sink));
}

/* A sum over the columns of the outer loop's row. */
static bool of_one_row(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].kind == DO_SUM_COLS && !w->walk->along_rows && !w->walk->rows_inside;
}

bool ad_native_in_doubles(const struct writer *w, uint32_t sink)
{
    if (w->p->sinks[sink].kind == DO_SUM_COLS)
        return of_one_row(w, sink);
    return w->p->sinks[sink].kind == DO_SUM ||
           (w->walk->along_rows && !ad_native_scatters(w, sink));
}

bool ad_native_has_runs(const struct writer *w, const struct instruction *in)
{
    enum { SHORTEST = 4 };
    const struct loc *o = &w->p->locs[in->loc[0]];
    uint32_t changes = 1;
    if (in->kind != DO_ADD_ROWS || !o->list || w->crosses || w->walk->literal ||
        !ad_native_kept_for_columns(w, in->loc[3]))
        return false;
    for (const uint32_t *l = w->p->lists + o->list, *end = l + w->g->rows - 1; l < end; l++)
        changes += l[0] != l[-1];
    return changes * SHORTEST <= w->g->rows;
}

/* The first of them from `in` on that adds to a sink, or NULL. */
static const struct instruction *next_run(const struct writer *w, uint32_t sink,
                                          const struct instruction *in)
{
    while (in < w->end && !(is_sum(in) && in->loc[3] == sink && ad_native_has_runs(w, in)))
        in++;
    return in < w->end ? in : NULL;
}

void ad_native_declare_sums(const struct writer *w)
{
    for (uint32_t k = 0; k < w->g->n_sinks; k++) {
        uint32_t sink = w->g->first_sink + k;
        if (ad_native_in_doubles(w, sink))
            ad_native_say(w, "D@ a%u;\n", sink);
        else if (w->p->sinks[sink].kind == DO_SUM_COLS)
            ad_native_say(w, "double *a%u;\n", sink);
        else if (ad_native_kept_for_columns(w, sink) && ad_native_scatters(w, sink))
            ad_native_say(w, "V@ a%u[%u];\n", sink, w->p->sinks[sink].rows);
        else if (ad_native_kept_for_columns(w, sink))
            ad_native_say(w, "V@ a%u;\n", sink);
        for (const struct instruction *in = w->first; (in = next_run(w, sink, in)); in++)
            ad_native_say(w, "V@ f%u; size_t i%u;\n", run_of(w, in), run_of(w, in));
    }
}

/* ---- before and after all loops ---- */

static void open_sink(struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (of_one_row(w, sink))
        return;
    if (s->kind == DO_SUM_COLS) {
        ad_native_say(w, "%s%u = ", ad_native_sum(w), sink);
        write_partial(w, s);
        ad_native_say(w, ";\nfor (size_t r = row; r < row_end; r++) %s%u[r] = 0;\n",
                      ad_native_sum(w), sink);
    } else if (ad_native_in_doubles(w, sink)) {
        ad_native_say(w, "%s%u = (D@){0};\n", ad_native_sum(w), sink);
    } else if (!ad_native_kept_for_columns(w, sink)) {
        ad_native_say(w, "for (size_t r = 0; r < %u; r++) __builtin_memset(", s->rows);
        ad_native_rows(w, sink);
        ad_native_say(w, " + r * %zu + col * %zu, 0, (col_end - col) * %zu);\n",
                      ad_native_row_bytes(w, sink), w->p->element, w->p->element);
    }
}

/* Chunks leave their sums to the executor; an unsplit segment stores the result. */
static void close_sink(struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    size_t off = w->p->locs[w->p->instructions[s->instruction].loc[0]].off;
    bool whole = w->g->chunks == 1;
    if (of_one_row(w, sink))
        return;
    if (s->kind == DO_SUM_COLS && whole) {
        ad_native_say(w,
                      "for (size_t r = row; r < row_end; r++)"
                      " store1(m + %zu + r * sizeof(R), (R)%s%u[r]);\n",
                      off, ad_native_sum(w), sink);
    } else if (s->kind == DO_SUM && whole) {
        ad_native_say(w, "store1(m + %zu, (R)total@(%s%u));\n", off, ad_native_sum(w), sink);
    } else if (s->kind == DO_SUM) {
        ad_native_say(w, "*");
        write_partial(w, s);
        ad_native_say(w, " = total@(%s%u);\n", ad_native_sum(w), sink);
    } else if (s->kind == DO_ADD_ROWS && w->walk->along_rows && !ad_native_scatters(w, sink)) {
        ad_native_say(w, "store1(");
        ad_native_rows(w, sink);
        ad_native_say(w, ", (R)total@(%s%u));\n", ad_native_sum(w), sink);
    }
}

/* ---- before and after the columns of one row ---- */

static void open_row(struct writer *w, uint32_t sink)
{
    if (of_one_row(w, sink))
        ad_native_say(w, "%s%u = (D@){0};\n", ad_native_sum(w), sink);
}

static void close_row(struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (!of_one_row(w, sink))
        return;
    if (w->g->chunks == 1) {
        ad_native_say(w, "store1(m + %zu + r * sizeof(R), (R)total@(%s%u));\n",
                      w->p->locs[w->p->instructions[s->instruction].loc[0]].off, ad_native_sum(w),
                      sink);
        return;
    }
    write_partial(w, s);
    ad_native_say(w, "[r] = total@(%s%u);\n", ad_native_sum(w), sink);
}

/* ---- before and after the rows of one vector of columns ---- */

bool ad_native_sum_is_literal(const struct writer *w, uint32_t sink)
{
    return w->walk->literal && ad_native_kept_for_columns(w, sink) &&
           (!ad_native_scatters(w, sink) || w->p->sinks[sink].rows <= MAX_LITERAL_ROWS);
}

static void open_columns(struct writer *w, uint32_t sink)
{
    if (!ad_native_kept_for_columns(w, sink) || ad_native_sum_is_literal(w, sink))
        return;
    if (ad_native_scatters(w, sink))
        ad_native_say(w, "for (size_t r = 0; r < %u; r++) { OPAQUE(r); %s%u[r] = all@(0); }\n",
                      w->p->sinks[sink].rows, ad_native_sum(w), sink);
    else
        ad_native_say(w, "%s%u = all@(0);\n", ad_native_sum(w), sink);
    for (const struct instruction *in = w->first; (in = next_run(w, sink, in)); in++)
        ad_native_say(w, "f%u = all@(0); i%u = %u;\n", run_of(w, in), run_of(w, in),
                      w->p->lists[w->p->locs[in->loc[0]].list - 1]);
}

void ad_native_name_sum(const struct writer *w, uint32_t sink, uint32_t row)
{
    ad_native_say(w, ad_native_scatters(w, sink) ? "%s%u[%u]" : "%s%u", ad_native_sum(w), sink,
                  row);
}

/* Rows in registers: those that nothing was added to are zero. */
static void close_literal(struct writer *w, uint32_t sink, const struct instruction *in)
{
    const struct target *target = &w->targets[sink - w->g->first_sink];
    const struct loc *o = &w->p->locs[in->loc[0]];
    const bool array = ad_native_scatters(w, sink);
    for (uint32_t r = 0; r < (array ? w->p->sinks[sink].rows : 1); r++) {
        size_t at = o->off + r * ad_native_row_bytes(w, sink);
        if (~target->begun >> r & 1) {
            ad_native_name_sum(w, sink, r);
            ad_native_say(w, " = all@(0);\n");
        } else if (target->negated >> r & 1) {
            ad_native_name_sum(w, sink, r);
            ad_native_say(w, " = -");
            ad_native_name_sum(w, sink, r);
            ad_native_say(w, ";\n");
        }
        ad_native_remember(w, (struct place){at, o->base, 'a', sink, array ? r : UINT32_MAX});
        if (!ad_native_is_read(w, in->value, o->base, at))
            continue;
        ad_native_say(w, "store@(");
        ad_native_rows(w, sink);
        ad_native_say(w, " + %zu + c * %zu, ", r * ad_native_row_bytes(w, sink), w->p->element);
        ad_native_name_sum(w, sink, r);
        ad_native_say(w, ");\n");
    }
}

static void close_columns(struct writer *w, uint32_t sink)
{
    const struct instruction *in = &w->p->instructions[w->p->sinks[sink].instruction];
    const bool array = ad_native_scatters(w, sink);
    if (!ad_native_kept_for_columns(w, sink))
        return;
    if (ad_native_sum_is_literal(w, sink)) {
        close_literal(w, sink, in);
        return;
    }
    for (const struct instruction *run = w->first; (run = next_run(w, sink, run)); run++)
        ad_native_say(w, "a%u[i%u] += f%u;\n", sink, run_of(w, run), run_of(w, run));
    if (array)
        ad_native_say(w, "for (size_t r = 0; r < %u; r++) ", w->p->sinks[sink].rows);
    ad_native_say(w, "store@(");
    ad_native_rows(w, sink);
    if (array)
        ad_native_say(w, " + r * %zu", ad_native_row_bytes(w, sink));
    ad_native_say(w, " + c * %zu, %s%u%s);\n", w->p->element, ad_native_sum(w), sink,
                  array ? "[r]" : "");
}

/* ---- all sums of a segment ---- */

static const struct {
    void (*write)(struct writer *w, uint32_t sink);
    const char *name, *row_column;
} moments[] = {
    [OPEN_SEGMENT] = {open_sink, "open", "0, 0"},
    [CLOSE_SEGMENT] = {close_sink, "close", "0, 0"},
    [OPEN_ROW] = {open_row, "open_row", "r, 0"},
    [CLOSE_ROW] = {close_row, "close_row", "r, 0"},
    [OPEN_COLUMNS] = {open_columns, "open_columns", "0, c"},
    [CLOSE_COLUMNS] = {close_columns, "close_columns", "0, c"},
};

enum { MOST_SUMS = 64 }; /* of a function, where the segment has parts */

static uint32_t n_blocks(const struct writer *w) { return (w->g->n_sinks - 1) / MOST_SUMS + 1; }

static void write_block(struct writer *w, enum moment moment, uint32_t first, uint32_t count)
{
    uint32_t left = w->g->n_sinks - first;
    for (uint32_t k = 0; k < count && k < left; k++)
        moments[moment].write(w, w->g->first_sink + first + k);
}

static bool happens(const struct writer *w, enum moment moment)
{
    return moment <= CLOSE_SEGMENT ||
           (!w->walk->along_rows && w->walk->rows_inside == (moment >= OPEN_COLUMNS));
}

void ad_native_sums_parts(struct writer *w)
{
    for (int moment = 0; w->g->n_sinks && moment < (int)LENGTH(moments); moment++)
        for (uint32_t b = 0; happens(w, (enum moment)moment) && b < n_blocks(w); b++) {
            ad_native_say(
                w,
                "static __attribute__((noinline)) void s%u_%s%u(char *m, char *win, size_t chunk,"
                " size_t row, size_t row_end, size_t col, size_t col_end, size_t r,"
                " size_t c, struct parts%u *a)\n{\n",
                w->walk->number, moments[moment].name, b, w->walk->number);
            write_block(w, (enum moment)moment, b * MOST_SUMS, MOST_SUMS);
            ad_native_say(w, "}\n");
        }
}

void ad_native_sums(struct writer *w, enum moment moment)
{
    if (!w->crosses)
        write_block(w, moment, 0, w->g->n_sinks);
    for (uint32_t b = 0; w->crosses && w->g->n_sinks && b < n_blocks(w); b++)
        ad_native_say(w, "s%u_%s%u(m, win, chunk, row, row_end, col, col_end, %s, a);\n",
                      w->walk->number, moments[moment].name, b, moments[moment].row_column);
}
