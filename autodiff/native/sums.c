/* Sums of compiled segments. a<number of the sink> is, for a sum over everything, a vector of
   doubles; for a sum over columns, the same for one row, or, where the loop over rows is inside,
   the doubles of all rows in memory; for accumulated rows, a vector of columns, or an array with
   one for every row, stored after the loop over rows. Where such an array is too large, or the loop
   over columns inside, rows accumulate in memory.

   These are local variables of the segment's function; in a segment of several parts, members of a
   structure that the parts share. */
#include "writer.h"

#include <stdlib.h>

bool ad_native_find_scatters(struct writer *w)
{
    free(w->scattered);
    w->scattered = calloc(w->g->n_sinks + 1, 1);
    for (const struct instruction *in = w->first; in < w->end && w->scattered; in++)
        if (in->kind == DO_ADD_ROWS && w->p->locs[in->loc[0]].list)
            w->scattered[in->loc[3] - w->g->first_sink] = 1;
    return w->scattered;
}

/* The target row comes from an index list. */
static bool scatters(const struct writer *w, uint32_t sink)
{
    return w->scattered[sink - w->g->first_sink];
}

static const char *name(const struct writer *w) { return w->crosses ? "a->a" : "a"; }

static bool in_array(const struct writer *w, uint32_t sink)
{
    return w->walk->rows_inside &&
           w->p->sinks[sink].rows * w->walk->lanes * w->p->element <= MAX_ARRAY_BYTES;
}

static size_t row_bytes(const struct writer *w, uint32_t sink)
{
    const struct loc *o = &w->p->locs[w->p->instructions[w->p->sinks[sink].instruction].value];
    return (o->base == BASE_WINDOW ? o->rs : w->p->sinks[sink].cols) * w->p->element;
}

/* Start of the rows that are accumulated into: the chunk's private copy, or the result. */
static void write_rows(const struct writer *w, uint32_t sink)
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

static bool kept_for_columns(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].kind == DO_ADD_ROWS && w->walk->rows_inside &&
           (in_array(w, sink) || !scatters(w, sink));
}

/* A sum over the columns of the outer loop's row. */
static bool of_one_row(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].kind == DO_SUM_COLS && !w->walk->along_rows && !w->walk->rows_inside;
}

static bool in_doubles(const struct writer *w, uint32_t sink)
{
    if (w->p->sinks[sink].kind == DO_SUM_COLS)
        return of_one_row(w, sink);
    return w->p->sinks[sink].kind == DO_SUM || (w->walk->along_rows && !scatters(w, sink));
}

void ad_native_declare_sums(const struct writer *w)
{
    for (uint32_t k = 0; k < w->g->n_sinks; k++) {
        uint32_t sink = w->g->first_sink + k;
        if (in_doubles(w, sink))
            ad_native_say(w, "D@ a%u;\n", sink);
        else if (w->p->sinks[sink].kind == DO_SUM_COLS)
            ad_native_say(w, "double *a%u;\n", sink);
        else if (kept_for_columns(w, sink) && scatters(w, sink))
            ad_native_say(w, "V@ a%u[%u];\n", sink, w->p->sinks[sink].rows);
        else if (kept_for_columns(w, sink))
            ad_native_say(w, "V@ a%u;\n", sink);
    }
}

/* ---- before and after all loops ---- */

static void open_sink(struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (of_one_row(w, sink))
        return;
    if (s->kind == DO_SUM_COLS) {
        ad_native_say(w, "%s%u = ", name(w), sink);
        write_partial(w, s);
        ad_native_say(w, ";\nfor (size_t r = row; r < row_end; r++) %s%u[r] = 0;\n", name(w), sink);
    } else if (in_doubles(w, sink)) {
        ad_native_say(w, "%s%u = (D@){0};\n", name(w), sink);
    } else if (!kept_for_columns(w, sink)) {
        ad_native_say(w, "for (size_t r = 0; r < %u; r++) __builtin_memset(", s->rows);
        write_rows(w, sink);
        ad_native_say(w, " + r * %zu + col * %zu, 0, (col_end - col) * %zu);\n", row_bytes(w, sink),
                      w->p->element, w->p->element);
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
                      off, name(w), sink);
    } else if (s->kind == DO_SUM && whole) {
        ad_native_say(w, "store1(m + %zu, (R)total@(%s%u));\n", off, name(w), sink);
    } else if (s->kind == DO_SUM) {
        ad_native_say(w, "*");
        write_partial(w, s);
        ad_native_say(w, " = total@(%s%u);\n", name(w), sink);
    } else if (s->kind == DO_ADD_ROWS && w->walk->along_rows && !scatters(w, sink)) {
        ad_native_say(w, "store1(");
        write_rows(w, sink);
        ad_native_say(w, ", (R)total@(%s%u));\n", name(w), sink);
    }
}

/* ---- before and after the columns of one row ---- */

static void open_row(struct writer *w, uint32_t sink)
{
    if (of_one_row(w, sink))
        ad_native_say(w, "%s%u = (D@){0};\n", name(w), sink);
}

static void close_row(struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (!of_one_row(w, sink))
        return;
    if (w->g->chunks == 1) {
        ad_native_say(w, "store1(m + %zu + r * sizeof(R), (R)total@(%s%u));\n",
                      w->p->locs[w->p->instructions[s->instruction].loc[0]].off, name(w), sink);
        return;
    }
    write_partial(w, s);
    ad_native_say(w, "[r] = total@(%s%u);\n", name(w), sink);
}

/* ---- before and after the rows of one vector of columns ---- */

/* Its rows are written one by one and stay in registers. */
static bool is_literal(const struct writer *w, uint32_t sink)
{
    return w->walk->literal && scatters(w, sink) && w->p->sinks[sink].rows <= MAX_LITERAL_ROWS;
}

