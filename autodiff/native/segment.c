/* Writes one segment as a C function: what the interpreter does tile by tile, kernel by kernel,
   becomes one loop over vectors, with a variable for every value of a tile.

       rows outside      for each row, for each vector of columns
       rows inside       for each vector of columns, for each row: where gathers and sums combine
                         rows. The rows they read and accumulate into lie in arrays that hold one
                         vector of each, so that a pair law runs in the cache
       along rows        for each vector of rows, of a single column

   Rows inside that are few are written one by one, and several such segments (loops.c) in one loop:
   what one of them stores, the others have in a register.

   The last vector of a loop is moved back to end with the data: it computes some lanes again, and
   `on` excludes these from sums. */
#include "autodiff/free.h"
#include "writer.h"

#include <stdlib.h>

enum { MAX_INSTRUCTIONS_BESIDE = 24 }; /* of a row; a longer row fills the processor by itself */

static uint32_t count_known(const struct writer *w)
{
    uint32_t most = 0;
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (uint32_t k = 0; k <= in->n_in; k++)
            most = in->loc[k] > most ? in->loc[k] : most;
    return most + 1;
}

/* ---- instructions ---- */

static void write_value(struct writer *w, const struct instruction *in)
{
    w->known[in->loc[0]] |= 1u << w->k;
    ad_native_say(w, "const V@ ");
    ad_native_name(w, in->loc[0]);
    ad_native_say(w, " = ");
    ad_native_operation(w, in);
    ad_native_say(w, ";\n");
    const struct loc *o = &w->p->locs[in->loc[0]];
    if (o->base != BASE_TILE) {
        if (ad_native_is_read(w, in->value, o->base, ad_native_at(w, o))) {
            bool stream = o->base == BASE_MEMORY && w->walk->lanes > 1 &&
                          o->rs % w->walk->lanes == 0 && w->p->last[in->value] == UINT32_MAX &&
                          ad_native_streams(w->p);
            ad_native_say(w, stream ? "stream@(" : "store@(");
            ad_native_address(w, o);
            ad_native_say(w, ", v%u_%u);\n", in->loc[0], w->k);
        }
        ad_native_remember(w, (struct place){ad_native_at(w, o), o->base, 'v', in->loc[0], w->k});
    } else if (w->crosses && w->crosses[in->loc[0]]) {
        ad_native_say(w, "a->x[%u] = v%u_%u;\n", ad_native_slot(w, in->loc[0]), in->loc[0], w->k);
    }
}

void ad_native_instruction(struct writer *w, const struct instruction *in, uint32_t from,
                           uint32_t to)
{
    for (w->k = from; w->k < to; w->k++)
        ad_native_declare(w, in, INNER);
    if (!is_sum(in))
        ad_native_prepare(w, in, from, to);
    for (w->k = from; w->k < to; w->k++)
        (is_sum(in) ? ad_native_add : write_value)(w, in);
    w->k = 0;
}

void ad_native_forget_rows(struct writer *w)
{
    for (uint32_t i = 0; i < w->n_known; i++)
        w->known[i] &= EVERY_ROW;
}

/* All instructions, for rows [from, to) interleaved. */
static void write_rows(struct writer *w, uint32_t from, uint32_t to)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        ad_native_instruction(w, in, from, to);
}

static void write_instructions(struct writer *w, uint32_t beside)
{
    if (w->crosses) {
        ad_native_call_parts(w);
        return;
    }
    write_rows(w, 0, beside);
    ad_native_forget_rows(w);
}

/* ---- loops ---- */

/* Opens the loop over vectors: c, or r along rows, is the first lane. */
static void open_vectors(const struct writer *w)
{
    const char *extent = w->walk->along_rows ? "row" : "col";
    char lane = w->walk->along_rows ? 'r' : 'c';
    if (w->ragged)
        ad_native_say(w,
                      "for (size_t next = %s; next < %s_end; next += @) {\n"
                      "size_t %c = next + @ <= %s_end ? next : %s_end - @;\n"
                      "OPAQUE(%c);\nconst I@ on = on@(next - %c); (void)on;\n",
                      extent, extent, lane, extent, extent, lane, lane);
    else
        ad_native_say(w, "for (size_t %c = %s; %c < %s_end; %c += @) {\n", lane, extent, lane,
                      extent, lane);
}

static bool write_row_loop(struct writer *w)
{
    bool written = false, done = w->crosses || ad_native_pipeline(w, &written);
    if (written || !done)
        return done;
    uint32_t beside = w->g->count <= MAX_INSTRUCTIONS_BESIDE && w->g->rows > 1 ? MAX_BESIDE : 1;
    ad_native_say(w, "size_t r = row;\n");
    if (beside > 1) {
        ad_native_say(w, "for (; r + %u <= row_end; r += %u) {\n", beside, beside);
        write_instructions(w, beside);
        ad_native_say(w, "}\n");
    }
    ad_native_say(w, "for (; r < row_end; r++) {\n");
    write_instructions(w, 1);
    ad_native_say(w, "}\n");
    return true;
}

