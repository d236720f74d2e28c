/* Counts the allocations of the library and the command, and fails them on request. For tests named
   test_alloc*: the linker redirects these allocations (--wrap); those of other libraries are
   unaffected. */
#ifndef TESTS_ALLOC_H
#define TESTS_ALLOC_H

#include <stdbool.h>
#include <stddef.h>

struct alloc {
    size_t calls;        /* since it was set to 0 */
    size_t failing;      /* the call that fails, counted from 1; 0: none */
    bool all_after;      /* ... and every one after it */
    size_t given, taken; /* blocks handed out and given back */
    long held, most;     /* bytes of them now, and at most */
    double marked;       /* not 0: a number, and in how many places of freed blocks it stood */
    size_t places;
};

extern struct alloc alloc;

#endif
