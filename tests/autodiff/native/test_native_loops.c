/* Random programs of few rows, whose segments share one loop over columns
   (autodiff/native/loops.c): sums over rows, gathers, scatters, views, neighbouring columns and
   their adjoints, first and second derivatives, any number of columns, in passes and not, both
   types, all instruction sets; results stored past the caches and not. Machine code against the
   interpreter, and the same bits on several threads. By hand: test_native_loops PROGRAMS SEED, by
   CC and with its optimization. */
#include "native_batch.h"
#include "tests/autodiff/support.h"
#include "tests/native.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BEYOND_CACHES = 1 << 30 };
enum { MOST = 60, INPUTS = 3, OUTPUTS = 6, MOST_COLUMNS = 140, PASS_COLUMNS = 64 };

struct subject {
    uint64_t seed, random;
    ad_tape *tape;
    size_t n, cols, n_out;
    ad_var in[INPUTS], wide[MOST], out[OUTPUTS];
    double *at[INPUTS];
    ad_program *program, *compiled;
    bool joined, beyond; /* segments share a loop; in blocks, with columns beyond them */
    bool streamed;       /* results are stored past the caches */
};

static ad_var any(struct subject *s)
{
    size_t recent = s->n < 4 ? s->n : 4;
    return s->wide[below(&s->random, 2) ? s->n - 1 - below(&s->random, recent)
                                        : below(&s->random, s->n)];
}

static ad_var with_rows(struct subject *s, size_t rows)
{
    ad_var x = any(s);
    uint32_t list[8];
    for (size_t r = 0; r < rows; r++)
        list[r] = (uint32_t)below(&s->random, ad_rows(x));
    return ad_rows(x) == rows ? x : ad_gather_rows(x, rows, list);
}

static ad_var scattered(struct subject *s)
{
    ad_var x = any(s), y = with_rows(s, ad_rows(x));
    uint32_t a[24], b[24];
    for (size_t r = 0; r < ad_rows(x); r++) {
        a[r] = (uint32_t)below(&s->random, 5);
        b[r] = (uint32_t)below(&s->random, 5);
    }
    return ad_sub(ad_scatter_rows(x, a, 5), ad_scatter_rows(ad_mul(x, y), b, 5));
}

static ad_var step(struct subject *s)
{
    ad_var x = any(s), y = with_rows(s, ad_rows(x));
    bool repeat = below(&s->random, 2);
    switch (below(&s->random, 10)) {
    case 0:
        return repeat ? ad_diff(x, 0.5, true) : ad_slice_cols(ad_diff(x, 0.5, true), 0, s->cols);
    case 1:
        return ad_diff_adjoint(x, 0.5, true, s->cols);
    case 2:
        return ad_sum_rows(ad_mul(x, y));
    case 3:
        return ad_mul(ad_slice_rows(any(s), 0, 1), x);
    case 4:
        return scattered(s);
    case 5:
        return ad_div(ad_sin(x), ad_add(1.5, ad_square(y)));
    case 6:
        return ad_mul(x, ad_slice_rows(s->in[2], 0, ad_rows(x)));
    case 7:
        return ad_rows(x) + ad_rows(y) < 8 ? ad_concat_rows(2, (ad_var[]){ad_cos(x), y})
                                           : ad_slice_rows(x, 1, 2);
    case 8:
        return ad_sqrt(ad_add(0.5, ad_add(ad_square(x), ad_square(y))));
    default:
        return ad_mul(ad_cos(x), ad_sub(y, 0.3));
    }
}

static void record(struct subject *s)
{
    size_t rows = 1 + below(&s->random, 5);
    s->tape = ad_tape_new(s->seed % 5 == 4 ? AD_F32 : AD_F64);
    s->cols = s->seed % 3 ? 9 + below(&s->random, MOST_COLUMNS) : PASS_COLUMNS + s->seed % 41;
    for (size_t k = 0; k < INPUTS; k++) {
        size_t r = k < 2 ? rows : 8, c = k < 2 ? s->cols : 1;
        s->in[k] = ad_input(s->tape, r, c, NULL);
        s->at[k] = random_values(&s->random, r * c, -1, 1);
    }
    s->wide[s->n++] = s->in[0];
    s->wide[s->n++] = s->in[1];
    for (size_t k = 3 + below(&s->random, 12); k > 0; k--) {
        s->wide[s->n] = step(s);
        assert_tape_ok(s->tape);
        s->n++;
    }
    ad_var y = weighted_sum(ad_sin(s->wide[s->n - 1]));
    y = ad_add(y, ad_sum(ad_square(any(s))));
    s->out[s->n_out++] = y;
    s->out[s->n_out++] = any(s);
    ad_grad(y, 2, s->in, s->out + s->n_out);
    s->n_out += 2;
    if (s->seed % 2)
        ad_grad(weighted_sum(s->out[2]), 2, s->in, s->out + s->n_out), s->n_out += 2;
    assert_tape_ok(s->tape);
}

