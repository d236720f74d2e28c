/* The source of a program: vector types, a function for every fused segment, and one for every
   sequence of them between calls of the executor. */
#include "native.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_LANES = 64 };

/* Starts a new segment of the executor: one it runs itself, one split for threads, or the first of
   a rerun. */
static bool joins(const ad_program *p, const struct loop_order *before, const struct loop_order *w)
{
    return before->segment.fused && before->segment.chunks == 1 && w->segment.fused &&
           w->segment.chunks == 1 && w->number != p->n_held_segments;
}

static struct loop_order *plan_walks(const ad_program *p, size_t *n)
{
    *n = p->n_segments - p->n_constant_segments;
    struct loop_order *walks = malloc((*n + 1) * sizeof *walks);
    for (size_t i = 0; walks && i < *n; i++) {
        uint32_t number = (uint32_t)(p->n_constant_segments + i);
        walks[i] = p->segments[number].fused
                       ? ad_native_loop_order(p, number, ad_native_vector_bytes(p))
                       : (struct loop_order){.segment = p->segments[number], .number = number};
    }
    return walks;
}

/* The compiler would inline segments that are called once into one function, which takes longer to
   compile than functions of their length: worth it only for a few segments, of short runs. */
static bool is_long(size_t n) { return n > 16; }

static void write_vectors(FILE *out, const ad_program *p, size_t n, const struct loop_order walks[])
{
    bool written[MOST_LANES + 1] = {false};
    ad_native_vectors(out, p, 1);
    written[1] = true;
    for (size_t i = 0; i < n; i++) {
        uint32_t lanes = walks[i].lanes;
        if (!lanes || written[lanes])
            continue;
        ad_native_vectors(out, p, lanes);
        written[lanes] = true;
    }
}

static void write_call(FILE *out, const struct loop_order *w)
{
    const struct segment *g = &w->segment;
    if (g->chunks > 1)
        fprintf(out, "s%u(m, win, l, chunk, row, row_end, col, col_end);\n", w->number);
    else
        fprintf(out, "s%u(m, win, l, 0, 0, %u, 0, %u);\n", w->number, g->rows, g->cols);
}

/* Functions that call consecutive segments, and the list of segments left to the executor. */
static void write_runs(FILE *out, const ad_program *p, size_t n, const struct loop_order walks[],
                       struct native *native)
{
    size_t runs = 0;
    for (size_t i = 0; i < n; i++) {
        if (walks[i].number < p->n_held_segments)
            native->n_held = native->n_segments + 1;
        if (!walks[i].segment.fused) {
            native->segments[native->n_segments++] = walks[i].segment;
            continue;
        }
        fprintf(out,
                "void run%zu(char *m, char *win, const u32 *l, size_t chunk, size_t row,"
                " size_t row_end, size_t col, size_t col_end)\n{\n(void)win; (void)chunk; "
                "(void)row; (void)row_end;"
                " (void)col; (void)col_end;\n",
                runs++);
        native->segments[native->n_segments++] = walks[i].segment;
        write_call(out, &walks[i]);
        for (; i + 1 < n && joins(p, &walks[i], &walks[i + 1]); i++)
            write_call(out, &walks[i + 1]);
        fputs("}\n", out);
    }
}

char *ad_native_source(const ad_program *p, struct native *native)
{
    size_t n, bytes;
    char *text = NULL;
    struct loop_order *walks = plan_walks(p, &n);
    native->segments = malloc((n + 1) * sizeof *native->segments);
    FILE *out = open_memstream(&text, &bytes);
    bool done = walks && native->segments && out;
    if (done) {
        write_vectors(out, p, n, walks);
        fflush(out);
        size_t vectors = bytes;
        fprintf(out, "#define SEGMENT static%s\n", is_long(n) ? " __attribute__((noinline))" : "");
        for (size_t i = 0; done && i < n; i++)
            done = !walks[i].segment.fused || ad_native_segment(out, p, &walks[i]);
        write_runs(out, p, n, walks, native);
        fflush(out);
        native->bytes = bytes - vectors;
    }
    if (out)
        done = fclose(out) == 0 && done;
    free(walks);
    if (!done) {
        free(text);
        free(native->segments);
        native->segments = NULL;
        return NULL;
    }
    return text;
}