static void open_columns(struct writer *w, uint32_t sink)
{
    if (!kept_for_columns(w, sink))
        return;
    for (uint32_t r = 0; is_literal(w, sink) && r < w->p->sinks[sink].rows; r++)
        ad_native_say(w, "%s%u[%u] = all@(0);\n", name(w), sink, r);
    if (is_literal(w, sink))
        return;
    if (scatters(w, sink))
        ad_native_say(w, "for (size_t r = 0; r < %u; r++) { OPAQUE(r); %s%u[r] = all@(0); }\n",
                      w->p->sinks[sink].rows, name(w), sink);
    else
        ad_native_say(w, "%s%u = all@(0);\n", name(w), sink);
}

static void close_columns(struct writer *w, uint32_t sink)
{
    if (!kept_for_columns(w, sink))
        return;
    const struct instruction *in = &w->p->instructions[w->p->sinks[sink].instruction];
    const struct loc *o = &w->p->locs[in->loc[0]];
    bool array = scatters(w, sink), literal = is_literal(w, sink), held = literal || !array;
    for (uint32_t k = 0; k < (literal ? w->p->sinks[sink].rows : 1); k++) {
        size_t at = o->off + k * row_bytes(w, sink);
        if (held)
            ad_native_remember(w, (struct place){at, o->base, 'a', sink, array ? k : UINT32_MAX});
        if (held && !ad_native_is_read(w, in->value, o->base, at))
            continue;
        if (literal)
            ad_native_say(w, "{ enum { r = %u }; ", k);
        else if (array)
            ad_native_say(w, "for (size_t r = 0; r < %u; r++) ", w->p->sinks[sink].rows);
        ad_native_say(w, "store@(");
        write_rows(w, sink);
        if (array)
            ad_native_say(w, " + r * %zu", row_bytes(w, sink));
        ad_native_say(w, " + c * %zu, %s%u%s);%s\n", w->p->element, name(w), sink,
                      array ? "[r]" : "", literal ? " }" : "");
    }
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

/* ---- accumulating ---- */

/* The value to add, without the lanes that the previous vector already had. */
static void write_new_lanes(const struct writer *w, uint32_t loc)
{
    ad_native_say(w, w->ragged ? "only@(on, " : "(");
    ad_native_name(w, loc);
    ad_native_say(w, ")");
}

static void add_to_sum(const struct writer *w, const struct instruction *in, char sign)
{
    ad_native_say(w, "%s%u %c= wide@(", name(w), in->loc[3], sign);
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, ");\n");
}

static void add_to_row_sums(const struct writer *w, const struct instruction *in)
{
    if (w->walk->along_rows) { /* each lane is a row, and all of it */
        ad_native_say(w, "{ const D@ d = wide@(");
        ad_native_name(w, in->loc[1]);
        ad_native_say(w, "); COPY(%s%u + r, &d, sizeof d); }\n", name(w), in->loc[3]);
        return;
    }
    ad_native_say(w, "%s%u[", name(w), in->loc[3]);
    ad_native_row(w, &(struct loc){0});
    ad_native_say(w, "] += across@(wide@(");
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, "));\n");
}

/* The target row. A sum over rows that shares its memory with scatters has one row. */
static void write_target(const struct writer *w, const struct instruction *in)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    if (o->list)
        ad_native_row(w, o);
    else
        ad_native_say(w, "0");
}

/* Lanes are rows: each has a target row of its own, or all have the same. */
static void scatter_lanes(const struct writer *w, const struct instruction *in, char sign)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    if (!o->list) {
        ad_native_say(w, "{ char *to = ");
        write_rows(w, in->loc[3]);
        ad_native_say(w, "; store1(to, load1(to) %c (R)across@(wide@(", sign);
        write_new_lanes(w, in->loc[1]);
        ad_native_say(w, "))); }\n");
        return;
    }
    ad_native_say(w, "scatter@(");
    write_rows(w, in->loc[3]);
    ad_native_say(w, ", l + %u + r, %zu, %c", o->list - 1, row_bytes(w, in->loc[3]), sign);
    ad_native_name(w, in->loc[1]);
    ad_native_say(w, ", %s);\n", w->ragged ? "next - r" : "0");
}

static void add_in_memory(const struct writer *w, const struct instruction *in, char sign)
{
    ad_native_say(w, "{ char *to = ");
    write_rows(w, in->loc[3]);
    ad_native_say(w, " + ");
    write_target(w, in);
    ad_native_say(w, " * %zu + c * %zu; store@(to, load@(to) %c ", row_bytes(w, in->loc[3]),
                  w->p->element, sign);
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, "); }\n");
}

static void add_in_registers(const struct writer *w, const struct instruction *in, char sign,
                             bool array)
{
    ad_native_say(w, "%s%u", name(w), in->loc[3]);
    if (array) {
        ad_native_say(w, "[");
        write_target(w, in);
        ad_native_say(w, "]");
    }
    ad_native_say(w, " %c= ", sign);
    ad_native_name(w, in->loc[1]);
    ad_native_say(w, ";\n");
}

void ad_native_add(const struct writer *w, const struct instruction *in)
{
    uint32_t sink = in->loc[3];
    char sign = w->p->values[in->value].flags & VALUE_NEGATED ? '-' : '+';
    bool scatter = in->kind == DO_ADD_ROWS && scatters(w, sink);
    if (in_doubles(w, sink))
        add_to_sum(w, in, sign);
    else if (in->kind == DO_SUM_COLS)
        add_to_row_sums(w, in);
    else if (w->walk->along_rows)
        scatter_lanes(w, in, sign);
    else if (!kept_for_columns(w, sink))
        add_in_memory(w, in, sign);
    else
        add_in_registers(w, in, sign, scatter);
}
