/* Random programs by every back end against a plain evaluation, each within what rounding explains:
   machine code, the interpreter, 1 and 2 threads, runs again with held inputs.

       test_native_fuzz                    300 seeds, the compiler without optimization
       test_native_fuzz PROGRAMS SEED      any number from SEED on, by CC; prints what fails
       test_native_fuzz PROGRAMS SEED -O0  the same, as cheap as the 300

   A failure names its seed: test_native_fuzz 1 SEED shows it again. Where FUZZ_INTERPRETED is set
   nothing is compiled: for kernels that were built otherwise. */
#include "random_tape.h"
#include "tests/native.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LONG = 512 }; /* instructions: where segments are cut into parts */

struct counts {
    size_t programs, failed, is_long, native, elements, vague;
};

/* More than a third are long; some have up to 6000 nodes, one of a thousand up to 70 000. */
static bool has_to_be_long(uint64_t seed) { return seed % 8 < 3; }

static size_t nodes_of(uint64_t seed)
{
    uint64_t random = seed + 99;
    double least = has_to_be_long(seed) ? 450 : 1, most = has_to_be_long(seed) ? 600 : 100;
    if (seed % 45 == 1)
        most = seed % 990 == 1 ? 70000 : 6000;
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
        random_tape_init(r, seed, nodes += nodes / 4);
    }
}

/* Programs of nothing that could be compiled, and those that are too long. */
static bool may_refuse(const ad_program *p, const struct ad_error *note)
{
    return ad_program_info(p).instructions > 65000 || strstr(note->message, "nothing to compile");
}

static bool check_seed(uint64_t seed, bool interpreted, struct counts *counts)
{
    static const char *const isas[] = {"avx512", "avx2", "base"};
    struct random_tape r;
    bool good = true;
    setenv("LEASTACTION_ISA", isas[seed % 5 > 2 ? 0 : seed % 5], 1);
    record(&r, seed);
    counts->programs++;
    for (int k = 0; k < 1 + !interpreted && good; k++) {
        struct run run = {k ? "machine code" : "interpreted", NULL};
        struct ad_error note = {0};
        if (ad_compile(r.tape, r.n_out, r.out, &run.program) != AD_OK) {
            fprintf(stderr, "seed %llu: %s\n", (unsigned long long)seed,
                    ad_tape_error(r.tape)->message);
            good = false;
            break;
        }
        if (k && !ad_native(run.program, INFINITY, &note) && !may_refuse(run.program, &note)) {
            fprintf(stderr, "seed %llu: not compiled: %s\n", (unsigned long long)seed,
                    note.message);
            good = false;
        }
        counts->native += k && !*ad_native_note(run.program);
        counts->is_long += !k && ad_program_info(run.program).instructions > LONG;
        good = good && check_run(&r, &run, seed, counts);
        ad_program_free(run.program);
    }
    random_tape_release(&r);
    unsetenv("LEASTACTION_ISA");
    counts->failed += !good;
    return good;
}

/* ---- many ---- */

/* The objects of programs that were checked: megabytes a hundred. */
static void empty_cache(void)
{
    char name[2 * PATH_ROOM];
    snprintf(name, sizeof name, "%s/leastaction", native_cache.text);
    DIR *folder = opendir(name);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        snprintf(name, sizeof name, "%s/leastaction/%.200s", native_cache.text, entry->d_name);
        if (entry->d_name[0] != '.')
            unlink(name);
    }
    if (folder)
        closedir(folder);
}

/* CC with -O0 behind all other flags: what the compiler's optimizer does is not tested here, and
   takes ten times as long. */
static void use_quick_compiler(void)
{
    const char *cc = getenv("CC");
    struct path name = files_temporary("quick-cc");
    FILE *script = fopen(name.text, "w");
    if (!script)
        abort();
    fprintf(script, "#!/bin/sh\nexec %s \"$@\" -O0\n", cc && *cc ? cc : "cc");
    fclose(script);
    if (chmod(name.text, 0700) != 0)
        abort();
    setenv("CC", name.text, 1);
}

static struct counts check_seeds(uint64_t first, size_t n, bool interpreted)
{
    struct counts counts = {0};
    for (uint64_t seed = first; seed < first + n; seed++) {
        check_seed(seed, interpreted, &counts);
        if (seed % 50 == 0)
            empty_cache();
        if (n > 300 && (seed - first) % 500 == 499)
            fprintf(stderr, "%zu programs, %zu failed\n", counts.programs, counts.failed);
    }
    return counts;
}

static void test_programs(void **state)
{
    (void)state;
    native_need_compiler();
    use_quick_compiler();
    struct counts counts = check_seeds(1, 300, false);
    assert_int_equal(counts.failed, 0);
    assert_true(counts.native > 270); /* some have nothing to compile */
    assert_true(counts.is_long >= 100);
    assert_true(counts.vague < counts.elements / 10);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_programs)};
    void *state = NULL;
    if (argc < 3)
        return cmocka_run_group_tests(tests, native_open_cache, native_remove_cache);
    if (native_open_cache(&state) != 0)
        return 2;
    if (argc > 3)
        use_quick_compiler();
    struct counts counts = check_seeds(strtoull(argv[2], NULL, 10), strtoull(argv[1], NULL, 10),
                                       getenv("FUZZ_INTERPRETED"));
    printf("%zu programs, %zu of more than %d instructions, %zu as machine code, %zu elements "
           "compared, %.2g of them with a bound over 1 %%: %zu failed\n",
           counts.programs, counts.is_long, LONG, counts.native, counts.elements,
           (double)counts.vague / (double)(counts.elements + 1), counts.failed);
    native_remove_cache(&state);
    return counts.failed != 0;
}
