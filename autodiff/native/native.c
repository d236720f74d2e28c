/* The native back end: decides when compiling pays, and replaces the interpreter. */
#include "native.h"
#include "autodiff/clock.h"
#include "autodiff/free.h"
#include "autodiff/ranks.h"

#include <dlfcn.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- source ---- */

/* The name of a cached file is a hash of this text, so the text contains everything that the
   machine code depends on. */
char *ad_native_full_source(char *body, const char *isa, const struct compiler *c)
{
    char *text = NULL;
    size_t bytes;
    FILE *out = body ? open_memstream(&text, &bytes) : NULL;
    if (out) {
        fprintf(out, "/* leastaction %d, %s\n  ", NATIVE_VERSION, c->identity);
        for (const char *const *flag = ad_cc_flags(isa); *flag; flag++)
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

/* ---- replacing the interpreter ---- */

size_t ad_native_functions(const struct native *native)
{
    size_t n = 0;
    for (size_t i = 0; i < native->n_segments; i++)
        n += native->segments[i].fused;
    return n;
}

/* State of the back end in a program. */
struct state {
    struct native *native; /* NULL: interpreted */
    double saved, price;   /* seconds: saved by machine code so far, cost of compiling; price 0:
                              ad_native_lazy was not called */
    double budget;         /* seconds for measuring machine code just compiled; 0: none is */
    struct ad_error why;   /* interpreted */
};

static const struct segment *prepare(ad_program *p, bool again, size_t *first, size_t *last);
static void free_state(void *state);
static const struct back_end machine_code = {prepare, free_state};

/* The state of a program, made if there is none; NULL when out of memory. */
static struct state *state_of(ad_program *p)
{
    if (!p->back_end && (p->back_end_state = calloc(1, sizeof(struct state))))
        p->back_end = &machine_code;
    return p->back_end_state;
}

bool ad_native_put(ad_program *p, struct native *native, ad_segment_code *const functions[])
{
    struct state *state = state_of(p);
    size_t n = 0;
    for (size_t i = 0; state && i < native->n_segments; i++)
        if (native->segments[i].fused)
            native->segments[i].code = functions[n++];
    if (state)
        state->native = native;
    return state;
}

static bool load(ad_program *p, struct native *native, const char *source,
                 const struct compiler *compiler, struct ad_error *note)
{
    size_t n = ad_native_functions(native);
    ad_segment_code **functions = malloc((n + 1) * sizeof *functions);
    if (!functions) {
        ad_fail(note, AD_E_MEMORY, "out of memory");
        return false;
    }
    native->library =
        ad_native_load(source, p->kernels->isa, compiler, n, functions, &native->built, note);
    bool put = native->library && ad_native_put(p, native, functions);
    free(functions);
    return put;
}

void ad_native_free(struct native *native)
{
    if (!native)
        return;
    if (native->library)
        dlclose(native->library);
    AD_FREE(native->segments, native);
}

static void free_state(void *of)
{
    struct state *state = of;
    ad_native_free(state->native);
    free(state);
}

/* ---- when it pays ---- */

bool ad_native_turned_off(void)
{
    const char *wanted = getenv("LEASTACTION_NATIVE");
    return wanted && strcmp(wanted, "0") == 0;
}

/* About 100 s of compiling at most. */
enum { MOST_INSTRUCTIONS = 1 << 16 };

/* Seconds that machine code saves per run, and that compiling takes: a model fitted on one machine,
   not a measurement at run time, so that the same work always gives the same bits. */
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

/* Compile time grows with the length of the source, the number of its loops and that of functions
   expanded in place. Measured with gcc 12, -O2, on programs of 60 to 10500 instructions: right
   within a third from 0.3 s on. Before the source is written AN_INSTRUCTION gives a lower bound. */
static const double START = 0.15, A_BYTE = 6.5e-6, A_LOOP = 2.5e-3, A_SINCOS = 2e-3,
                    AN_INSTRUCTION = 2e-4;

static double to_compile(const struct native *native)
{
    return START + A_BYTE * (double)native->bytes + A_LOOP * (double)native->loops +
           A_SINCOS * (double)native->sincos;
}

static double least_to_compile(const ad_program *p)
{
    return START + AN_INSTRUCTION * (double)p->n_instructions;
}

static void note_too_few(const ad_program *p, double seconds, struct ad_error *why)
{
    ad_fail(why, AD_E_ARGUMENT, "too few runs to pay for compiling %zu instructions, about %.2g s",
            p->n_instructions, seconds);
}

static void note_slow(struct ad_error *why)
{
    ad_fail(why, AD_E_ARGUMENT, "measured on this machine, machine code is slower");
}

static void install(ad_program *p, double worth, const struct compiler *compiler,
                    struct state *state)
{
    struct native *native = calloc(1, sizeof *native);
    const char *isa = p->kernels->isa;
    char *source =
        native ? ad_native_full_source(ad_native_source(p, native), isa, compiler) : NULL;
    double seconds = source ? to_compile(native) : 0;
    bool pays = worth > seconds, wanted_anyway = !(worth < INFINITY);
    if (source)
        native->key = ad_native_key(source);
    bool slow = source && !wanted_anyway && ad_native_is_slow(native->key);
    bool loaded = source && pays && !slow && load(p, native, source, compiler, &state->why);
    if (!source)
        ad_fail(&state->why, AD_E_MEMORY, "out of memory");
    else if (slow)
        note_slow(&state->why);
    else if (!pays)
        note_too_few(p, seconds, &state->why);
    state->price = pays || slow ? 0 : seconds;
    state->budget = loaded && native->built && !wanted_anyway ? 0.1 * seconds : 0;
    free(source);
    if (!loaded)
        ad_native_free(native);
}

/* Records why the program cannot be compiled. */
static bool is_refused(const ad_program *p, struct ad_error *why)
{
    *why = (struct ad_error){0};
    if (ad_native_turned_off())
        ad_fail(why, AD_E_ARGUMENT, "LEASTACTION_NATIVE=0 turns machine code off");
    else if (p->n_instructions > MOST_INSTRUCTIONS)
        ad_fail(why, AD_E_ARGUMENT, "%zu instructions take too long to compile; the most is %d",
                p->n_instructions, MOST_INSTRUCTIONS);
    return why->status != AD_OK;
}

/* Compiles if that takes less than the seconds it saves; otherwise state->price is its cost. */
static void compile(ad_program *p, struct state *state, double worth)
{
    struct compiler compiler = {.identity = ""};
    state->why = (struct ad_error){0};
    state->price = 0;
    if (ad_cc_find(&compiler, &state->why))
        install(p, worth, &compiler, state);
}

/* Whether the steps of a loop run as machine code. */
static bool has_native_steps(const ad_program *p)
{
    for (size_t k = 0; k < p->n_scans; k++)
        if (!*ad_native_note(ad_step_program(p, k)))
            return true;
    return false;
}

bool ad_native(ad_program *p, double runs, struct ad_error *note)
{
    for (size_t k = 0; p && k < p->n_scans; k++)
        ad_native(ad_step_program(p, k), runs * (double)ad_step_count(p, k), NULL);
    struct state *state = p ? state_of(p) : NULL;
    struct ad_error none = {0};
    if (!state) {
        ad_fail(&none, AD_E_MEMORY, "out of memory");
        if (note)
            *note = p ? none : *ad_program_error(NULL);
        return false;
    }
    if (!state->native && !is_refused(p, &state->why)) {
        double worth = runs * seconds_saved(p, p->n_constant_segments), price = state->price;
        if (seconds_saved(p, p->n_constant_segments) == 0)
            ad_fail(&state->why, AD_E_ARGUMENT,
                    "nothing to compile: runs consist of products, transpositions and copies");
        else if (worth > least_to_compile(p))
            compile(p, state, worth);
        else
            note_too_few(p, least_to_compile(p), &state->why);
        if (price == 0) /* ad_native_lazy was not called */
            state->price = 0;
    }
    bool native = state->native || has_native_steps(p);
    if (!native && note)
        *note = state->why;
    return native;
}

void ad_native_lazy(ad_program *p)
{
    for (size_t k = 0; p && k < p->n_scans; k++)
        ad_native_lazy(ad_step_program(p, k));
    struct state *state = p ? state_of(p) : NULL;
    if (!state || state->native || is_refused(p, &state->why))
        return;
    state->price = least_to_compile(p);
    note_too_few(p, state->price, &state->why);
}

/* ---- whether it is faster, measured once ---- */

static void interpret(struct state *state)
{
    ad_native_free(state->native);
    state->native = NULL;
}

/* CPU time of what machine code replaces among segments [first, last). A run behind this computes
   all that it leaves in memory anew. */
static double seconds_of(const ad_program *p, const struct segment *segments, size_t first,
                         size_t last)
{
    double began = ad_thread_seconds();
    for (size_t i = first, n; i < last; i += n + 1) {
        for (n = 0; i + n < last && (segments[i + n].fused || segments[i + n].pass); n++)
            ;
        ad_execute(p, segments, i, i + n, NULL);
    }
    return ad_thread_seconds() - began;
}

/* Times both in turn and goes back to the interpreter where it is faster, which is noted in the
   cache: the next process takes the same, and gets the same bits. */
static void choose(ad_program *p, struct state *state, bool again, size_t first, size_t last)
{
    enum { LEAST_ROUNDS = 3, MOST_ROUNDS = 50 };
    static const double NOISE = 1.05;
    const struct native *native = state->native;
    double machine = INFINITY, interpreter = INFINITY, spent = 0;
    size_t threads = p->threads;
    p->threads = 1;
    for (size_t k = 0; k < LEAST_ROUNDS || (k < MOST_ROUNDS && spent < state->budget); k++) {
        double a = seconds_of(p, native->segments, again ? native->n_held : 0, native->n_segments);
        double b = seconds_of(p, p->segments, first, last);
        machine = fmin(machine, a);
        interpreter = fmin(interpreter, b);
        spent += a + b;
    }
    p->threads = threads;
    state->budget = 0;
    if (machine <= NOISE * interpreter)
        return;
    ad_native_mark_slow(native->key);
    note_slow(&state->why);
    interpret(state);
}

/* Adds the seconds that machine code would have saved, and compiles once they exceed the cost. */
static const struct segment *prepare(ad_program *p, bool again, size_t *first, size_t *last)
{
    struct state *state = p->back_end_state;
    if (state->price > 0) {
        state->saved += seconds_saved(p, *first);
        if (state->saved > state->price)
            compile(p, state, state->saved);
    }
    if (state->native && state->budget > 0)
        choose(p, state, again, *first, *last);
    if (!state->native)
        return NULL;
    *first = again ? state->native->n_held : 0;
    *last = state->native->n_segments;
    return state->native->segments;
}

const char *ad_native_note(const ad_program *p)
{
    const struct state *state = p ? p->back_end_state : NULL;
    return !p                                                ? ad_program_error(NULL)->message
           : (state && state->native) || has_native_steps(p) ? ""
           : state && *state->why.message                    ? state->why.message
                                                             : "machine code was not requested";
}

/* ---- ranks ---- */

/* Goes back to the interpreter where a rank has no machine code. */
static enum ad_status keep_common(struct ad_ranks *ranks, ad_program *p, struct ad_error *error)
{
    struct state *state = p->back_end_state;
    const bool mine = state && state->native;
    double all = mine;
    for (size_t k = 0; k < p->n_scans && error->status == AD_OK; k++)
        keep_common(ranks, ad_step_program(p, k), error);
    if (error->status == AD_OK && ad_ranks_least(ranks, 1, &all, error) == AD_OK && all < mine) {
        ad_fail(&state->why, AD_E_ARGUMENT, "another rank has no machine code");
        interpret(state);
    }
    return error->status;
}

enum ad_status ad_native_ranks(struct ad_ranks *ranks, ad_program *p, double runs,
                               struct ad_error *error)
{
    if (AD_LACKS(error, p) || (ranks && ad_ranks_check(ranks, error) != AD_OK))
        return error->status;
    const bool decides = !ranks || ranks->rank == 0;
    bool native = decides && ad_native(p, runs, NULL);
    if (native)
        ad_run(p); /* and measures */
    if (ad_ranks_broadcast(ranks, 0, &native, sizeof native, error) != AD_OK || !native)
        return error->status;
    if (!decides)
        ad_native(p, INFINITY, NULL);
    return keep_common(ranks, p, error);
}
