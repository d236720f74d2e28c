/* A full disk, a failing write, sync, close or rename at each such call of one run of each writing
   subcommand, and a read-only folder: an error of one line, or a run that did not need it; existing
   files are unchanged until they are replaced by complete ones; no temporary file remains. A few
   calls of each run are tried; with FAULTS=100000 in the environment all of them. */
#include "tests/close.h"
#include "tests/files.h"
#include "inject.h"
#include "shell.h"
#include "physics/io/checksum.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_OUTPUTS = 3 };
static const char old[] = "of an earlier run\n";

static const struct {
    const char *line, *outputs[MOST_OUTPUTS];
    bool others; /* whole ones of other bytes count too: with times in them, of fewer steps */
} table[] = {
    {"build scene.c --include include --out a.so --quiet", {"a.so"}, false},
    {"path pendulum --solver adam --steps 3 --slices 8 --out a.h5 --csv a.csv --plot a.svg --quiet",
     {"a.h5", "a.csv", "a.svg"},
     false},
    {"simulate kepler --time 1 --samples 5 --out a.h5 --csv a.csv --plot a.html --quiet",
     {"a.h5", "a.csv", "a.html"},
     false},
    {"simulate kepler --time 1 --samples 5 --plot a.html --quiet", {"a.html"}, false},
    {"view model.h5 --plot a.html --quiet", {"a.html"}, false},
    {"quantum --points 257 --steps 3 --out a.h5 --csv a.csv --quiet", {"a.h5", "a.csv"}, false},
    {"dataset spring --trials 2 --points 5 --out a.csv --quiet", {"a.csv"}, false},
    {"dataset spring --trials 2 --points 5 --out a.h5 --quiet", {"a.h5"}, false},
    {"train data.csv --hidden 4 --steps 3 --checkpoint 0 --out a.h5 --log a.csv --quiet",
     {"a.h5", "a.csv"},
     true},
    {"rollout model.h5 --x0 1,0 --time 1 --points 5 --out a.h5 --csv a.csv --quiet",
     {"a.h5", "a.csv"},
     false},
    {"field model.h5 --grid 3 --out a.h5 --csv a.csv --quiet", {"a.h5", "a.csv"}, false},
    {"chart ephemeris --data include/tests/data/horizons --days 5 --out . --quiet",
     {"ephemeris.csv", "ephemeris.svg"},
     true},
    {"dump model.h5 --dataset linear1.weight --csv a.csv --quiet", {"a.csv"}, false},
};

/* ---- what a run leaves ---- */

struct output {
    char *bytes;
    size_t size;
};

static struct output output_of(const char *name)
{
    struct output o;
    o.bytes = files_read(shell_path(name), &o.size);
    return o;
}

static bool same(const struct output *a, const struct output *b)
{
    return a->size == b->size && memcmp(a->bytes, b->bytes, a->size) == 0;
}

/* A run file by its seal, a text by its last line's end. */
static bool is_whole(const char *name, const struct output *o)
{
    static const char sealed[] = "leastaction, sealed";
    struct ad_error error = {0};
    if (strstr(name, ".h5"))
        return o->size > sizeof sealed && memcmp(o->bytes, sealed, sizeof sealed - 1) == 0 &&
               phys_checksum_check(shell_path(name), name, &error) == AD_OK;
    return o->size > sizeof old && o->bytes[o->size - 1] == '\n';
}

static void put_old(size_t k)
{
    for (size_t i = 0; i < MOST_OUTPUTS && table[k].outputs[i]; i++) {
        FILE *file = fopen(shell_path(table[k].outputs[i]), "w");
        assert_true(file && fputs(old, file) >= 0 && fclose(file) == 0);
    }
}

/* The last line is the error of the command, and but for a compiler's it is the only one. */
static void assert_message(int status, const char *what)
{
    const char *err = shell_err(), *last = strstr(err, "leastaction ");
    if (!last || !strchr(last, '\n') || strchr(last, '\n')[1] != '\0')
        fail_msg("%s: exit %d, '%s' is not one line of leastaction", what, status, err);
}

static void assert_left(size_t k, int status, const struct output whole[], const char *what)
{
    const struct output earlier = {(char *)old, sizeof old - 1};
    for (size_t i = 0; i < MOST_OUTPUTS && table[k].outputs[i]; i++) {
        struct output now = output_of(table[k].outputs[i]);
        bool new = !whole            ? false
                   : table[k].others ? is_whole(table[k].outputs[i], &now)
                                     : same(&now, &whole[i]);
        if (!new && (status == 0 || !same(&now, &earlier)))
            fail_msg("%s: %s: exit %d and %s of %zu bytes instead of %zu", table[k].line, what,
                     status, table[k].outputs[i], now.size, whole ? whole[i].size : sizeof old - 1);
        free(now.bytes);
    }
}

