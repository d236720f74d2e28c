/* One segment as a C function: what the interpreter does tile by tile, kernel by kernel, in one
   loop over vectors, with every value of a tile in a variable.

       rows outside      for each row, for each vector of columns
       rows inside       for each vector of columns, for each row: where gathers and sums bring rows
                         together. What they take from and add into is copied to and from an array
                         that holds one vector of every row, so that a pair law runs in the cache
       along rows        for each vector of rows, of a single column

   The last vector of a loop is moved back to end with the data: it computes lanes again, and `on`
   keeps those from being summed twice. What does not change in a loop is loaded before it. */
#include "native.h"

#include <stdlib.h>

enum { MAX_ARRAYS = 16, MAX_ARRAY_BYTES = 64 << 10 };

/* Where a variable is declared. */
enum scope { FUNCTION, OUTER, INNER };

/* Rows of a value in memory that are read by number. */
struct array {
    size_t off;
    uint32_t stride, rows, uses;
};

struct writer {
    FILE *out;
    const ad_program *p;
    const struct walk *w;
    const struct instruction *first, *end;
    uint8_t *known; /* per location: has a variable v<location> */
    struct array arrays[MAX_ARRAYS];
    size_t n_arrays;
    bool ragged;   /* the last vector is moved back */
    bool stencils; /* `at` numbers the columns */
};

static const char *along(const struct writer *w) { return w->w->along_rows ? "row" : "col"; }

static uint32_t row_bytes(const struct writer *w, const struct loc *l)
{
    return l->rs * (uint32_t)w->p->element;
}

/* ---- where things lie ---- */

static void write_row(const struct writer *w, const struct loc *l)
{
    if (l->list)
        fprintf(w->out, "l[%u + r]", l->list - 1);
    else
        fputc('r', w->out);
}

/* Address of the element of location l in row r, column c. */
static void write_address(const struct writer *w, const struct loc *l)
{
    fprintf(w->out, "m + %zu", l->off);
    if (l->rs) {
        fputs(" + ", w->out);
        write_row(w, l);
        fprintf(w->out, " * (size_t)%u", row_bytes(w, l));
    }
    if (l->cs && !w->w->along_rows)
        fprintf(w->out, " + c * %zu", w->p->element);
}

static enum scope scope_of(const struct writer *w, const struct loc *l)
{
    bool same_row = !l->rs && !l->list;
    if (w->w->along_rows)
        return same_row ? FUNCTION : INNER;
    if (same_row && !l->cs)
        return FUNCTION;
    return (w->w->rows_inside ? same_row : !l->cs) ? OUTER : INNER;
}

static const struct array *array_of(const struct writer *w, const struct loc *l)
{
    for (size_t k = 0; l->list && l->cs && k < w->n_arrays; k++)
        if (w->arrays[k].off == l->off && w->arrays[k].stride == l->rs)
            return w->arrays[k].rows ? &w->arrays[k] : NULL;
    return NULL;
}

/* ---- operands ---- */

static void write_load(const struct writer *w, const struct loc *l)
{
    const struct array *array = array_of(w, l);
    uint32_t lanes = w->w->lanes;
    if (array) {
        fprintf(w->out, "q%td[", array - w->arrays);
        write_row(w, l);
        fputc(']', w->out);
    } else if (w->w->along_rows && l->list) {
        fprintf(w->out,
                lanes > 1 ? "rows%u(m + %zu, l + %u + r, %u)"
                          : "load%u(m + %zu + l[%u + r] * (size_t)%u)",
                lanes, l->off, l->list - 1, row_bytes(w, l));
    } else if (w->w->along_rows && l->rs > 1 && lanes > 1) {
        fprintf(w->out, "strided%u(", lanes);
        write_address(w, l);
        fprintf(w->out, ", %u)", row_bytes(w, l));
    } else {
        bool number = w->w->along_rows ? !l->rs : !l->cs;
        fprintf(w->out, "%s%u(", number ? "splat" : "load", lanes);
        write_address(w, l);
        fputc(')', w->out);
    }
}

