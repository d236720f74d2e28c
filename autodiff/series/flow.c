/* Series of the solution of x' = y: order by order by the interpreter; by machine code where its
   cost is paid for. Both give the same bits, so that it does not matter when. */
#include "autodiff/free.h"
#include "internal.h"
#include "autodiff/kernels/kernels.h"
#include "autodiff/native/native.h"

#include <dlfcn.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Seconds: of the interpreter after which to look into the cache; and what compiling costs, with
   gcc 12. Beyond MOST_JETS it takes too long. */
static const double LOOK = 1e-4, START = 0.1, A_JET = 2.5e-3;
enum { MOST_JETS = 4096 };

void ad_series_code_free(struct series_code *code)
{
    if (!code)
        return;
    if (code->library)
        dlclose(code->library);
    AD_FREE(code->numbers, code->packs, code);
}

static size_t lanes_of(const char *isa)
{
    return strcmp(isa, "avx512") == 0 ? 8 : strcmp(isa, "avx2") == 0 ? 4 : 2;
}

/* About what the interpreter takes for an expansion, without a look at the clock, which takes as
   long as some. */
static double seconds_of(const ad_series *s, size_t order)
{
    const double k = (double)order;
    return 1e-9 * (double)s->n * (2.5 + 2 * k + 0.4 * k * k);
}

void *ad_series_load(const ad_series *s, bool many, bool build, size_t *packs,
                     ad_segment_code *functions[], struct ad_error *note)
{
    struct compiler compiler = {.identity = ""};
    if (ad_native_turned_off()) {
        ad_fail(note, AD_E_ARGUMENT, "LEASTACTION_NATIVE=0 turns machine code off");
        return NULL;
    }
    if (s->n > MOST_JETS) {
        ad_fail(note, AD_E_ARGUMENT, "%zu operations of a series; expected at most %d", s->n,
                MOST_JETS);
        return NULL;
    }
    if (!ad_cc_find(&compiler, note))
        return NULL;
    const char *isa = ad_kernels_for(AD_F64)->isa;
    void *library = NULL;
    char *source =
        ad_native_full_source(ad_series_source(s, lanes_of(isa), many, packs), isa, &compiler);
    if (source)
        library = ad_native_load(source, isa, build ? &compiler : NULL, many ? 4 : 1, functions,
                                 NULL, note);
    else
        ad_fail(note, AD_E_MEMORY, "out of memory");
    free(source);
    return library;
}

/* From the cache; compiled if not there and `build`. */
static struct series_code *load(const ad_series *s, bool build, struct ad_error *note)
{
    size_t packs = 0;
    ad_segment_code *function = NULL;
    struct series_code *code = calloc(1, sizeof *code);
    if (!code) {
        ad_fail(note, AD_E_MEMORY, "out of memory");
        return NULL;
    }
    if ((code->library = ad_series_load(s, false, build, &packs, &function, note))) {
        code->numbers = malloc((s->n + 1) * sizeof *code->numbers);
        code->packs = aligned_alloc(64, (packs + 8) * sizeof *code->packs / 64 * 64);
        if (!code->numbers || !code->packs)
            ad_fail(note, AD_E_MEMORY, "out of memory");
    }
    if (!code->library || !code->numbers || !code->packs) {
        ad_series_code_free(code);
        return NULL;
    }
    for (size_t k = 0; k < s->n; k++)
        code->numbers[k] = s->jets[k].number;
    code->run = (ad_flow_code *)(void (*)(void))function;
    return code;
}

void ad_series_interpret(ad_series *s, size_t n, size_t order, double *c)
{
    const size_t stride = s->stride;
    for (size_t i = 0; i < n; i++)
        s->coefficients[i * stride] = c[i];
    s->cut = c + n;
    s->n_cut = n;
    for (size_t k = 0; k < order; k++) {
        double *next = c + (k + 1) * n, share = 1 / (double)(k + 1);
        ad_series_advance(s, k);
        for (size_t i = 0; i < s->n_input; i++)
            s->coefficients[i * stride + k + 1] =
                s->coefficients[s->output[i] * stride + k] * share;
        for (size_t i = 0; i < n; i++)
            next[i] = s->coefficients[i * stride + k + 1];
    }
    s->cut = NULL;
    s->n_cut = 0;
}

static void run(const ad_series *s, const struct series_code *code, double *c, size_t order)
{
    code->run(ad_jet_evaluate, s->jets, s->coefficients, code->numbers, code->packs, c, order);
}

/* Whether machine code does what the interpreter makes of c[0..n-1], at all orders: compilers err.
 */
static bool agrees(ad_series *s, struct series_code *code, size_t n, const double *c)
{
    const size_t rows = (s->order + 1) * n;
    double *expected = malloc(2 * rows * sizeof *c);
    if (!expected)
        return false;
    double *got = expected + rows;
    bool same = true;
    memcpy(expected, c, n * sizeof *c);
    for (size_t i = 0; i < n; i++)
        expected[n + i] = ad_series_example_cut(c[i]);
    memcpy(got, expected, 2 * n * sizeof *c);
    ad_series_interpret(s, n, s->order, expected);
    run(s, code, got, s->order);
    for (size_t k = n; k < rows && same; k++)
        same = got[k] == expected[k] || (isnan(got[k]) && isnan(expected[k]));
    free(expected);
    return same;
}

/* Looks into the cache first, then compiles when that much was spent. */
static void try_code(ad_series *s, const double *c)
{
    struct ad_error note = {0};
    const double price = START + A_JET * (double)s->n;
    const bool build = s->next_try >= price;
    if (s->next_try > 0 && s->spent >= s->next_try) {
        s->code = load(s, build, &note);
        s->next_try = build ? INFINITY : price;
        if (s->code && !agrees(s, s->code, s->n_flow, c)) {
            ad_series_code_free(s->code);
            s->code = NULL;
            s->next_try = INFINITY;
        }
    } else if (s->next_try == 0) {
        s->next_try = LOOK;
    }
}

bool ad_series_native(ad_series *series, size_t n, struct ad_error *note)
{
    struct ad_error own = {0};
    if (!note)
        note = &own;
    if (!series)
        return ad_fail(note, AD_E_ARGUMENT, "no series (NULL)") == AD_OK;
    if (series->code && series->n_flow == n)
        return true;
    ad_series_code_free(series->code);
    series->n_flow = n;
    series->code = load(series, true, note);
    return series->code;
}

bool ad_series_compiled(const ad_series *series) { return series && series->code; }

void ad_series_flow(ad_series *series, size_t n, size_t order, double *c)
{
    if (!series || order > series->order || n > series->n_input || order == 0)
        return;
    memset(c + n, 0, n * sizeof *c);
    ad_series_flow_cut(series, n, order, c);
}

void ad_series_flow_cut(ad_series *series, size_t n, size_t order, double *c)
{
    ad_series *s = series;
    if (!s || order > s->order || n > s->n_input || order == 0)
        return;
    if (s->code && n == s->n_flow) {
        run(s, s->code, c, order);
        return;
    }
    ad_series_interpret(s, n, order, c);
    s->spent += seconds_of(s, order);
    if (!s->code && (s->n_flow == n || s->n_flow == 0)) {
        s->n_flow = n;
        try_code(s, c);
    }
}