/* ---- runs ---- */

static void fail_at(size_t k, size_t call, bool and_after, const struct output whole[],
                    size_t files)
{
    struct words words;
    struct inject inject = {.first = call, .and_after = and_after};
    char what[160];
    inject_words(&words, table[k].line);
    put_old(k);
    int status = inject_run(&words, &inject);
    snprintf(what, sizeof what, "%.60s: %s, call %zu%s", table[k].line, inject.what, call,
             and_after ? " and after" : "");
    if (status < 0 || status > 2)
        fail_msg("%s: status %d", what, status);
    if (status != 0)
        assert_message(status, what);
    assert_left(k, status, whole, what);
    if (shell_files() != files)
        fail_msg("%s: %zu files left instead of %zu", what, shell_files(), files);
}

static void test_every_call(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        struct words words;
        struct inject none = {0};
        struct output whole[MOST_OUTPUTS] = {{0}};
        inject_words(&words, table[k].line);
        put_old(k);
        int status = inject_run(&words, &none);
        if (status < 0) {
            print_message("this kernel cannot inject\n");
            skip();
        }
        if (status != 0)
            fail_msg("%s: %s", table[k].line, shell_err());
        for (size_t i = 0; i < MOST_OUTPUTS && table[k].outputs[i]; i++)
            whole[i] = output_of(table[k].outputs[i]);
        size_t files = shell_files(), step = inject_step(none.calls);
        assert_true(none.calls > 2);
        for (size_t call = inject_first(step); call <= none.calls; call += step) {
            fail_at(k, call, false, whole, files);
            if (step == 1)
                fail_at(k, call, true, whole, files);
        }
        for (size_t i = 0; i < MOST_OUTPUTS; i++)
            free(whole[i].bytes);
    }
}

/* A run that writes one file fails if any of its calls does, so that what it says is written is on
   the disk: those that sync file and folder, too. But for closing what is empty, or in place. */
static void test_no_failure_is_ignored(void **state)
{
    (void)state;
    struct words words;
    struct inject inject = {0};
    size_t syncs = 0, closes = 0;
    bool written = false;
    inject_words(&words, "dataset spring --trials 2 --points 5 --out a.csv --quiet");
    if (inject_run(&words, &inject) < 0)
        skip();
    for (size_t call = 1, calls = inject.calls; call <= calls; call++) {
        inject = (struct inject){.first = call};
        int status = inject_run(&words, &inject);
        bool closing = strcmp(inject.what, "close") == 0;
        if (status != 2 && (!closing || written))
            fail_msg("call %zu, %s, failed: exit %d", call, inject.what, status);
        closes += closing && written;
        syncs += strcmp(inject.what, "sync") == 0;
        written = strcmp(inject.what, "rename") && (written || !strcmp(inject.what, "write"));
    }
    assert_true(syncs == 2 && closes == 2);
}

static void test_read_only_folder(void **state)
{
    (void)state;
    assert_int_equal(shell("chmod 755 .."), 0);
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        struct words words;
        inject_words(&words, table[k].line);
        put_old(k);
        size_t files = shell_files();
        assert_int_equal(shell("chmod 555 ."), 0);
        int status = inject_without_rights(&words);
        assert_message(status, table[k].line);
        if (status != 2 || !strstr(shell_err(), "Permission denied"))
            fail_msg("%s: status %d, %s", table[k].line, status, shell_err());
        assert_left(k, status, NULL, table[k].line);
        assert_int_equal(shell_files(), files);
        assert_int_equal(shell("chmod 755 ."), 0);
    }
}

static int setup(void **state)
{
    if (shell_setup(state) != 0)
        return -1;
    return shell("ln -s $ROOT include && cp $ROOT/tests/apps/scenes/mass.h . && cp "
                 "$ROOT/tests/apps/scenes/good.c scene.c && "
                 "$LA dataset spring --trials 5 --out data.csv --quiet && "
                 "$LA train data.csv --hidden 4 --steps 3 --out model.h5 --quiet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_call),
                                       cmocka_unit_test(test_no_failure_is_ignored),
                                       cmocka_unit_test(test_read_only_folder)};
    return cmocka_run_group_tests(tests, setup, shell_teardown);
}