static void declare(struct writer *w, uint32_t loc, enum scope scope)
{
    const struct loc *l = &w->p->locs[loc];
    if (w->known[loc] || l->base == BASE_TILE || scope_of(w, l) != scope)
        return;
    w->known[loc] = 1;
    fprintf(w->out, "const V%u v%u = ", w->w->lanes, loc);
    write_load(w, l);
    fputs(";\n", w->out);
}

static bool reads_lanes(const struct instruction *in)
{
    return in->kind != DO_DIFF && in->kind != DO_DIFF_ADJOINT;
}

static void declare_operands(struct writer *w, const struct instruction *in, enum scope scope)
{
    for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++)
        declare(w, in->loc[k], scope);
}

static void declare_all(struct writer *w, enum scope scope)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        declare_operands(w, in, scope);
}

/* ---- instructions ---- */

static bool is_spread(const struct instruction *in)
{
    return in->kind == DO_ELEMENTWISE && in->loc[0] != in->value;
}

/* The exponent of powi, where it is a constant. */
static bool whole_exponent(const struct writer *w, const struct loc *l, int *exponent)
{
    if (l->base == BASE_TILE || l->rs || l->cs || l->list ||
        !(w->p->values[l->root].flags & VALUE_CONSTANT))
        return false;
    double b;
    w->p->kernels->to_double(1, &b, w->p->memory + l->off);
    *exponent = (int)b;
    return true;
}

static void write_elementwise(const struct writer *w, const struct instruction *in)
{
    enum ad_op op = is_spread(in) ? AD_OP_copy : (enum ad_op)w->p->values[in->value].op;
    int exponent;
    if (op == AD_OP_powi && whole_exponent(w, &w->p->locs[in->loc[2]], &exponent)) {
        fprintf(w->out, "whole_%u(v%u, %d)", w->w->lanes, in->loc[1], exponent);
        return;
    }
    fprintf(w->out, "op_%s_%u(", ad_op_name(op), w->w->lanes);
    for (uint32_t k = 1; k <= in->n_in; k++)
        fprintf(w->out, "%sv%u", k > 1 ? ", " : "", in->loc[k]);
    fputc(')', w->out);
}

/* scale*(x[i+1] - x[i]); the last column, repeated, is the one before. */
static void write_diff(const struct writer *w, const struct instruction *in)
{
    const struct loc *x = &w->p->locs[in->loc[1]];
    uint32_t lanes = w->w->lanes;
    fprintf(w->out, "({ const char *x = ");
    write_address(w, x);
    fprintf(w->out, "; V%u here = load%u(x), next = load%u(x + sizeof(R)); ", lanes, lanes, lanes);
    if (in->loc[3])
        fprintf(w->out,
                "const V%u before = load%u(x - sizeof(R)); "
                "next = pick%u(at == %u, here, next); here = pick%u(at == %u, before, here); ",
                lanes, lanes, lanes, w->w->segment.cols - 1, lanes, w->w->segment.cols - 1);
    fprintf(w->out, "(R)%a * (next - here); })", w->p->numbers[in->loc[2]]);
}

/* scale*(u[i-1] - u[i]), where u is zero outside and a repeated column counts to the one before. */
static void write_diff_adjoint(const struct writer *w, const struct instruction *in)
{
    const struct loc *u = &w->p->locs[in->loc[1]];
    uint32_t lanes = w->w->lanes, last = w->w->segment.cols - 1;
    fprintf(w->out, "({ const char *u = ");
    write_address(w, u);
    fprintf(w->out,
            "; V%u before = pick%u(at == 0, all%u(0), load%u(u - sizeof(R))), "
            "here = pick%u(at == %u, all%u(0), load%u(u)); ",
            lanes, lanes, lanes, lanes, lanes, last, lanes, lanes);
    if (in->loc[3])
        fprintf(w->out,
                "const V%u more = splat%u(u + (%uu - c) * sizeof(R)); "
                "before += pick%u(at == %u, more, all%u(0)); "
                "here += pick%u(at == %u, more, all%u(0)); ",
                lanes, lanes, last, lanes, last, lanes, lanes, last - 1, lanes);
    fprintf(w->out, "(R)%a * (before - here); })", w->p->numbers[in->loc[2]]);
}

