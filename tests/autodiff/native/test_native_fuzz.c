/* Random programs by every back end against a plain evaluation, each within what rounding explains:
   machine code, the interpreter, 1 and 2 threads, runs again with held inputs.

       test_native_fuzz                    300 seeds, of which a third becomes machine code, by the
                                           compiler without optimization: FUZZ_SHARE, 0 to 2, says
                                           which, so that three builds compile all of them once
       test_native_fuzz PROGRAMS SEED      any number from SEED on, by CC; prints what fails
       test_native_fuzz PROGRAMS SEED -O0  the same, as cheap as the 300

   A failure names its seed: test_native_fuzz 1 SEED shows it again. Where FUZZ_INTERPRETED is set
   nothing is compiled: for kernels that were built otherwise. */
#include "native_batch.h"
#include "tests/autodiff/programs/random_tape.h"
#include "tests/native.h"
#include "autodiff/internal.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LONG = 512 }; /* instructions: where segments are cut into parts */

struct counts {
    size_t programs, failed, is_long, native, elements, vague;
    bool seen[AD_N_OPS]; /* in the recordings */
};

/* A third is long; some have up to 6000 nodes, one of two thousand up to 70 000. */
static bool has_to_be_long(uint64_t seed) { return seed % 3 == 0; }

static size_t nodes_of(uint64_t seed)
{
    uint64_t random = seed + 99;
    double least = has_to_be_long(seed) ? 400 : 1, most = has_to_be_long(seed) ? 500 : 100;
    if (seed % 180 == 1)
        most = seed % 1980 == 1 ? 70000 : 6000;
    return (size_t)(least * pow(most / least, (double)(random * 7919 % 1000) / 999));
}

/* ---- comparisons ---- */

struct run {
    const char *name;
    ad_program *program;
};

static bool complain(uint64_t seed, const char *what, const struct run *run, size_t out, size_t i,
                     double got, double expected)
{
    fprintf(stderr,
            "seed %llu: %s: %s: output %zu, element %zu: %.17g, not %.17g\n"
            "  again: test_native_fuzz 1 %llu\n",
            (unsigned long long)seed, what, run->name, out, i, got, expected,
            (unsigned long long)seed);
    return false;
}

/* Within twice the bound: both round. A bound that says little is counted as vague. */
static bool near(const struct random_tape *r, const struct run *run, uint64_t seed,
                 struct counts *counts)
{
    for (size_t k = 0; k < r->n_out; k++) {
        size_t n = ad_rows(r->out[k]) * ad_cols(r->out[k]);
        const double *value = r->plain.value[r->out[k].id], *error = r->plain.error[r->out[k].id];
        double *got = malloc(n * sizeof *got), largest = 0;
        if (!got || ad_get(run->program, r->out[k], got) != AD_OK)
            return complain(seed, "not there", run, k, 0, 0, 0);
        for (size_t i = 0; i < n; i++)
            largest = fmax(largest, isfinite(value[i]) ? fabs(value[i]) : 0);
        for (size_t i = 0; i < n; i++) {
            bool good = isinf(error[i]) || fabs(got[i] - value[i]) <= 2 * error[i];
            counts->elements++;
            counts->vague += error[i] > 1e-2 * largest;
            if (!good) {
                complain(seed, "values", run, k, i, got[i], value[i]);
                fprintf(stderr, "  bound %.3g, off by %.3g\n", error[i], got[i] - value[i]);
                free(got);
                return false;
            }
        }
        free(got);
    }
    return true;
}

static double *all_outputs(const struct random_tape *r, const ad_program *p, size_t *n)
{
    double *all = NULL;
    *n = 0;
    for (size_t k = 0; k < r->n_out; k++)
        *n += ad_rows(r->out[k]) * ad_cols(r->out[k]);
    all = malloc(*n * sizeof *all);
    for (size_t k = 0, at = 0; all && k < r->n_out;
         at += ad_rows(r->out[k]) * ad_cols(r->out[k]), k++)
        ad_get(p, r->out[k], all + at);
    return all;
}

