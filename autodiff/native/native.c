/* The compiled back end: when it pays, and putting it in place of the interpreter. */
#include "autodiff/native.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

/* ---- source ---- */

/* The name of a cached file comes from the text: whatever the machine code depends on is in it. */
static char *full_source(const ad_program *p, const struct compiler *c, struct native *native)
{
    char *body = ad_native_source(p, native), *text = NULL;
    size_t bytes;
    FILE *out = body ? open_memstream(&text, &bytes) : NULL;
    if (out) {
        fprintf(out, "/* leastaction %d, %s\n  ", NATIVE_VERSION, c->identity);
        for (const char *const *flag = ad_cc_flags(p->kernels->isa); *flag; flag++)
            fprintf(out, " %s", *flag);
        for (size_t k = 0; c->words[k]; k++)
            fprintf(out, " %s", c->words[k]);
        fprintf(out, " */\n%s", body);
        if (fclose(out) != 0) {
            free(text);
            text = NULL;
        }
    }
    free(body);
    return text;
}

/* ---- in place of the interpreter ---- */

size_t ad_native_functions(const struct native *native)
{
    size_t n = 0;
    for (size_t i = 0; i < native->n_segments; i++)
        n += native->segments[i].fused;
    return n;
}

void ad_native_put(ad_program *p, struct native *native, ad_native_run *const functions[])
{
    size_t n = 0;
    for (size_t i = 0; i < native->n_segments; i++)
        if (native->segments[i].fused)
            native->segments[i].native = functions[n++];
    p->native = native;
}

static bool load(ad_program *p, struct native *native, const char *source,
                 const struct compiler *compiler, struct ad_error *note)
{
    size_t n = ad_native_functions(native);
    ad_native_run **functions = malloc((n + 1) * sizeof *functions);
    if (!functions) {
        ad_fail(note, AD_E_MEMORY, "out of memory");
        return false;
    }
    native->library = ad_native_load(source, p->kernels->isa, compiler, n, functions, note);
    if (native->library)
        ad_native_put(p, native, functions);
    free(functions);
    return native->library;
}

void ad_native_free(struct native *native)
{
    if (!native)
        return;
    if (native->library)
        dlclose(native->library);
    free(native->segments);
    free(native);
}

/* ---- when ---- */

static bool turned_off(void)
{
    const char *wanted = getenv("LEASTACTION_NATIVE");
    return wanted && strcmp(wanted, "0") == 0;
}

/* A quarter of a minute for the compiler. */
enum { MOST_INSTRUCTIONS = 1 << 16 };

/* Seconds that machine code saves in a run, and that compiling takes: measured on one machine once,
   not here, so that the same work gives the same bits every time. */
static double seconds_saved(const ad_program *p, size_t first)
{
    static const double AN_ELEMENT = 1e-10, AN_INSTRUCTION = 5e-9;
    double saved = 0;
    for (size_t i = first; i < p->n_segments; i++) {
        const struct segment *g = &p->segments[i];
        if (g->fused)
            saved += g->count * (AN_INSTRUCTION + AN_ELEMENT * g->rows * g->cols);
    }
    return saved;
}

/* A function costs more than its instructions: loops, and most where rows meet, which are written
   out several times. Measured with gcc 13 on programs of 200 to 9600 instructions, -O2. */
static double seconds_to_compile(const ad_program *p)
{
    static const double START = 0.15, AN_INSTRUCTION = 2e-4, A_SUM = 1e-3, A_SEGMENT = 1e-3,
                        ROWS_INSIDE = 1e-2;
    double seconds = START;
    for (size_t i = p->n_constant_segments; i < p->n_segments; i++) {
        const struct segment *g = &p->segments[i];
        if (!g->fused)
            continue;
        seconds += A_SEGMENT + AN_INSTRUCTION * g->count + A_SUM * g->n_sinks;
        if (ad_native_walk(p, (uint32_t)i, ad_native_vector_bytes(p)).rows_inside)
            seconds += ROWS_INSIDE;
    }
    return seconds;
}

static bool install(ad_program *p, const struct compiler *compiler, struct ad_error *note)
{
    struct native *native = calloc(1, sizeof *native);
    char *source = native ? full_source(p, compiler, native) : NULL;
    bool loaded = source && load(p, native, source, compiler, note);
    if (!source)
        ad_fail(note, AD_E_MEMORY, "out of memory");
    free(source);
    if (!loaded)
        ad_native_free(native);
    return loaded;
}

/* Keeps why compiling is out of the question. */
static bool is_refused(ad_program *p)
{
    p->interpreted = (struct ad_error){0};
    if (turned_off())
        ad_fail(&p->interpreted, AD_E_ARGUMENT, "LEASTACTION_NATIVE=0 turns machine code off");
    else if (p->n_instructions > MOST_INSTRUCTIONS)
        ad_fail(&p->interpreted, AD_E_ARGUMENT,
                "%zu instructions take too long to compile; the most is %d", p->n_instructions,
                MOST_INSTRUCTIONS);
    return p->interpreted.status != AD_OK;
}

static void compile(ad_program *p)
{
    struct compiler compiler = {.identity = ""};
    p->interpreted = (struct ad_error){0};
    p->price = 0;
    if (ad_cc_find(&compiler, &p->interpreted))
        install(p, &compiler, &p->interpreted);
}

static void note_too_few(ad_program *p)
{
    ad_fail(&p->interpreted, AD_E_ARGUMENT,
            "so few runs do not pay for compiling %zu instructions, about %.2g s",
            p->n_instructions, seconds_to_compile(p));
}

bool ad_native(ad_program *p, double runs, struct ad_error *note)
{
    if (!p) {
        if (note)
            *note = *ad_program_error(NULL);
        return false;
    }
    if (!p->native && !is_refused(p)) {
        if (seconds_saved(p, p->n_constant_segments) == 0)
            ad_fail(&p->interpreted, AD_E_ARGUMENT,
                    "nothing to compile: runs consist of products, transpositions and copies");
        else if (runs * seconds_saved(p, p->n_constant_segments) > seconds_to_compile(p))
            compile(p);
        else
            note_too_few(p);
    }
    if (!p->native && note)
        *note = p->interpreted;
    return p->native;
}

void ad_native_in_time(ad_program *p)
{
    if (!p || p->native || is_refused(p))
        return;
    p->price = seconds_to_compile(p);
    note_too_few(p);
}

void ad_native_weigh(ad_program *p, size_t first)
{
    p->saved += seconds_saved(p, first);
    if (p->saved > p->price)
        compile(p);
}

const char *ad_native_note(const ad_program *p)
{
    return !p                          ? ad_program_error(NULL)->message
           : p->native                 ? ""
           : p->interpreted.message[0] ? p->interpreted.message
                                       : "nobody asked for machine code";
}
