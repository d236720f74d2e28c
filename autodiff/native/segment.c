/* Writes one segment as a C function: what the interpreter does tile by tile, kernel by kernel,
   becomes one loop over vectors, with a variable for every value of a tile.

       rows outside      for each row, for each vector of columns
       rows inside       for each vector of columns, for each row: where gathers and sums combine
                         rows. The rows they read and accumulate into lie in arrays that hold one
                         vector of each, so that a pair law runs in the cache
       along rows        for each vector of rows, of a single column

   The last vector of a loop is moved back to end with the data: it computes some lanes again, and
   `on` excludes these from sums. */
#include "writer.h"

#include <stdlib.h>
#include <string.h>

enum {
    MAX_LITERAL_ROWS = 16,
    MAX_LITERAL = 256,           /* instructions at most when rows are unrolled */
    MAX_INSTRUCTIONS_BESIDE = 24 /* of a row; a longer row fills the processor by itself */
};

static uint32_t count_known(const struct writer *w)
{
    uint32_t most = 0;
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (uint32_t k = 0; k <= in->n_in; k++)
            most = in->loc[k] > most ? in->loc[k] : most;
    return most + 1;
}

/* ---- instructions ---- */

void ad_native_instruction(struct writer *w, const struct instruction *in)
{
    ad_native_declare(w, in, INNER);
    if (is_sum(in)) {
        ad_native_add(w, in);
        return;
    }
    ad_native_prepare(w, in);
    w->known[in->loc[0]] |= (uint8_t)(1u << w->k);
    ad_native_say(w, "const V@ ");
    ad_native_name(w, in->loc[0]);
    ad_native_say(w, " = ");
    ad_native_operation(w, in);
    ad_native_say(w, ";\n");
    if (w->p->locs[in->loc[0]].base != BASE_TILE) {
        ad_native_say(w, "store@(");
        ad_native_address(w, &w->p->locs[in->loc[0]]);
        ad_native_say(w, ", v%u_%u);\n", in->loc[0], w->k);
    } else if (w->crosses && w->crosses[in->loc[0]]) {
        ad_native_say(w, "a->x[%u] = v%u_%u;\n", ad_native_slot(w, in->loc[0]), in->loc[0], w->k);
    }
}

void ad_native_forget_rows(struct writer *w)
{
    for (uint32_t i = 0; i < w->n_known; i++)
        w->known[i] &= EVERY_ROW;
}

/* All instructions, for `beside` rows interleaved. */
static void write_instructions(struct writer *w, uint32_t beside)
{
    if (w->crosses) {
        ad_native_call_parts(w);
        return;
    }
    for (const struct instruction *in = w->first; in < w->end; in++)
        for (w->k = 0; w->k < beside; w->k++)
            ad_native_instruction(w, in);
    w->k = 0;
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

/* A few rows are unrolled: their addresses are constants, and sums stay in registers. */
static void write_literal_rows(struct writer *w)
{
    w->literal = true;
    for (w->row = 0; w->row < w->g->rows; w->row += MAX_BESIDE) {
        uint32_t left = w->g->rows - w->row;
        ad_native_say(w, "{\n");
        write_instructions(w, left < MAX_BESIDE ? left : MAX_BESIDE);
        ad_native_say(w, "}\n");
    }
    w->literal = false;
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

static bool write_rows_inside(struct writer *w)
{
    bool done = true;
    bool literal = w->g->rows <= MAX_LITERAL_ROWS && w->g->rows * w->g->count <= MAX_LITERAL &&
                   !(w->g->by_rows && w->g->chunks > 1);
    open_vectors(w);
    ad_native_sums(w, OPEN_COLUMNS);
    ad_native_fill_arrays(w);
    ad_native_declare_all(w, OUTER);
    if (literal)
        write_literal_rows(w);
    else
        done = write_row_loop(w);
    ad_native_sums(w, CLOSE_COLUMNS);
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

bool ad_native_segment(FILE *out, const ad_program *p, const struct loop_order *walk)
{
    const struct segment *g = &walk->segment;
    struct writer w = {.out = out, .p = p, .walk = walk, .g = g};
    w.first = p->instructions + g->first;
    w.end = w.first + g->count;
    w.ragged = (walk->along_rows ? g->rows : g->cols) % walk->lanes != 0;
    w.n_known = count_known(&w);
    w.known = calloc(w.n_known, 1);
    if (!w.known || !ad_native_find_scatters(&w)) {
        free(w.known);
        return false;
    }
    ad_native_find_lists(&w);
    bool done = ad_native_parts(&w);
    if (!w.crosses)
        ad_native_find_arrays(&w);
    w.newton = ad_native_newton(&w);
    ad_native_say(
        &w,
        "SEGMENT void s%u(char *m, char *win, const u32 *l, size_t chunk, size_t row,"
        " size_t row_end, size_t col, size_t col_end)\n{\n"
        "(void)win; (void)l; (void)chunk; (void)row; (void)row_end; (void)col; (void)col_end;\n",
        walk->number);
    if (w.crosses)
        ad_native_say(&w, "struct parts%u parts, *const a = &parts;\n", walk->number);
    else
        ad_native_declare_sums(&w);
    ad_native_sums(&w, OPEN_SEGMENT);
    ad_native_declare_all(&w, FUNCTION);
    if (walk->along_rows)
        write_along_rows(&w);
    else if (walk->rows_inside)
        done = write_rows_inside(&w) && done;
    else
        write_rows_outside(&w);
    ad_native_sums(&w, CLOSE_SEGMENT);
    ad_native_say(&w, "}\n");
    free(w.known);
    free(w.crosses);
    free(w.scattered);
    return done;
}