static bool same_bits(const struct random_tape *r, const struct run *run, const double *before,
                      uint64_t seed, const char *what)
{
    size_t n, at = 0;
    double *now = all_outputs(r, run->program, &n);
    if (!now || !before)
        return false;
    while (at < n && (now[at] == before[at] || (isnan(now[at]) && isnan(before[at]))))
        at++;
    bool same = at == n || complain(seed, what, run, 0, at, now[at], before[at]);
    free(now);
    return same;
}

/* ---- one program ---- */

static void set(const struct random_tape *r, ad_program *p, size_t first, int values)
{
    for (size_t k = first; k < r->n_inputs; k++)
        ad_set(p, r->in[k], r->values[values][k]);
}

static bool check_run(const struct random_tape *r, const struct run *run, uint64_t seed,
                      struct counts *counts)
{
    size_t n;
    set(r, run->program, 0, 0);
    ad_run(run->program);
    double *before = all_outputs(r, run->program, &n);
    bool good = near(r, run, seed, counts);
    ad_set_threads(run->program, 2);
    ad_run(run->program);
    good = good && same_bits(r, run, before, seed, "two threads");
    free(before);
    set(r, run->program, r->n_held, 1);
    ad_rerun(run->program);
    before = all_outputs(r, run->program, &n);
    ad_run(run->program);
    good = good && same_bits(r, run, before, seed, "run, after a run again");
    free(before);
    return good;
}

/* No output may need most of what was recorded: then there is more of it. */
static void record(struct random_tape *r, uint64_t seed)
{
    size_t nodes = nodes_of(seed), instructions = LONG + 1;
    ad_program *p;
    random_tape_init(r, seed, nodes);
    for (int attempt = 0; attempt < 12 && has_to_be_long(seed); attempt++) {
        if (ad_compile(r->tape, r->n_out, r->out, &p) == AD_OK)
            instructions = ad_program_info(p).instructions;
        ad_program_free(p);
        if (instructions > LONG)
            return;
        random_tape_release(r);
        nodes += nodes / 32 + nodes * (LONG - instructions) / (instructions + LONG);
        random_tape_init(r, seed, nodes);
    }
}

/* ---- batches ---- */

/* Machine code of one program among many can crash: the handler names which. */
static volatile uint64_t checked;

static void name_crash(int signal)
{
    fprintf(stderr, "seed %llu: signal %d\n", (unsigned long long)checked, signal);
    _exit(3);
}

struct subject {
    uint64_t seed;
    struct random_tape r;
    ad_program *program; /* to be compiled; NULL where the seed has failed before */
};

enum { MOST_COMPILED = 65000 }; /* instructions; the library refuses a few more */

static ad_program *compile(const struct subject *s)
{
    ad_program *p = NULL;
    if (ad_compile(s->r.tape, s->r.n_out, s->r.out, &p) != AD_OK)
        fprintf(stderr, "seed %llu: %s\n", (unsigned long long)s->seed,
                ad_tape_error(s->r.tape)->message);
    return p;
}

/* Interpreted; unless that is all, what is left is the program for machine code. */
static void check_interpreted(struct subject *s, uint64_t seed, bool interpreted,
                              struct counts *counts)
{
    static const char *const isas[] = {"avx512", "avx2", "base"};
    static const char *const columns[] = {"0", "16", "48", "100"};
    setenv("LEASTACTION_ISA", isas[seed % 5 > 2 ? 0 : seed % 5], 1);
    setenv("LEASTACTION_COLUMNS", columns[seed % 4], 1);
    s->seed = seed;
    record(&s->r, seed);
    for (uint32_t id = 0; id < s->r.tape->n_nodes; id++)
        counts->seen[node_at(s->r.tape, id)->op] = true;
    struct run run = {"interpreted", compile(s)};
    counts->programs++;
    counts->is_long += run.program && ad_program_info(run.program).instructions > LONG;
    bool good = run.program && check_run(&s->r, &run, seed, counts);
    counts->failed += !good;
    s->program = good && !interpreted ? compile(s) : NULL;
    ad_program_free(run.program);
    unsetenv("LEASTACTION_ISA");
    unsetenv("LEASTACTION_COLUMNS");
}

