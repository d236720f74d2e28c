/* B2, E2, E6, E8: signals leave no temporary file; concurrent runs that write one file do not mix;
   files left by killed processes are removed, and nothing else is. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <string.h>

/* Waits for a temporary file, without sleeping longer than that takes. */
#define UNTIL_BEGUN "until ls -A | grep -q '^\\.leastaction\\.'; do :; done; "

static void test_signals(void **state)
{
    (void)state;
    static const char *const lines[] = {
        "chart integrators --out . --quiet",
        "chart linear --out . --quiet",
        "simulate kepler --time 1e9 --csv a.csv --out a.h5 --quiet",
    };
    for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) {
        int status = shell("$LA %s & pid=$!; " UNTIL_BEGUN "kill -TERM $pid; wait $pid", lines[k]);
        if (status != 143 && status != 1)
            fail_msg("%s: status %d", lines[k], status);
        shell_works("! ls -A | grep '^\\.'");
        shell_clean();
    }
}

/* What draws ends with the run, however early the signal comes: a gnuplot that never would. */
static void test_gnuplot_ends(void **state)
{
    (void)state;
    static const char *const lines[] = {
        "chart ephemeris --data $ROOT/tests/data/horizons --days 5 --out . --quiet",
        "path pendulum --slices 5 --plot a.svg --quiet"};
    for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) {
        shell_works("mkdir bin && printf '#!/bin/sh\\necho $$ >pid.new && mv pid.new pid\\n"
                    "exec cat never\\n' >bin/gnuplot && chmod +x bin/gnuplot && mkfifo never");
        int status = shell("PATH=$PWD/bin:$PATH $LA %s & pid=$!; until test -s pid; do :; done; "
                           "kill -TERM $pid; wait $pid; status=$?; "
                           "timeout 20 sh -c 'while grep -q \"^State:.[RSD]\" /proc/$(cat pid)/"
                           "status; do :; done' 2>/dev/null || exit 99; exit $status",
                           lines[k]);
        if (status != 143)
            fail_msg("%s: status %d", lines[k], status);
        shell_works("rm -r bin pid never; ! ls -A | grep '^\\.'");
        shell_clean();
    }
}

/* Killed: the files stay, unlocked, until the next run; those of a run that goes on stay. */
static void test_left_over(void **state)
{
    (void)state;
    shell_works("$LA chart linear --out . --quiet & pid=$!; " UNTIL_BEGUN
                "kill -KILL $pid; wait $pid; left=$(ls -A | grep '^\\.leastaction\\.') && "
                "touch .leastaction.0123456789abcde .12.a.csv "
                ".leastaction.0123456789abcdef.toolongextension1 && "
                "ln -s /nowhere .leastaction.0000000000000000.csv || exit; "
                "$LA chart linear --out . --quiet & other=$!; "
                "ours() { ls -A | grep '^\\.leastaction\\.................\\.svg$'; }; "
                "until ! ls -A | grep -qF \"$left\" && new=$(ours); do :; done; "
                "$LA path pendulum --slices 5 --csv a.csv --quiet; "
                "test \"$(ours | grep -cF \"$new\")\" = \"$(echo \"$new\" | wc -l)\"; kept=$?; "
                "kill $other; wait $other; exit $kept");
    shell_works("ls -A | grep '^\\.' | sort | tr '\\n' ' '");
    assert_string_equal(shell_out(), ".12.a.csv .leastaction.0000000000000000.csv "
                                     ".leastaction.0123456789abcde "
                                     ".leastaction.0123456789abcdef.toolongextension1 ");
}

static void test_at_once(void **state)
{
    (void)state;
    shell_works(
        "for k in 1 2 3 4 5 6 7 8 9 10 11 12; do "
        "$LA path pendulum --slices $((k + 10)) --csv a.csv --out a.h5 --quiet & done; wait; "
        "n=$(wc -l <a.csv); test $n -ge 12 && test $n -le 23 && tail -c 1 a.csv | od -c | "
        "grep -q 'n' && $LA dump a.h5 >dump && ! ls -A | grep '^\\.'");
}

/* E6: with too little memory OpenBLAS's start asks for it for ever. One signal ends that, too: what
   is asked here is that nobody has to kill the process. */
static void test_hanging_library(void **state)
{
    (void)state;
    if (SANITIZED)
        skip(); /* needs terabytes of addresses */
    int status = shell("(ulimit -v 200000; timeout -k 20 1 $LA path pendulum --out u.h5 --quiet)");
    assert_int_not_equal(status, 137);
    shell_works("! ls -A | grep '^\\.'");
}

/* B3: stages that do not end for minutes: sweeps of energies and spectra, starts of --all, matrices
   of a field. One signal ends them; nobody has to kill the process. */
static void test_long_stages(void **state)
{
    (void)state;
    static const char *const lines[] = {
        "path pendulum --all --slices 20000 --dt 0.02 --rule gauss4",
        "path dblpend --all --slices 2000 --rule gauss4",
        "path gas --slices 60 --rule gauss3",
        "simulate dblpend --time 1e7 --horizon 1e-9 --no-reference --samples 2",
    };
    for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) {
        int status = shell("timeout -s TERM -k 30 0.4 $LA %s --csv a.csv --quiet", lines[k]);
        assert_int_equal(status, 124);
        shell_works("! ls -A | grep '^\\.'");
        shell_clean();
    }
}

/* A file size limit is a failed write, and what was there stays. (libomp itself needs 1 KiB.) */
static void test_file_size_limit(void **state)
{
    (void)state;
    static const char *const options[] = {"out a.h5", "csv a.csv"};
    for (size_t k = 0; k < 2; k++) {
        shell_works("echo old >a.h5; echo old >a.csv");
        int status = shell("ulimit -f 8; $LA path pendulum --slices 401 --%s --quiet", options[k]);
        assert_in_range(status, 1, 2); /* and no signal */
        assert_mentions(shell_err(), strchr(options[k], ' ') + 1);
        shell_works("test $(cat a.h5) = old && test $(cat a.csv) = old && ! ls -A | grep '^\\.'");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_signals, shell_empty),
        cmocka_unit_test_teardown(test_gnuplot_ends, shell_empty),
        cmocka_unit_test_teardown(test_left_over, shell_empty),
        cmocka_unit_test_teardown(test_at_once, shell_empty),
        cmocka_unit_test_teardown(test_hanging_library, shell_empty),
        cmocka_unit_test_teardown(test_long_stages, shell_empty),
        cmocka_unit_test_teardown(test_file_size_limit, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