/* ---- sums ---- */

static bool copies_rows(const struct writer *w)
{
    return w->w->segment.by_rows && w->w->segment.chunks > 1;
}

/* Rows are added into rows by number, of this sink. */
static bool scatters(const struct writer *w, uint32_t sink)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        if (in->kind == DO_ADD_ROWS && in->loc[3] == sink && w->p->locs[in->loc[0]].list)
            return true;
    return false;
}

/* One vector of every row is kept while the rows are walked. */
static bool in_array(const struct writer *w, uint32_t sink)
{
    return w->w->rows_inside &&
           w->p->sinks[sink].rows * w->w->lanes * w->p->element <= MAX_ARRAY_BYTES;
}

/* The first byte of what a sink of added rows adds into. */
static void write_sink_start(const struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    if (copies_rows(w))
        fprintf(w->out, "m + %zu + chunk * %zu", s->partial, s->stride);
    else
        fprintf(w->out, "m + %zu", w->p->locs[w->p->instructions[s->instruction].loc[0]].off);
}

static size_t sink_row_bytes(const struct writer *w, uint32_t sink)
{
    return w->p->sinks[sink].cols * w->p->element;
}

static void write_partial(const struct writer *w, uint32_t sink)
{
    const struct sink *s = &w->p->sinks[sink];
    bool one = s->kind == DO_SUM_COLS && w->w->segment.by_rows;
    fprintf(w->out, "(double *)(m + %zu + %s * %zu)", s->partial, one ? "0" : "chunk", s->stride);
}

/* Sums start at zero: those over everything at the start of the function, ... */
static void open_sinks(const struct writer *w)
{
    for (uint32_t k = 0; k < w->w->segment.n_sinks; k++) {
        uint32_t sink = w->w->segment.first_sink + k;
        const struct sink *s = &w->p->sinks[sink];
        if (s->kind == DO_SUM_COLS) {
            fprintf(w->out, "double *const a%u = ", sink);
            write_partial(w, sink);
            fprintf(w->out, ";\nfor (size_t r = row; r < row_end; r++) a%u[r] = 0;\n", sink);
        } else if (s->kind == DO_SUM || (w->w->along_rows && !scatters(w, sink))) {
            fprintf(w->out, "D%u a%u = {0};\n", w->w->lanes, sink);
        } else if (!in_array(w, sink) && scatters(w, sink)) {
            fprintf(w->out, "for (size_t r = 0; r < %u; r++) __builtin_memset(", s->rows);
            write_sink_start(w, sink);
            fprintf(w->out, " + r * %zu + col * %zu, 0, (col_end - col) * %zu);\n",
                    sink_row_bytes(w, sink), w->p->element, w->p->element);
        }
    }
}

/* ... rows summed for one vector of columns where its rows begin. */
static void open_column_sinks(const struct writer *w)
{
    for (uint32_t k = 0; k < w->w->segment.n_sinks; k++) {
        uint32_t sink = w->w->segment.first_sink + k;
        const struct sink *s = &w->p->sinks[sink];
        if (s->kind != DO_ADD_ROWS || !(in_array(w, sink) || !scatters(w, sink)))
            continue;
        if (scatters(w, sink))
            fprintf(w->out, "V%u a%u[%u] = {{0}};\n", w->w->lanes, sink, s->rows);
        else
            fprintf(w->out, "V%u a%u = all%u(0);\n", w->w->lanes, sink, w->w->lanes);
    }
}

