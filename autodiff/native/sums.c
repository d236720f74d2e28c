/* Sums of compiled segments. a<number of the sink> is, for a sum over everything, a vector of
   doubles; for a sum over columns, the doubles of all rows in memory; for added rows, a vector of
   columns, or an array with one of every row, that is stored when the rows are through. Where such
   an array is too large, rows are added in memory. */
#include "writer.h"

/* Rows are added into rows by number. */
static bool scatters(const struct writer *w, uint32_t sink)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        if (in->kind == DO_ADD_ROWS && in->loc[3] == sink && w->p->locs[in->loc[0]].list)
            return true;
    return false;
}

static bool in_array(const struct writer *w, uint32_t sink)
{
    return w->walk->rows_inside &&
           w->p->sinks[sink].rows * w->walk->lanes * w->p->element <= MAX_ARRAY_BYTES;
}

static size_t row_bytes(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].cols * w->p->element;
}

/* The first byte of the rows that are added into: the chunk's own copy, or the result. */
static void write_rows(const struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (w->g->by_rows && w->g->chunks > 1)
        ad_native_say(w, "m + %zu + chunk * %zu", s->partial, s->stride);
    else
        ad_native_say(w, "m + %zu", w->p->locs[w->p->instructions[s->instruction].loc[0]].off);
}

static void write_partial(const struct writer *w, const struct sink *s)
{
    bool shared = s->kind == DO_SUM_COLS && w->g->by_rows; /* chunks have rows of their own */
    ad_native_say(w, "(double *)(m + %zu + %s * %zu)", s->partial, shared ? "0" : "chunk",
                  s->stride);
}

/* ---- before and after all loops ---- */

static void open_sink(const struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (s->kind == DO_SUM_COLS) {
        ad_native_say(w, "double *const a%u = ", sink);
        write_partial(w, s);
        ad_native_say(w, ";\nfor (size_t r = row; r < row_end; r++) a%u[r] = 0;\n", sink);
    } else if (s->kind == DO_SUM || (w->walk->along_rows && !scatters(w, sink))) {
        ad_native_say(w, "D@ a%u = {0};\n", sink);
    } else if (!in_array(w, sink) && scatters(w, sink)) {
        ad_native_say(w, "for (size_t r = 0; r < %u; r++) __builtin_memset(", s->rows);
        write_rows(w, sink);
        ad_native_say(w, " + r * %zu + col * %zu, 0, (col_end - col) * %zu);\n", row_bytes(w, sink),
                      w->p->element, w->p->element);
    }
}

/* Chunks leave their sums for the executor to collect; a segment that is not split, the result. */
static void close_sink(const struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    size_t off = w->p->locs[w->p->instructions[s->instruction].loc[0]].off;
    bool whole = w->g->chunks == 1;
    if (s->kind == DO_SUM_COLS && whole) {
        ad_native_say(w,
                      "for (size_t r = row; r < row_end; r++)"
                      " store1(m + %zu + r * sizeof(R), (R)a%u[r]);\n",
                      off, sink);
    } else if (s->kind == DO_SUM && whole) {
        ad_native_say(w, "store1(m + %zu, (R)total@(a%u));\n", off, sink);
    } else if (s->kind == DO_SUM) {
        ad_native_say(w, "*");
        write_partial(w, s);
        ad_native_say(w, " = total@(a%u);\n", sink);
    } else if (s->kind == DO_ADD_ROWS && w->walk->along_rows && !scatters(w, sink)) {
        ad_native_say(w, "store1(");
        write_rows(w, sink);
        ad_native_say(w, ", (R)total@(a%u));\n", sink);
    }
}

void ad_native_open_sinks(const struct writer *w)
{
    for (uint32_t k = 0; k < w->g->n_sinks; k++)
        open_sink(w, w->g->first_sink + k);
}

void ad_native_close_sinks(const struct writer *w)
{
    for (uint32_t k = 0; k < w->g->n_sinks; k++)
        close_sink(w, w->g->first_sink + k);
}