static void open_subject(struct subject *s, uint64_t seed)
{
    static const char *const columns[] = {"16", "32", "48"};
    static const char *const isas[] = {"avx512", "avx2", "avx512", "base"};
    *s = (struct subject){.seed = seed, .random = seed};
    record(s);
    if (seed % 3 == 0)
        setenv("LEASTACTION_COLUMNS", columns[seed / 3 % 3], 1);
    setenv("LEASTACTION_ISA", isas[seed % LENGTH(isas)], 1);
    s->program = compile(s->tape, s->n_out, s->out);
    s->compiled = compile(s->tape, s->n_out, s->out);
    unsetenv("LEASTACTION_COLUMNS");
    unsetenv("LEASTACTION_ISA");
    for (size_t k = 0; k < INPUTS; k++) {
        ad_set(s->program, s->in[k], s->at[k]);
        ad_set(s->compiled, s->in[k], s->at[k]);
    }
    if (seed / 2 % 2) /* as if it held so much */
        s->compiled->memory_bytes += BEYOND_CACHES;
    struct native native = {0};
    char *text = ad_native_source(s->compiled, &native);
    assert_non_null(text);
    s->joined = strstr(text, "void j");
    s->beyond = strstr(text, "if (col) s");
    s->streamed = strstr(text, "\nstream");
    free(text);
    free(native.segments);
}

static void close_subject(struct subject *s)
{
    ad_program_free(s->program);
    ad_program_free(s->compiled);
    ad_tape_free(s->tape);
    for (size_t k = 0; k < INPUTS; k++)
        free(s->at[k]);
}

static double *values(const ad_program *p, ad_var x)
{
    double *v = malloc(ad_rows(x) * ad_cols(x) * sizeof *v);
    assert_non_null(v);
    assert_int_equal(ad_get(p, x, v), AD_OK);
    return v;
}

/* Sums that cancel keep the rounding of their terms. */
static void compare(const struct subject *s, size_t k)
{
    double *a = values(s->program, s->out[k]), *b = values(s->compiled, s->out[k]), largest = 1;
    double tolerance = s->seed % 5 == 4 ? 1e-4 : 1e-12;
    size_t n = ad_rows(s->out[k]) * ad_cols(s->out[k]);
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(a[i]));
    for (size_t i = 0; i < n; i++)
        if (!(fabs(a[i] - b[i]) <= tolerance * largest))
            fail_msg("program %llu, output %zu, element %zu of %zu columns: %.17g, interpreted "
                     "%.17g",
                     (unsigned long long)s->seed, k, i, s->cols, b[i], a[i]);
    free(a);
    free(b);
}

static void check(struct subject *s)
{
    double *before[OUTPUTS];
    ad_run(s->program);
    ad_run(s->compiled);
    for (size_t k = 0; k < s->n_out; k++) {
        compare(s, k);
        before[k] = values(s->compiled, s->out[k]);
    }
    ad_set_threads(s->compiled, 2);
    ad_run(s->compiled);
    for (size_t k = 0; k < s->n_out; k++) {
        double *now = values(s->compiled, s->out[k]);
        if (memcmp(before[k], now, ad_rows(s->out[k]) * ad_cols(s->out[k]) * sizeof *now))
            fail_msg("program %llu: other bits on two threads", (unsigned long long)s->seed);
        free(now);
        free(before[k]);
    }
}

static uint64_t programs = 32, first; /* of 96: FUZZ_SHARE, 0 to 2, says which */

static void test_random(void **state)
{
    static struct subject subjects[BATCH_PROGRAMS];
    size_t joined = 0, beyond = 0, streamed = 0, done = 0;
    (void)state;
    native_need_compiler();
    while (done < programs) {
        struct native_batch batch = {0};
        size_t n = programs - done < BATCH_PROGRAMS ? programs - done : BATCH_PROGRAMS;
        for (size_t k = 0; k < n; k++) {
            open_subject(&subjects[k], first + done + k);
            native_batch_add(&batch, subjects[k].compiled);
            joined += subjects[k].joined;
            beyond += subjects[k].beyond;
            streamed += subjects[k].streamed;
        }
        assert_true(native_batch_load(&batch));
        for (size_t k = 0; k < n; k++)
            check(&subjects[k]);
        for (size_t k = 0; k < n; k++)
            close_subject(&subjects[k]);
        native_batch_release(&batch);
        done += n;
    }
    print_message(
        "%zu of %zu programs have segments that share a loop, %zu columns beyond blocks, %zu store "
        "past the caches\n",
        joined, done, beyond, streamed);
    assert_true(joined > programs / 2 && beyond > programs / 40 && streamed > programs / 40);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random)};
    const char *share = getenv("FUZZ_SHARE");
    programs = argc > 1 ? strtoull(argv[1], NULL, 10) : programs;
    first = argc < 2 && share ? programs * (strtoull(share, NULL, 10) % 3) : 0;
    first = argc > 2 ? strtoull(argv[2], NULL, 10) : first;
    return cmocka_run_group_tests(tests, argc > 1 ? native_open_cache : native_open_quick,
                                  native_remove_cache);
}