static void check_compiled(size_t n, struct subject s[], struct counts *counts)
{
    struct native_batch batch = {0};
    bool in[BATCH_PROGRAMS] = {false};
    for (size_t k = 0; k < n; k++)
        in[k] = s[k].program && ad_program_info(s[k].program).instructions <= MOST_COMPILED &&
                native_batch_add(&batch, s[k].program);
    bool loaded = native_batch_load(&batch);
    if (!loaded)
        fprintf(stderr, "seeds %llu to %llu: not compiled\n", (unsigned long long)s[0].seed,
                (unsigned long long)s[n - 1].seed);
    for (size_t k = 0; k < n; k++) {
        struct run run = {"machine code", s[k].program};
        checked = s[k].seed;
        if (in[k]) {
            counts->native += loaded;
            counts->failed += !loaded || !check_run(&s[k].r, &run, s[k].seed, counts);
        }
        ad_program_free(s[k].program);
    }
    native_batch_release(&batch);
}

/* ---- many ---- */

static struct counts check_seeds(uint64_t first, size_t n, bool interpreted)
{
    struct subject *subjects = calloc(BATCH_PROGRAMS, sizeof *subjects);
    struct counts counts = {0};
    if (!subjects)
        abort();
    for (size_t done = 0, batch; done < n; done += batch) {
        batch = n - done < BATCH_PROGRAMS ? n - done : BATCH_PROGRAMS;
        memset(subjects, 0, BATCH_PROGRAMS * sizeof *subjects);
        for (size_t k = 0; k < batch; k++)
            check_interpreted(&subjects[k], first + done + k, interpreted, &counts);
        if (!interpreted)
            check_compiled(batch, subjects, &counts);
        for (size_t k = 0; k < batch; k++)
            random_tape_release(&subjects[k].r);
        if (n > 300 && done / 480 < (done + batch) / 480)
            fprintf(stderr, "%zu programs, %zu failed\n", counts.programs, counts.failed);
    }
    free(subjects);
    return counts;
}

static void test_programs(void **state)
{
    (void)state;
    native_need_compiler();
    native_quick_compiler();
    enum { SHARES = 3, SHARE = 100 };
    const char *given = getenv("FUZZ_SHARE");
    unsigned long own = given ? strtoul(given, NULL, 10) : 0;
    size_t is_long = 0;
    for (unsigned long k = 0; k < SHARES; k++) {
        struct counts counts = check_seeds(2 + SHARE * k, SHARE, k != own % SHARES);
        assert_int_equal(counts.failed, 0);
        assert_true(k != own % SHARES || counts.native > 90); /* some have nothing to compile */
        assert_true(counts.vague < counts.elements / 10);
        is_long += counts.is_long;
        for (enum ad_op op = 0; op < AD_N_OPS; op++)
            if (!counts.seen[op] && op != AD_OP_scan && op != AD_OP_scan_adjoint)
                fail_msg("%s is in no program", ad_op_name(op)); /* loops: test_scan */
    }
    assert_true(is_long >= 100);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_programs)};
    void *state = NULL;
    if (argc < 3)
        return cmocka_run_group_tests(tests, native_open_cache, native_remove_cache);
    if (native_open_cache(&state) != 0)
        return 2;
    signal(SIGSEGV, name_crash);
    signal(SIGFPE, name_crash);
    signal(SIGILL, name_crash);
    if (argc > 3)
        native_quick_compiler();
    struct counts counts = check_seeds(strtoull(argv[2], NULL, 10), strtoull(argv[1], NULL, 10),
                                       getenv("FUZZ_INTERPRETED"));
    printf("%zu programs, %zu of more than %d instructions, %zu as machine code, %zu elements "
           "compared, %.2g of them with a bound over 1 %%: %zu failed\n",
           counts.programs, counts.is_long, LONG, counts.native, counts.elements,
           (double)counts.vague / (double)(counts.elements + 1), counts.failed);
    native_remove_cache(&state);
    return counts.failed != 0;
}
