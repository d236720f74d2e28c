/* A failing allocation, alone or with all later ones, at any moment of one run of each subcommand
   gives an error of one line, or a run that did not need it; never a crash. Some allocations of
   each run are tried; with FAULTS=100000 in the environment all of them. */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include "tests/alloc.h"
#include "tests/close.h"
#include "inject.h"
#include "shell.h"
#include "apps/command.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *const table[] = {
    "scenes",
    "build scene.c --include include --out a.so --quiet",
    "check ./good.so --entries 5",
    "path pendulum --slices 8 --out a.h5 --csv a.csv --quiet",
    "path kepler --all --slices 8 --json",
    "path pendulum --tol 1e-3 --quiet",
    "simulate kepler --samples 5 --event x=0 --out a.h5 --csv a.csv --plot a.html --reverse",
    "quantum --points 257 --steps 3 --out a.h5 --csv a.csv --quiet",
    "dataset spring --trials 2 --points 5 --out a.csv --quiet",
    "dataset pixels --trials 1 --points 3 --out a.h5 --quiet",
    "train data.csv --hidden 4 --steps 3 --test-fraction 0.2 --out a.h5 --log a.csv --quiet",
    "rollout model.h5 --x0 1,0 --time 1 --points 5 --truth spring --out a.h5 --csv a.csv --quiet",
    "field model.h5 --grid 3 --out a.h5 --csv a.csv --quiet",
    "chart ephemeris --data include/tests/data/horizons --days 5 --out . --quiet",
    "dump model.h5 --json",
    "view model.h5 --plot a.html --quiet",
    "report . --plot a.html --quiet",
    "manual path",
    "completion",
};

static size_t *calls; /* shared with children */

/* What comes after, as gcov's counts, gets its memory. */
static void report(void)
{
    *calls = alloc.calls;
    alloc = (struct alloc){0};
}

/* Exit status, or 128 + the signal; *calls: allocations it made. */
static int run(const char *line, size_t failing, bool all_after)
{
    struct words words;
    int status;
    inject_words(&words, line);
    pid_t child = fork();
    if (child == 0) {
        shell_enter();
        atexit(report);
        alloc = (struct alloc){.failing = failing, .all_after = all_after};
        exit(command_main(words.n, words.word));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    shell_read();
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

/* One line of error, or, of `check`, a report that says so. */
static bool is_explained(void)
{
    const char *err = shell_err(), *newline = strchr(err, '\n');
    return newline ? strncmp(err, "leastaction", 11) == 0 && newline[1] == '\0'
                   : strstr(shell_out(), "out of memory") != NULL;
}

static void fail_at(const char *line, size_t call, bool all_after)
{
    int status = run(line, call, all_after);
    if (status > 2 || (status && !is_explained()))
        fail_msg("%s: allocation %zu%s: status %d, '%s'", line, call, all_after ? " and after" : "",
                 status, shell_err());
}

static void test_every_allocation(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        if (run(table[k], 0, false) != 0)
            fail_msg("%s: %s", table[k], shell_err());
        size_t all = *calls, step = inject_step(all);
        for (size_t call = 1 + (inject_first(step) - 1 + k) % step; call <= all; call += step)
            fail_at(table[k], call, call / step % 2);
    }
}

static int setup(void **state)
{
    calls = mmap(NULL, sizeof *calls, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (calls == MAP_FAILED || shell_setup(state) != 0)
        return -1;
    return shell("ln -s $ROOT include && cp $ROOT/tests/apps/scenes/mass.h . && "
                 "cp $ROOT/tests/apps/scenes/good.c scene.c && "
                 "$LA build scene.c --include include --out good.so --quiet && "
                 "$LA dataset spring --trials 5 --out data.csv --quiet && "
                 "$LA train data.csv --hidden 4 --steps 3 --out model.h5 --quiet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_allocation)};
    return cmocka_run_group_tests(tests, setup, shell_teardown);
}
