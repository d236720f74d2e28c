/* The cache of machine code: folders and entries that were tampered with, compilers, signals. */
#include "tests/native.h"
#include "tests/autodiff/programs/world.h"
#include "tests/mentions.h"

#include <fcntl.h>
#include <math.h>
#include <signal.h>
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

/* A compiler in a script: what comes instead of, or before, the system's. */
static void use_script(const char *lines)
{
    struct path script = files_temporary("script-cc");
    FILE *file = fopen(script.text, "w");
    assert_non_null(file);
    fprintf(file, "#!/bin/sh\nfor w; do test \"$before\" = -o && object=$w; before=$w; done\n%s\n",
            lines);
    assert_int_equal(fclose(file), 0);
    assert_int_equal(chmod(script.text, 0700), 0);
    setenv("CC", script.text, 1);
}

static void restore_compiler(const char *cc)
{
    if (cc)
        setenv("CC", cc, 1);
    else
        unsetenv("CC");
}

/* E9: what cannot be loaded, or lacks the functions, is not kept. */
static void test_objects_that_are_none(void **state)
{
    static const char *const bad[] = {
        "echo junk >$object",
        ": >$object",
        "echo 'int other;' | cc -shared -fPIC -x c - -o $object",
        "exit 0",
    };
    (void)state;
    native_need_compiler();
    char *cc = getenv("CC") ? strdup(getenv("CC")) : NULL;
    assert_int_equal(shell("rm -rf %s/leastaction"), 0);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct ad_error note = {0};
        use_script(bad[k]);
        assert_false(becomes_native(5, &note));
        assert_int_equal(note.status, AD_E_IO);
        assert_true(*note.message);
        assert_int_equal(shell("test -z \"$(ls %s/leastaction)\""), 0);
    }
    restore_compiler(cc);
    free(cc);
}

/* A launcher in front of it does not hide the compiler. */
static void test_each_compiler_has_its_own(void **state)
{
    static const char *const launchers[] = {"env", "env LC_ALL=C", "env"};
    (void)state;
    native_need_compiler();
    char *cc = getenv("CC") ? strdup(getenv("CC")) : NULL, command[256];
    assert_int_equal(shell("rm -rf %s/leastaction"), 0);
    for (size_t k = 0; k < sizeof launchers / sizeof *launchers; k++) {
        snprintf(command, sizeof command, "%s %s", launchers[k], cc ? cc : "cc");
        setenv("CC", command, 1);
        assert_native(3);
    }
    restore_compiler(cc);
    free(cc);
    assert_int_equal(shell("test $(ls %s/leastaction | wc -l) = 2"), 0);
}

/* E8: what killed processes left is removed by the next that compiles; what lives stays. */
static void test_left_files_are_removed(void **state)
{
    (void)state;
    native_need_compiler();
    assert_int_equal(shell("rm -rf %s/leastaction"), 0);
    assert_native(6);
    assert_int_equal(shell("cd %s/leastaction && : >0123456789abcdef.so.aB3xYz && "
                           ": >0123456789abcdef.so.aB3xYz.so && : >0123456789abcdef.so.orphan.so"
                           " && : >another-file"),
                     0);
    assert_native(6); /* from the cache: looks at nothing else */
    assert_int_equal(shell("test $(ls %s/leastaction | wc -l) = 5"), 0);
    assert_native(7);
    assert_int_equal(shell("cd %s/leastaction && test $(ls | wc -l) = 3 && test -e another-file"),
                     0);
}

/* E10: an emulator may lose the child of a fork (scripts/portability). */
static void need_fork(void)
{
    if (!getenv("NO_FORK"))
        return;
    print_message("NO_FORK is set\n");
    skip();
}

/* B2: a process that a signal ends while its compiler runs leaves nothing. */
static void on_signal(int number)
{
    (void)number;
    ad_native_abandon();
    _exit(9);
}

static void test_signal_during_compilation(void **state)
{
    int status;
    (void)state;
    native_need_compiler();
    need_fork();
    char *cc = getenv("CC") ? strdup(getenv("CC")) : NULL;
    assert_int_equal(shell("rm -rf %s/leastaction"), 0);
    use_script(": >$object; kill -TERM $PPID; exec tail -f /dev/null");
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        struct ad_error note = {0};
        signal(SIGTERM, on_signal);
        _exit(becomes_native(8, &note) ? 0 : 1);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 9);
    assert_int_equal(shell("test -z \"$(ls %s/leastaction)\""), 0);
    restore_compiler(cc);
    free(cc);
}

/* E11: XDG_CACHE_HOME counts where it is absolute; else HOME/.cache; else there is no folder. */
static void test_where_the_folder_is(void **state)
{
    static const char *const xdg[] = {"", ".", "relative/cache", NULL};
    (void)state;
    native_need_compiler();
    char *home = getenv("HOME") ? strdup(getenv("HOME")) : NULL;
    struct path own = files_temporary("home");
    for (size_t k = 0; k < sizeof xdg / sizeof *xdg; k++) {
        assert_int_equal(shell("rm -rf %s/../home; mkdir %s/../home"), 0);
        if (xdg[k])
            setenv("XDG_CACHE_HOME", xdg[k], 1);
        else
            unsetenv("XDG_CACHE_HOME");
        setenv("HOME", own.text, 1);
        assert_native(9);
        assert_int_equal(shell("cd %s/../home/.cache && test $(ls leastaction/*.so | wc -l) = 1 && "
                               "test $(stat -c %%a leastaction) = 700"),
                         0);
        setenv("HOME", "relative/home", 1);
        assert_refused(9, "no cache folder");
        setenv("HOME", "", 1);
        assert_refused(9, "no cache folder");
        unsetenv("HOME");
        assert_refused(9, "no cache folder");
    }
    assert_int_not_equal(access("relative", F_OK), 0);
    setenv("XDG_CACHE_HOME", native_cache.text, 1);
    setenv("HOME", "relative/home", 1);
    assert_native(9); /* absolute: HOME does not count */
    if (home)
        setenv("HOME", home, 1);
    else
        unsetenv("HOME");
    free(home);
}

/* Processes that make the same entry at the same time all find a good one. */
static void test_several_processes(void **state)
{
    enum { PROCESSES = 4 };
    (void)state;
    native_need_compiler();
    need_fork();
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
        cmocka_unit_test(test_each_compiler_has_its_own),
        cmocka_unit_test(test_unsafe_folders),
        cmocka_unit_test(test_no_compiler),
        cmocka_unit_test(test_objects_that_are_none),
        cmocka_unit_test(test_left_files_are_removed),
        cmocka_unit_test(test_signal_during_compilation),
        cmocka_unit_test(test_where_the_folder_is),
        cmocka_unit_test(test_several_processes),
    };
    return cmocka_run_group_tests(tests, native_open_cache, native_remove_cache);
}
