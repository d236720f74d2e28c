/* Ctrl-C (interrupt.h). A signal handler reaches nothing but statics, and calls only what POSIX
   calls safe there. */
#include "interrupt.h"

#include <signal.h>
#include <stddef.h>
#include <time.h>

/* One request may arrive twice: timeout(1) signals the process and then its group. */
static const double ECHO = 0.5; /* s */

static volatile sig_atomic_t came;
static struct timespec first;

static double since_first(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)(now.tv_sec - first.tv_sec) + 1e-9 * (double)(now.tv_nsec - first.tv_nsec);
}

static void note(int number)
{
    if (!came) {
        came = 1;
        clock_gettime(CLOCK_MONOTONIC, &first);
    } else if (since_first() > ECHO) {
        signal(number, SIG_DFL);
        raise(number);
    }
}

void interrupt_catch(void)
{
    struct sigaction action = {.sa_handler = note, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    sigaddset(&action.sa_mask, SIGINT);
    sigaddset(&action.sa_mask, SIGTERM);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

bool interrupted(void) { return came; }