/* ---- before and after the rows of one vector of columns ---- */

static bool kept_for_columns(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].kind == DO_ADD_ROWS && (in_array(w, sink) || !scatters(w, sink));
}

void ad_native_open_columns(const struct writer *w)
{
    for (uint32_t k = 0; k < w->g->n_sinks; k++) {
        uint32_t sink = w->g->first_sink + k, rows = w->p->sinks[sink].rows;
        if (!kept_for_columns(w, sink))
            continue;
        if (scatters(w, sink))
            ad_native_say(
                w,
                "V@ a%u[%u];\nfor (size_t r = 0; r < %u; r++) { OPAQUE(r); a%u[r] = all@(0); }\n",
                sink, rows, rows, sink);
        else
            ad_native_say(w, "V@ a%u = all@(0);\n", sink);
    }
}

void ad_native_close_columns(const struct writer *w)
{
    for (uint32_t k = 0; k < w->g->n_sinks; k++) {
        uint32_t sink = w->g->first_sink + k;
        if (!kept_for_columns(w, sink))
            continue;
        bool array = scatters(w, sink);
        if (array)
            ad_native_say(w, "for (size_t r = 0; r < %u; r++) ", w->p->sinks[sink].rows);
        ad_native_say(w, "store@(");
        write_rows(w, sink);
        if (array)
            ad_native_say(w, " + r * %zu", row_bytes(w, sink));
        ad_native_say(w, " + c * %zu, a%u%s);\n", w->p->element, sink, array ? "[r]" : "");
    }
}

/* ---- adding ---- */

/* The value that is added: without the lanes that the vector before had. */
static void write_new_lanes(const struct writer *w, uint32_t loc)
{
    ad_native_say(w, w->ragged ? "only@(on, " : "(");
    ad_native_name(w, loc);
    ad_native_say(w, ")");
}

static void add_to_sum(const struct writer *w, const struct instruction *in, char sign)
{
    ad_native_say(w, "a%u %c= wide@(", in->loc[3], sign);
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, ");\n");
}

static void add_to_row_sums(const struct writer *w, const struct instruction *in)
{
    if (w->walk->along_rows) { /* each lane is a row, and all of it */
        ad_native_say(w, "{ const D@ d = wide@(");
        ad_native_name(w, in->loc[1]);
        ad_native_say(w, "); COPY(a%u + r, &d, sizeof d); }\n", in->loc[3]);
        return;
    }
    ad_native_say(w, "a%u[", in->loc[3]);
    ad_native_row(w, &(struct loc){0});
    ad_native_say(w, "] += total@(wide@(");
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, "));\n");
}

/* Lanes are rows, each of which goes to a row of its own. */
static void scatter_lanes(const struct writer *w, const struct instruction *in, char sign)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
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
    ad_native_row(w, &w->p->locs[in->loc[0]]);
    ad_native_say(w, " * %zu + c * %zu; store@(to, load@(to) %c ", row_bytes(w, in->loc[3]),
                  w->p->element, sign);
    write_new_lanes(w, in->loc[1]);
    ad_native_say(w, "); }\n");
}

static void add_in_registers(const struct writer *w, const struct instruction *in, char sign,
                             bool array)
{
    ad_native_say(w, "a%u", in->loc[3]);
    if (array) {
        ad_native_say(w, "[");
        ad_native_row(w, &w->p->locs[in->loc[0]]);
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
    if (in->kind == DO_SUM_COLS)
        add_to_row_sums(w, in);
    else if (in->kind == DO_SUM || (w->walk->along_rows && !scatter))
        add_to_sum(w, in, sign);
    else if (w->walk->along_rows)
        scatter_lanes(w, in, sign);
    else if (scatter && !in_array(w, sink))
        add_in_memory(w, in, sign);
    else
        add_in_registers(w, in, sign, scatter);
}