static void close_column_sinks(const struct writer *w)
{
    for (uint32_t k = 0; k < w->w->segment.n_sinks; k++) {
        uint32_t sink = w->w->segment.first_sink + k;
        const struct sink *s = &w->p->sinks[sink];
        if (s->kind != DO_ADD_ROWS || !(in_array(w, sink) || !scatters(w, sink)))
            continue;
        if (scatters(w, sink))
            fprintf(w->out, "for (size_t r = 0; r < %u; r++) ", s->rows);
        fprintf(w->out, "store%u(", w->w->lanes);
        write_sink_start(w, sink);
        fprintf(w->out,
                scatters(w, sink) ? " + r * %zu + c * %zu, a%u[r]);\n"
                                  : " + 0 * %zu + c * %zu, a%u);\n",
                sink_row_bytes(w, sink), w->p->element, sink);
    }
}

static void close_sinks(const struct writer *w)
{
    for (uint32_t k = 0; k < w->w->segment.n_sinks; k++) {
        uint32_t sink = w->w->segment.first_sink + k;
        const struct sink *s = &w->p->sinks[sink];
        size_t off = w->p->locs[w->p->instructions[s->instruction].loc[0]].off;
        bool whole = w->w->segment.chunks == 1;
        if (s->kind == DO_SUM_COLS && whole)
            fprintf(w->out,
                    "for (size_t r = row; r < row_end; r++)"
                    " store1(m + %zu + r * sizeof(R), (R)a%u[r]);\n",
                    off, sink);
        else if (s->kind == DO_SUM && whole)
            fprintf(w->out, "store1(m + %zu, (R)total%u(a%u));\n", off, w->w->lanes, sink);
        else if (s->kind == DO_SUM) {
            fputc('*', w->out);
            write_partial(w, sink);
            fprintf(w->out, " = total%u(a%u);\n", w->w->lanes, sink);
        } else if (s->kind == DO_ADD_ROWS && w->w->along_rows && !scatters(w, sink)) {
            fputs("store1(", w->out);
            write_sink_start(w, sink);
            fprintf(w->out, ", (R)total%u(a%u));\n", w->w->lanes, sink);
        }
    }
}

/* A value as sums want it: without the lanes of the vector before. */
static void write_new_lanes(const struct writer *w, uint32_t loc)
{
    if (w->ragged)
        fprintf(w->out, "only%u(on, v%u)", w->w->lanes, loc);
    else
        fprintf(w->out, "v%u", loc);
}

static void write_sum(const struct writer *w, const struct instruction *in)
{
    uint32_t lanes = w->w->lanes;
    if (in->kind == DO_SUM_COLS && w->w->along_rows) {
        fprintf(w->out, "{ const D%u d = wide%u(v%u); COPY(a%u + r, &d, sizeof d); }\n", lanes,
                lanes, in->loc[1], in->loc[3]);
        return;
    }
    if (in->kind == DO_SUM_COLS)
        fprintf(w->out, "a%u[r] += total%u(wide%u(", in->loc[3], lanes, lanes);
    else
        fprintf(w->out, "a%u += wide%u(", in->loc[3], lanes);
    write_new_lanes(w, in->loc[1]);
    fputs(in->kind == DO_SUM_COLS ? "));\n" : ");\n", w->out);
}

static void write_scatter_lanes(const struct writer *w, const struct instruction *in, char sign)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    uint32_t sink = in->loc[3], lanes = w->w->lanes;
    if (lanes == 1) {
        fputs("{ char *to = ", w->out);
        write_sink_start(w, sink);
        fputs(" + (size_t)", w->out);
        write_row(w, o);
        fprintf(w->out, " * %zu; store1(to, load1(to) %c v%u); }\n", sink_row_bytes(w, sink), sign,
                in->loc[1]);
        return;
    }
    fprintf(w->out, "scatter%u(", lanes);
    write_sink_start(w, sink);
    fprintf(w->out, ", l + %u + r, %zu, %cv%u, %s);\n", o->list - 1, sink_row_bytes(w, sink), sign,
            in->loc[1], w->ragged ? "next - r" : "0");
}

