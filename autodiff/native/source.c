/* The source of a program: vector types, a function for every fused segment, and one for every
   sequence of them between calls of the executor. */
#include "autodiff/free.h"
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
    for (size_t i = 0, joined; walks && i < *n; i += joined) {
        joined = ad_native_joined(p, *n - i, walks + i);
        walks[i].joined = (uint32_t)joined;
        for (size_t k = i; joined > 1 && k < i + joined; k++) {
            walks[k].rows_inside = walks[k].literal = true;
            walks[k].joined = k == i ? (uint32_t)joined : 0;
        }
    }
    return walks;
}

/* The compiler would inline segments that are called once into one function, which takes longer to
   compile than functions of their length: worth it only for a few segments, of short runs. */
static bool is_long(size_t n) { return n > 16; }

bool ad_native_streams(const ad_program *p)
{
    enum { CACHED = 24 << 20 }; /* measured; most processors have about as much, for all cores */
    return p->memory_bytes > CACHED;
}

/* The upper halves of registers stay dirty where gcc 12 ends on a call with vectors, and every SSE
   instruction behind waits for them: 250 ns a run. */
static const char leave[] = "#ifdef __AVX__\n#define LEAVE __builtin_ia32_vzeroupper();\n"
                            "#define STREAMED __builtin_ia32_sfence();\n"
                            "#else\n#define LEAVE\n#define STREAMED\n#endif\n";

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
    char kind = w->joined > 1 ? 'j' : 's';
    if (g->chunks > 1)
        fprintf(out, "%c%u(m, win, l, chunk, row, row_end, col, col_end);\n", kind, w->number);
    else
        fprintf(out, "%c%u(m, win, l, 0, 0, %u, 0, %u);\n", kind, w->number, g->rows, g->cols);
}

/* Several segments in one loop are one to the executor. */
static struct segment whole(const struct loop_order walks[])
{
    struct segment g = walks[0].segment;
    for (uint32_t k = 1; k < walks[0].joined; k++)
        g.n_sinks += walks[k].segment.n_sinks;
    if (walks[0].joined > 1)
        g.before = g.after = 0;
    return g;
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
        native->segments[native->n_segments++] = whole(&walks[i]);
        write_call(out, &walks[i]);
        i += walks[i].joined - 1;
        for (; i + 1 < n && joins(p, &walks[i], &walks[i + 1]); i += walks[i + 1].joined)
            write_call(out, &walks[i + 1]);
        fprintf(out, "%sLEAVE\n}\n", ad_native_streams(p) ? "STREAMED " : "");
    }
}

/* The segments of one loop, which have functions of their own for the columns beyond a block. */
static bool write_segments(FILE *out, const ad_program *p, const struct loop_order walks[])
{
    const uint32_t n = walks[0].joined;
    bool done = true;
    for (uint32_t k = 0; k < n && done && walks[k].segment.fused; k++)
        if (n == 1 || walks[k].segment.before || walks[k].segment.after)
            done = ad_native_segment(out, p, 1, &walks[k]);
    return done && (n == 1 || ad_native_segment(out, p, n, walks));
}

static size_t count(const char *text, const char *word)
{
    size_t n = 0;
    while ((text = strstr(text, word))) {
        text += strlen(word);
        n++;
    }
    return n;
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
        fputs(leave, out);
        for (size_t i = 0; done && i < n; i += walks[i].joined)
            done = write_segments(out, p, &walks[i]);
        write_runs(out, p, n, walks, native);
        fflush(out);
        native->bytes = bytes - vectors;
        native->loops = count(text + vectors, "\nfor (");
        native->sincos = count(text + vectors, " = sincos");
    }
    if (out)
        done = fclose(out) == 0 && done;
    free(walks);
    if (!done) {
        AD_FREE(text, native->segments);
        native->segments = NULL;
        return NULL;
    }
    return text;
}
