/* Signals that end the program (interrupt.h). Handlers use static variables and async-signal-safe
   functions only. */
#include "interrupt.h"
#include "quote.h"
#include "autodiff/native/process.h"
#include "physics/io/hdf5_file.h"

#include <ctype.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

/* One request may arrive twice: timeout(1) signals the process and then its group. */
static const double ECHO = 0.5; /* s */

/* For a run to look and to begin with its results, so that all ends within a second. One that has
   not had that much of a processor, on a busy machine or behind gnuplot, has longer; one that waits
   for something else has not. */
static const struct itimerval DEADLINE = {{.tv_usec = 100000}, {.tv_usec = 700000}}, NEVER;
static const double ENOUGH = 0.35, NONE = 1e-3 /* s of CPU time */, AT_MOST = 8 /* s */;

static const int orderly[] = {SIGINT, SIGTERM}, at_once[] = {SIGHUP, SIGPIPE, SIGQUIT, SIGXCPU},
                 crashes[] = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE};

enum {
    N_ORDERLY = sizeof orderly / sizeof *orderly,
    N_AT_ONCE = sizeof at_once / sizeof *at_once,
    N_CRASHES = sizeof crashes / sizeof *crashes
};

static volatile sig_atomic_t came, catching, looked;
static volatile pid_t running;
static char *_Atomic whole;         /* names of the files that are */
static struct timespec first, used; /* by then */
static char stack[1 << 16]; /* of the handler of crashes: the other one may have overflowed */

static double since(clockid_t clock, const struct timespec *then)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)(now.tv_sec - then->tv_sec) + 1e-9 * (double)(now.tv_nsec - then->tv_nsec);
}

static sigset_t all_signals(void)
{
    sigset_t set;
    sigemptyset(&set);
    for (size_t k = 0; k < N_ORDERLY; k++)
        sigaddset(&set, orderly[k]);
    for (size_t k = 0; k < N_AT_ONCE; k++)
        sigaddset(&set, at_once[k]);
    return set;
}

/* Errors of writing are ignored. */
static void put(const char *text)
{
    if (write(STDERR_FILENO, text, strlen(text)) < 0)
        return;
}

/* Ends the process as the signal does by default, so that its parent sees which it was. */
static void end(int number)
{
    struct sigaction action = {.sa_handler = SIG_DFL};
    sigset_t set;
    const char *names = whole;
    bool unfinished = phys_atomic_file_abandon_all();
    ad_native_abandon();
    if (running)
        kill(running, SIGTERM);
    if (unfinished && names) {
        put("leastaction: ended by a signal; these files are complete:");
        put(names);
    }
    sigemptyset(&action.sa_mask);
    sigaction(number, &action, NULL);
    sigemptyset(&set);
    sigaddset(&set, number);
    raise(number);
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
}

static void note(int number)
{
    if (!catching || !looked || (came && since(CLOCK_MONOTONIC, &first) > ECHO)) {
        end(number);
    } else if (!came) {
        came = number;
        clock_gettime(CLOCK_MONOTONIC, &first);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
        setitimer(ITIMER_REAL, &DEADLINE, NULL);
    }
}

/* The run has not come to its results: it hangs in a library, or a step of it takes long. */
static void end_overdue(int number)
{
    const double cpu = since(CLOCK_PROCESS_CPUTIME_ID, &used);
    (void)number;
    if (cpu > ENOUGH || (cpu < NONE && !running) || since(CLOCK_MONOTONIC, &first) > AT_MOST)
        end(came);
}

/* HDF5 crashes on some damaged files. Other crashes go on as they do by default. */
static void crash(int number)
{
    const char *file = phys_hdf5_reading();
    if (!file) {
        signal(number, SIG_DFL);
        return;
    }
    phys_atomic_file_abandon_all();
    put("leastaction: ");
    for (char letter[2] = ""; (*letter = *file); file++)
        put(iscntrl((unsigned char)*letter) ? "?" : letter);
    put(": HDF5 crashed while reading it; expected an undamaged HDF5 file\n");
    _exit(2);
}

static void handle(int number, void (*handler)(int), int flags)
{
    struct sigaction action = {.sa_handler = handler, .sa_flags = flags};
    action.sa_mask = all_signals();
    sigaction(number, &action, NULL);
}

void interrupt_start(void)
{
    struct sigaction before;
    for (size_t k = 0; k < N_ORDERLY; k++)
        handle(orderly[k], note, SA_RESTART);
    for (size_t k = 0; k < N_AT_ONCE; k++) /* nohup has some of them ignored */
        if (sigaction(at_once[k], NULL, &before) == 0 && before.sa_handler != SIG_IGN)
            handle(at_once[k], end, SA_RESTART);
    handle(SIGXFSZ, SIG_IGN, SA_RESTART);
    handle(SIGALRM, end_overdue, SA_RESTART);
    sigaltstack(&(stack_t){.ss_sp = stack, .ss_size = sizeof stack}, NULL);
    for (size_t k = 0; k < N_CRASHES; k++)
        handle(crashes[k], crash, SA_ONSTACK);
}

void interrupt_catch(void)
{
    looked = 0;
    catching = 1;
}

bool interrupted(void)
{
    looked = 1;
    return came;
}

bool interrupt_proceed(void *unused)
{
    (void)unused;
    return !interrupted();
}

void interrupt_finish(void) { setitimer(ITIMER_REAL, &NEVER, NULL); }

/* No signal comes between its start and the note of it. */
int interrupt_start_program(const char *const words[], int output, pid_t *child)
{
    sigset_t set = all_signals(), before;
    sigaddset(&set, SIGALRM);
    pthread_sigmask(SIG_BLOCK, &set, &before);
    int reason = ad_process_start(words, output, &before, child);
    if (reason == 0)
        running = *child;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return reason;
}

void interrupt_forget(void) { running = 0; }

enum ad_status interrupt_commit(struct phys_atomic_file *file, struct ad_error *error)
{
    char *text = NULL, *earlier = whole;
    size_t length;
    FILE *names = file->target ? open_memstream(&text, &length) : NULL;
    if (names) {
        fprintf(names, "%.*s ", earlier ? (int)strlen(earlier) - 1 : 0, earlier ? earlier : "");
        quote_terminal(names, file->target);
        fputc('\n', names);
        fclose(names);
    }
    enum ad_status status = phys_atomic_file_commit(file, error);
    if (status == AD_OK && text) {
        whole = text;
        text = earlier;
    }
    free(text);
    return status;
}