static void write_add_rows(const struct writer *w, const struct instruction *in)
{
    const struct loc *o = &w->p->locs[in->loc[0]];
    uint32_t sink = in->loc[3], lanes = w->w->lanes;
    char sign = w->p->values[in->value].flags & VALUE_NEGATED ? '-' : '+';
    if (w->w->along_rows && scatters(w, sink)) {
        write_scatter_lanes(w, in, sign);
    } else if (w->w->along_rows) {
        fprintf(w->out, "a%u %c= wide%u(", sink, sign, lanes);
        write_new_lanes(w, in->loc[1]);
        fputs(");\n", w->out);
    } else if (!scatters(w, sink)) {
        fprintf(w->out, "a%u %c= v%u;\n", sink, sign, in->loc[1]);
    } else if (in_array(w, sink)) {
        fprintf(w->out, "a%u[", sink);
        write_row(w, o);
        fprintf(w->out, "] %c= v%u;\n", sign, in->loc[1]);
    } else {
        fputs("{ char *to = ", w->out);
        write_sink_start(w, sink);
        fputs(" + (size_t)", w->out);
        write_row(w, o);
        fprintf(w->out, " * %zu + c * %zu; store%u(to, load%u(to) %c ", sink_row_bytes(w, sink),
                w->p->element, lanes, lanes, sign);
        write_new_lanes(w, in->loc[1]);
        fputs("); }\n", w->out);
    }
}

/* ---- the function ---- */

static void write_instruction(struct writer *w, const struct instruction *in)
{
    declare_operands(w, in, INNER);
    if (in->kind == DO_SUM || in->kind == DO_SUM_COLS) {
        write_sum(w, in);
        return;
    }
    if (in->kind == DO_ADD_ROWS) {
        write_add_rows(w, in);
        return;
    }
    const struct loc *o = &w->p->locs[in->loc[0]];
    fprintf(w->out, "const V%u v%u = ", w->w->lanes, in->loc[0]);
    if (in->kind == DO_ELEMENTWISE)
        write_elementwise(w, in);
    else if (in->kind == DO_DIFF)
        write_diff(w, in);
    else
        write_diff_adjoint(w, in);
    fputs(";\n", w->out);
    w->known[in->loc[0]] = 1;
    if (o->base == BASE_MEMORY) {
        fprintf(w->out, "store%u(", w->w->lanes);
        write_address(w, o);
        fprintf(w->out, ", v%u);\n", in->loc[0]);
    }
}

static void write_instructions(struct writer *w)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        write_instruction(w, in);
}

/* Opens the loop over vectors: c, or r along rows, is the first lane. */
static void open_vectors(const struct writer *w)
{
    const char *extent = along(w);
    char lane = w->w->along_rows ? 'r' : 'c';
    uint32_t lanes = w->w->lanes;
    if (w->ragged)
        fprintf(w->out,
                "for (size_t next = %s; next < %s_end; next += %u) {\n"
                "size_t %c = next + %u <= %s_end ? next : %s_end - %u;\n"
                "OPAQUE(%c);\n"
                "const I%u on = on%u(next - %c); (void)on;\n",
                extent, extent, lanes, lane, lanes, extent, extent, lanes, lane, lanes, lanes,
                lane);
    else
        fprintf(w->out, "for (size_t %c = %s; %c < %s_end; %c += %u) {\n", lane, extent, lane,
                extent, lane, lanes);
    if (w->stencils)
        fprintf(w->out, "const I%u at = columns%u(c);\n", lanes, lanes);
}

