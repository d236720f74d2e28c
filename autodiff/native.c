/* The compiled back end: when it pays, and putting it in place of the interpreter. */
#include "native.h"

#include <dlfcn.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

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

/* ---- installing ---- */

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

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static bool turned_off(void)
{
    const char *wanted = getenv("LEASTACTION_NATIVE");
    return wanted && strcmp(wanted, "0") == 0;
}

/* Seconds of a run, of the faster of two: the first finds the cache cold. */
static double time_run(ad_program *p)
{
    double least = INFINITY;
    for (int k = 0; k < 2; k++) {
        double start = now();
        ad_run(p);
        least = fmin(least, now() - start);
    }
    return least;
}

/* Measured: compiled code takes half the interpreter's time or less; loading it takes LOAD seconds,
   compiling COMPILE and PER_INSTRUCTION. */
static const double SAVED = 0.5, LOAD = 5e-4, COMPILE = 0.1, PER_INSTRUCTION = 4e-4;

static double compile_seconds(const ad_program *p)
{
    return COMPILE + PER_INSTRUCTION * (double)p->n_instructions;
}

static bool install(ad_program *p, const struct compiler *compiler, bool may_compile,
                    struct ad_error *note)
{
    struct native *native = calloc(1, sizeof *native);
    char *source = native ? full_source(p, compiler, native) : NULL;
    if (source)
        native->library =
            ad_native_load(source, p->kernels->isa, may_compile ? compiler : NULL, note);
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

bool ad_native(ad_program *p, double runs, struct ad_error *note)
{
    struct compiler compiler;
    struct ad_error unused = {0};
    note = note ? note : &unused;
    if (p->native)
        return true;
    if (turned_off()) {
        ad_fail(note, AD_E_ARGUMENT, "turned off by LEASTACTION_NATIVE=0");
        return false;
    }
    double saved = runs < INFINITY ? SAVED * runs * time_run(p) : INFINITY;
    if (saved < LOAD) {
        ad_fail(note, AD_E_ARGUMENT, "too few runs to pay");
        return false;
    }
    if (!ad_cc_find(&compiler, note) || !install(p, &compiler, saved > compile_seconds(p), note)) {
        ad_fail(note, AD_E_ARGUMENT, "not in the cache, and too few runs to pay for compiling");
        return false;
    }
    return true;
}