/* The rows of one vector of columns. */
static bool write_columns(struct writer *w)
{
    const uint32_t rows = w->g->rows;
    bool done = true;
    ad_native_sums(w, OPEN_COLUMNS);
    ad_native_fill_arrays(w);
    ad_native_declare_all(w, OUTER);
    for (uint32_t r = 0; w->walk->literal && r < rows; r += MAX_BESIDE)
        write_rows(w, r, r + MAX_BESIDE < rows ? r + MAX_BESIDE : rows);
    if (!w->walk->literal)
        done = write_row_loop(w);
    ad_native_sums(w, CLOSE_COLUMNS);
    return done;
}

static bool write_rows_inside(struct writer *w)
{
    open_vectors(w);
    bool done = write_columns(w);
    ad_native_say(w, "}\n");
    return done;
}

static void write_rows_outside(struct writer *w)
{
    ad_native_say(w, "for (size_t r = row; r < row_end; r++) {\n");
    ad_native_sums(w, OPEN_ROW);
    ad_native_declare_all(w, OUTER);
    open_vectors(w);
    write_instructions(w, 1);
    ad_native_say(w, "}\n");
    ad_native_sums(w, CLOSE_ROW);
    ad_native_say(w, "}\n");
}

static void write_along_rows(struct writer *w)
{
    open_vectors(w);
    write_instructions(w, 1);
    ad_native_say(w, "}\n");
}

/* ---- functions ---- */

/* Turns to a segment; false when out of memory. */
static bool enter(struct writer *w, const struct loop_order *walk)
{
    w->walk = walk;
    w->g = &walk->segment;
    w->first = w->p->instructions + w->g->first;
    w->end = w->first + w->g->count;
    w->ragged = (walk->along_rows ? w->g->rows : w->g->cols) % walk->lanes != 0;
    w->newton = ad_native_newton(w);
    return ad_native_find_targets(w);
}

static void write_head(const struct writer *w, char kind)
{
    ad_native_say(
        w,
        "SEGMENT void %c%u(char *m, char *win, const u32 *l, size_t chunk, size_t row,"
        " size_t row_end, size_t col, size_t col_end)\n{\n"
        "(void)win; (void)l; (void)chunk; (void)row; (void)row_end; (void)col; (void)col_end;\n",
        kind, w->walk->number);
}

static bool write_alone(struct writer *w)
{
    ad_native_find_lists(w);
    bool done = ad_native_parts(w);
    if (!w->crosses && !w->walk->literal)
        ad_native_find_arrays(w);
    w->newton = ad_native_newton(w);
    write_head(w, 's');
    if (w->crosses)
        ad_native_say(w, "struct parts%u parts, *const a = &parts;\n", w->walk->number);
    else
        ad_native_declare_sums(w);
    ad_native_sums(w, OPEN_SEGMENT);
    ad_native_declare_all(w, FUNCTION);
    if (w->walk->along_rows)
        write_along_rows(w);
    else if (w->walk->rows_inside)
        done = write_rows_inside(w) && done;
    else
        write_rows_outside(w);
    ad_native_sums(w, CLOSE_SEGMENT);
    ad_native_say(w, "}\n");
    return done;
}

/* Columns beyond the block that another segment of it reads (compile/passes.c). */
static void write_beyond(const struct writer *w)
{
    const struct segment *g = w->g;
    if (g->before)
        ad_native_say(w, "if (col) s%u(m, win, l, chunk, 0, %u, col < %u ? 0 : col - %u, col);\n",
                      w->walk->number, g->rows, g->before, g->before);
    if (g->after)
        ad_native_say(w,
                      "if (col_end < %u) s%u(m, win, l, chunk, 0, %u, col_end,"
                      " col_end + %u < %u ? col_end + %u : %u);\n",
                      g->cols, w->walk->number, g->rows, g->after, g->cols, g->after, g->cols);
}

static bool write_joined(struct writer *w, size_t n, const struct loop_order walks[])
{
    bool done = enter(w, &walks[0]);
    w->joined = walks;
    w->n_joined = n;
    write_head(w, 'j');
    for (size_t k = 0; k < n && done; k++) {
        done = enter(w, &walks[k]);
        if (done)
            write_beyond(w);
    }
    for (size_t k = 0; k < n && done; k++) {
        done = enter(w, &walks[k]);
        if (!done)
            break;
        ad_native_declare_sums(w);
        ad_native_sums(w, OPEN_SEGMENT);
        ad_native_declare_all(w, FUNCTION);
    }
    open_vectors(w);
    ad_native_say(w, "const size_t behind = c < @ ? c : c - @;\n");
    for (size_t k = 0; k < n && done; k++)
        done = enter(w, &walks[k]) && write_columns(w);
    ad_native_say(w, "}\n");
    for (size_t k = 0; k < n && done; k++) {
        done = enter(w, &walks[k]);
        if (done)
            ad_native_sums(w, CLOSE_SEGMENT);
    }
    ad_native_say(w, "}\n");
    return done;
}

bool ad_native_segment(FILE *out, const ad_program *p, size_t n, const struct loop_order walks[])
{
    struct writer w = {.out = out, .p = p};
    bool done = true;
    for (size_t k = 0; k < n && done; k++) {
        done = enter(&w, &walks[k]);
        w.n_known = done && count_known(&w) > w.n_known ? count_known(&w) : w.n_known;
    }
    w.known = calloc(w.n_known + 1, sizeof *w.known);
    done = done && w.known && (n > 1 ? write_joined(&w, n, walks) : write_alone(&w));
    AD_FREE(w.known, w.crosses, w.targets);
    return done;
}
