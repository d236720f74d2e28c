/* Each call between files that may fail is made to, once for each place it stands at: what every
   function on the way up returns is the status of its error, and none begins another such call
   first. */
#include "calls.h"
#include "jobs.h"
#include "tests/apps/inject.h"
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "apps/command.h"

#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

static void calls_fail_their_callers(void **state)
{
    (void)state;
    for (const struct job *job = jobs; job->name; job++) {
        const size_t before = calls->n;
        struct ad_error error = {0};
        if (job->run(&error) != AD_OK)
            fail_msg("%s: %s", job->name, error.message);
        for (size_t all = calls->n, k = before; k < all; k++) {
            error = (struct ad_error){0};
            calls->failing = calls->at[k].place;
            const enum ad_status status = job->run(&error);
            if (status != error.status)
                fail_msg("%s, where %s fails: returned %d, the error is %d: %s", job->name,
                         calls->at[k].function, status, error.status, error.message);
        }
        print_message("%s: %zu new places\n", job->name, calls->n - before);
    }
}

static const char *const lines[] = {
    "path pendulum --all --slices 8 --json",
    "path pendulum --tol 1e-3 --out a.h5 --csv a.csv --quiet",
    "path kepler --slices 12 --solver adam --steps 3 --json",
    "path kepler --slices 12 --solver lbfgs --steps 3 --json",
    "path spring --relate q(T)=-q(0)+1 --time 1.4 --json",
    "path spring --ends start --slices 12 --json",
    "path pendulum --slices 12 --rule gauss2 --blocks --csv b.csv --quiet",
    "path pendulum --continue g=9.81:12 --tol 1e-3 --quiet",
    "path brachistochrone --slices 12 --json",
    "simulate kepler --samples 5 --event x=0 --out a.h5 --csv a.csv --plot a.html --reverse",
    "simulate kepler --ensemble starts.csv --time 1 --samples 4 --event x=0 --csv all.csv --quiet",
    "simulate kepler --integrator verlet --dt .1 --time 1 --no-reference --json",
    "simulate kepler --integrator gauss3 --dt .1 --time 1 --no-reference --json",
    "simulate pendulum --set l=1 --periodic 2.1 --json",
    "simulate pendulum --set l=1 --mode 1 --continue energy=-9.7 --csv f.csv --quiet",
    "simulate dblpend --time 1 --lyapunov 2 --no-reference --json",
    "simulate pendulum --time 1 --sensitivity --no-reference --json",
    "simulate gas --set bodies=4 --time .1 --no-reference --json",
    "simulate ephemeris --data include/tests/data/horizons --days 2 --json",
    "path ephemeris --data include/tests/data/horizons --days 9 --json",
    "modes dblpend --json",
    "fit spring still.csv --free k --tries 1 --json",
    "check kepler --entries 5 --json",
    "quantum --points 257 --steps 3 --out a.h5 --csv a.csv --quiet",
    "quantum --scene pendulum --method fft --dt .1 --steps 2 --json --force",
    "quantum --scene double-slit --steps 74 --points 170 --json",
    "dataset spring --trials 2 --points 5 --out b.csv --quiet",
    "dataset pixels --trials 1 --points 3 --out a.h5 --quiet",
    "train data.csv --hidden 4 --steps 3 --test-fraction 0.2 --out a.h5 --log a.csv --quiet",
    "rollout model.h5 --x0 1,0 --time 1 --points 5 --truth spring --out a.h5 --csv a.csv --quiet",
    "field model.h5 --grid 3 --out a.h5 --csv a.csv --quiet",
    "simulate model.h5 --time 1 --json",
    "convert model.h5 --out model.safetensors --quiet",
    "dump model.h5 --json",
    "view model.h5 --plot a.html --quiet",
    "report . --plot a.html --quiet",
};

/* Exit status, or 128 + the signal. */
static int run(const char *line)
{
    struct words words;
    int status;
    inject_words(&words, line);
    pid_t child = fork();
    if (child == 0) {
        shell_enter();
        exit(command_main(words.n, words.word));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    shell_read();
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

static void commands_too(void **state)
{
    (void)state;
    for (size_t j = 0; j < LENGTH(lines); j++) {
        const size_t before = calls->n;
        calls->failing = NULL;
        if (run(lines[j]) > 1)
            fail_msg("%s: %s", lines[j], shell_err());
        for (size_t all = calls->n, k = before; k < all; k++) {
            calls->failing = calls->at[k].place;
            const int status = run(lines[j]);
            if (status > 2)
                fail_msg("%s, where %s fails: status %d: %s", lines[j], calls->at[k].function,
                         status, shell_err());
        }
        print_message("%s: %zu new places\n", lines[j], calls->n - before);
    }
}

static int setup(void **state)
{
    calls_share();
    if (jobs_open(state) != 0 || shell_setup(state) != 0)
        return -1;
    return shell(
        "ln -s $ROOT include && printf 'x,y,v_x,v_y\\n1,0,0,1\\n1,0,0,.9\\n' >starts.csv && "
        "$LA simulate spring --time 3 --samples 20 --csv still.csv --quiet && "
        "$LA dataset spring --trials 5 --out data.csv --quiet && "
        "$LA train data.csv --hidden 4 --steps 3 --out model.h5 --quiet");
}

/* What a call that was made to fail had made is lost. */
int __lsan_is_turned_off(void);
int __lsan_is_turned_off(void) { return 1; }

static int teardown(void **state) { return shell_teardown(state) || jobs_close(state); }

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(calls_fail_their_callers),
                                       cmocka_unit_test(commands_too)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