static void write_body(struct writer *w)
{
    static const char rows[] = "for (size_t r = row; r < row_end; r++) {\n";
    if (w->w->along_rows) {
        open_vectors(w);
        write_instructions(w);
        fputs("}\n", w->out);
    } else if (w->w->rows_inside) {
        open_vectors(w);
        open_column_sinks(w);
        for (size_t k = 0; k < w->n_arrays; k++)
            if (w->arrays[k].rows)
                fprintf(w->out,
                        "V%u q%zu[%u];\nfor (size_t r = 0; r < %u; r++)"
                        " q%zu[r] = load%u(m + %zu + r * %zu + c * %zu);\n",
                        w->w->lanes, k, w->arrays[k].rows, w->arrays[k].rows, k, w->w->lanes,
                        w->arrays[k].off, w->arrays[k].stride * w->p->element, w->p->element);
        declare_all(w, OUTER);
        fputs(rows, w->out);
        write_instructions(w);
        fputs("}\n", w->out);
        close_column_sinks(w);
        fputs("}\n", w->out);
    } else {
        fputs(rows, w->out);
        declare_all(w, OUTER);
        open_vectors(w);
        write_instructions(w);
        fputs("}\n}\n", w->out);
    }
}

/* ---- arrays ---- */

static void count_rows(struct writer *w, const struct loc *l)
{
    size_t k = 0;
    while (k < w->n_arrays && (w->arrays[k].off != l->off || w->arrays[k].stride != l->rs))
        k++;
    if (k == MAX_ARRAYS)
        return;
    if (k == w->n_arrays)
        w->arrays[w->n_arrays++] = (struct array){.off = l->off, .stride = l->rs};
    struct array *a = &w->arrays[k];
    for (uint32_t r = 0; r < w->w->segment.rows; r++) {
        uint32_t row = w->p->lists[l->list - 1 + r];
        a->rows = row < a->rows ? a->rows : row + 1;
    }
    a->uses += w->w->segment.rows;
}

/* Rows read several times each, and few enough for the cache, are brought together first. */
static void find_arrays(struct writer *w)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (uint32_t k = 1; k <= in->n_in && reads_lanes(in); k++) {
            const struct loc *l = &w->p->locs[in->loc[k]];
            if (w->w->rows_inside && l->base == BASE_MEMORY && l->list && l->cs)
                count_rows(w, l);
        }
    for (size_t k = 0; k < w->n_arrays; k++) {
        struct array *a = &w->arrays[k];
        if (a->uses < 2 * a->rows || a->rows * w->w->lanes * w->p->element > MAX_ARRAY_BYTES)
            a->rows = 0;
    }
}

static uint32_t most_locs(const struct writer *w)
{
    uint32_t most = 0;
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (uint32_t k = 0; k <= in->n_in; k++)
            most = in->loc[k] > most ? in->loc[k] : most;
    return most + 1;
}

bool ad_native_segment(FILE *out, const ad_program *p, const struct walk *walk)
{
    const struct segment *g = &walk->segment;
    struct writer w = {.out = out, .p = p, .w = walk, .first = p->instructions + g->first};
    w.end = w.first + g->count;
    w.known = calloc(most_locs(&w), 1);
    if (!w.known)
        return false;
    w.ragged = (walk->along_rows ? g->rows : g->cols) % walk->lanes != 0;
    for (const struct instruction *in = w.first; in < w.end; in++)
        w.stencils = w.stencils || !reads_lanes(in);
    find_arrays(&w);
    fprintf(out,
            "static void s%u(char *m, const u32 *l, size_t chunk, size_t row, size_t row_end,"
            " size_t col, size_t col_end)\n{\n(void)l; (void)chunk; (void)col; (void)col_end;\n",
            walk->number);
    open_sinks(&w);
    declare_all(&w, FUNCTION);
    write_body(&w);
    close_sinks(&w);
    fputs("}\n", out);
    free(w.known);
    return true;
}
