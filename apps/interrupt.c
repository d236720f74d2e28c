/* Ctrl-C (interrupt.h). A signal handler reaches nothing but a static. */
#include "interrupt.h"

#include <signal.h>
#include <stddef.h>

static volatile sig_atomic_t came;

static void note(int signal)
{
    (void)signal;
    came = 1;
}

void interrupt_catch(void)
{
    struct sigaction action = {.sa_handler = note};
    action.sa_flags = (int)(SA_RESETHAND | SA_RESTART); /* the second one kills, as without us */
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

bool interrupted(void) { return came; }
