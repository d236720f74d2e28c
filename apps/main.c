/* The program: calls command_main, which tests call directly. */
#include "command.h"
#include "interrupt.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>

enum { STACK_KIB = 256 };

/* Less ends in a segmentation fault somewhere in a library. */
static bool has_stack(void)
{
    struct rlimit stack;
    const rlim_t least = (rlim_t)STACK_KIB * 1024;
    if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= least)
        return true;
    rlim_t given = stack.rlim_cur;
    stack.rlim_cur = stack.rlim_max;
    if (stack.rlim_max >= least && setrlimit(RLIMIT_STACK, &stack) == 0)
        return true;
    fprintf(stderr,
            "leastaction: the stack is limited to %llu KiB; expected ulimit -s %d or more\n",
            (unsigned long long)given / 1024, STACK_KIB);
    return false;
}

int main(int argc, char *argv[])
{
    interrupt_start();
    if (!has_stack())
        return WRONG_USE;
    /* Idle threads of OpenBLAS sleep; by default each spins for 30 ms first. */
    setenv("OPENBLAS_THREAD_TIMEOUT", "4", 0);
    return command_main(argc, argv);
}
