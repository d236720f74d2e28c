/* When a program becomes machine code, when it stays interpreted and why; and a cache folder that
   was tampered with. */
#include "tests/native.h"
#include "world.h"
#include "tests/mentions.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* A program of its own for each number. */
static ad_program *numbered_program(ad_tape *tape, size_t number, ad_var *y)
{
    ad_var x = ad_input(tape, 1, 40 + number, "x");
    *y = ad_sum(ad_sin(ad_add(1.0, x)));
    ad_program *p = compile(tape, 1, y);
    return p;
}

static bool becomes_native(size_t number, struct ad_error *note)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var y;
    double value;
    ad_program *p = numbered_program(tape, number, &y);
    bool native = ad_native(p, INFINITY, note);
    ad_run(p);
    ad_get(p, y, &value);
    assert_close(value, (double)(40 + number) * sin(1), 1e-14, 0);
    ad_program_free(p);
    ad_tape_free(tape);
    return native;
}

static void assert_refused(size_t number, const char *why)
{
    struct ad_error note = {0};
    assert_false(becomes_native(number, &note));
    if (!mentions(note.message, why))
        fail_msg("the note is \"%s\", without \"%s\"", note.message, why);
}

static void assert_native(size_t number)
{
    struct ad_error note = {0};
    if (!becomes_native(number, &note))
        fail_msg("not compiled: %s", note.message);
}

static int shell(const char *format)
{
    char command[4 * PATH_ROOM];
    snprintf(command, sizeof command, format, native_cache.text, native_cache.text,
             native_cache.text);
    return system(command);
}

static void test_hurt_entries_are_made_again(void **state)
{
    static const char *const harm[] = {
        "cd %s/leastaction && for f in *.so; do truncate -s 3000 $f; done",
        "cd %s/leastaction && for f in *.so; do : >$f; done",
        "cd %s/leastaction && printf x | dd of=$(ls) bs=1 seek=4999 conv=notrunc status=none",
        "cd %s/leastaction && for f in *.so; do mv $f ../kept && ln -s ../kept $f; done",
        "chmod g+w %s/leastaction/*.so",
        "test $(id -u) != 0 || chown 65534 %s/leastaction/*.so",
        "cd %s/leastaction && for f in *.so; do rm $f; mkfifo -m 600 $f; done",
    };
    (void)state;
    native_need_compiler();
    for (size_t k = 0; k < sizeof harm / sizeof *harm; k++) {
        assert_int_equal(shell("rm -rf %s/leastaction %s/kept"), 0);
        assert_native(0);
        assert_int_equal(shell(harm[k]), 0);
        assert_native(0);
        assert_int_equal(
            shell("cd %s/leastaction && for f in *.so; do test -f $f -a ! -L $f -a "
                  "$(stat -c %%a $f) = 600 -a $(stat -c %%s $f) -gt 3000 || exit 1; done"),
            0);
    }
    assert_int_equal(shell("test $(ls %s/leastaction | wc -l) = 1"), 0); /* nothing left behind */
}

static void test_unsafe_folders(void **state)
{
    (void)state;
    assert_int_equal(shell("rm -rf %s/leastaction; mkdir -m 770 %s/leastaction"), 0);
    assert_refused(1, "cache folder");
    assert_int_equal(shell("rm -rf %s/leastaction; mkdir -m 700 %s/other; "
                           "ln -s other %s/leastaction"),
                     0);
    assert_refused(1, "cache folder");
    assert_int_equal(shell("rm -rf %s/leastaction; : >%s/leastaction"), 0);
    assert_refused(1, "cache folder");
    assert_int_equal(shell("rm -rf %s/leastaction"), 0);
}

static void test_no_compiler(void **state)
{
    (void)state;
    char *before = getenv("CC"), *kept = before ? strdup(before) : NULL;
    setenv("CC", "no-such-compiler-anywhere", 1);
    assert_refused(2, "no-such-compiler");
    char *path = strdup(getenv("PATH"));
    unsetenv("CC");
    setenv("PATH", native_cache.text, 1);
    assert_refused(2, "compiler cc");
    setenv("PATH", path, 1);
    free(path);
    setenv("CC", "false", 1); /* there, but it fails */
    assert_refused(2, "compile");
    setenv("LEASTACTION_NATIVE", "0", 1);
    assert_refused(2, "LEASTACTION_NATIVE");
    unsetenv("LEASTACTION_NATIVE");
    unsetenv("CC");
    if (kept)
        setenv("CC", kept, 1);
    free(kept);
}

/* Programs that would not run long are not compiled, but what is in the cache may be used. */
static void test_few_runs(void **state)
{
    (void)state;
    native_need_compiler();
    struct ad_error note = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var y;
    ad_program *p = numbered_program(tape, 3, &y);
    assert_false(ad_native(p, 1, &note));
    assert_mentions(note.message, "runs");
    ad_program_free(p);
    ad_tape_free(tape);
}

/* Nobody says how often it will run: after enough runs it is compiled, and goes on as before. */
static void test_in_time(void **state)
{
    enum { N = 1 << 20, MOST = 2000 };
    (void)state;
    native_need_compiler();
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, N, "x"), y = ad_sum(ad_add(1.0, ad_mul(0.5, x)));
    ad_program *p = compile(tape, 1, &y);
    size_t runs = 0;
    double value;
    assert_mentions(ad_native_note(p), "nobody");
    ad_native_in_time(p);
    assert_mentions(ad_native_note(p), "runs");
    for (; runs < MOST && *ad_native_note(p); runs++)
        ad_run(p);
    assert_in_range(runs, 2, MOST - 1);
    ad_get(p, y, &value);
    assert_close(value, N, 1e-14, 0);
    ad_program_free(p);
    ad_tape_free(tape);
}

/* A compiler would take minutes. */
static void test_large_programs_stay_interpreted(void **state)
{
    (void)state;
    struct ad_error note = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 10, "x"), y = x;
    for (size_t k = 0; k < 40000; k++)
        y = ad_add(ad_mul(0.5, y), x);
    ad_program *p = compile(tape, 1, &y);
    assert_false(ad_native(p, INFINITY, &note));
    assert_mentions(note.message, "instructions");
    ad_program_free(p);
    ad_tape_free(tape);
}

/* Processes that make the same entry at the same time all find a good one. */
static void test_several_processes(void **state)
{
    enum { PROCESSES = 4 };
    (void)state;
    native_need_compiler();
    pid_t child[PROCESSES];
    for (size_t k = 0; k < PROCESSES; k++) {
        child[k] = fork();
        assert_true(child[k] >= 0);
        if (child[k] == 0) {
            struct ad_error note = {0};
            _exit(becomes_native(4, &note) ? 0 : 1);
        }
    }
    for (size_t k = 0; k < PROCESSES; k++) {
        int status;
        assert_int_equal(waitpid(child[k], &status, 0), child[k]);
        assert_int_equal(status, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hurt_entries_are_made_again),
        cmocka_unit_test(test_unsafe_folders),
        cmocka_unit_test(test_no_compiler),
        cmocka_unit_test(test_few_runs),
        cmocka_unit_test(test_in_time),
        cmocka_unit_test(test_large_programs_stay_interpreted),
        cmocka_unit_test(test_several_processes),
    };
    return cmocka_run_group_tests(tests, native_open_cache, native_remove_cache);
}
