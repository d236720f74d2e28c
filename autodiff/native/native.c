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

static bool find_functions(struct native *native)
{
    size_t runs = 0;
    for (size_t i = 0; i < native->n_segments; i++) {
        struct segment *g = &native->segments[i];
        char name[32];
        if (!g->fused)
            continue;
        snprintf(name, sizeof name, "run%zu", runs++);
        void *symbol = dlsym(native->library, name);
        if (!symbol)
            return false;
        memcpy(&g->native, &symbol, sizeof symbol); /* C has no cast from data to function */
    }
    return true;
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

static double seconds_to_compile(const ad_program *p)
{
    static const double START = 0.15, AN_INSTRUCTION = 2.5e-4;
    return START + AN_INSTRUCTION * (double)p->n_instructions;
}

static bool install(ad_program *p, const struct compiler *compiler, struct ad_error *note)
{
    struct native *native = calloc(1, sizeof *native);
    char *source = native ? full_source(p, compiler, native) : NULL;
    if (source)
        native->library = ad_native_load(source, p->kernels->isa, compiler, note);
    else
        ad_fail(note, AD_E_MEMORY, "out of memory");
    free(source);
    if (!native || !native->library || !find_functions(native)) {
        ad_native_free(native);
        return false;
    }
    p->native = native;
    return true;
}

/* Keeps why compiling is out of the question. */
static bool is_refused(ad_program *p)
{
    p->interpreted = (struct ad_error){0};
    if (turned_off())
        ad_fail(&p->interpreted, AD_E_ARGUMENT, "LEASTACTION_NATIVE=0 turns machine code off");
    else if (p->n_instructions > MOST_INSTRUCTIONS)
        ad_fail(&p->interpreted, AD_E_ARGUMENT,
                "more than %d instructions take too long to compile", MOST_INSTRUCTIONS);
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

static const char too_few[] = "so few runs do not pay for compiling";

bool ad_native(ad_program *p, double runs, struct ad_error *note)
{
    if (!p->native && !is_refused(p)) {
        if (runs * seconds_saved(p, p->n_constant_segments) > seconds_to_compile(p))
            compile(p);
        else
            ad_fail(&p->interpreted, AD_E_ARGUMENT, "%s", too_few);
    }
    if (!p->native && note)
        *note = p->interpreted;
    return p->native;
}

void ad_native_in_time(ad_program *p)
{
    if (p->native || is_refused(p))
        return;
    p->price = seconds_to_compile(p);
    ad_fail(&p->interpreted, AD_E_ARGUMENT, "%s", too_few);
}

void ad_native_weigh(ad_program *p, size_t first)
{
    p->saved += seconds_saved(p, first);
    if (p->saved > p->price)
        compile(p);
}

const char *ad_native_note(const ad_program *p)
{
    return p->native                   ? ""
           : p->interpreted.message[0] ? p->interpreted.message
                                       : "nobody asked for machine code";
}
