/* Looks at each call between files of a function that returns a status and takes an error last,
   internal ones too: it returns the status of its error, and does not begin beside an error; else
   the test is aborted. And fails such calls on request. The linker redirects them (--wrap;
   calls.awk). */
#ifndef TESTS_CONTRACT_CALLS_H
#define TESTS_CONTRACT_CALLS_H

#include "autodiff/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { CALLS_MOST = 4096 };

struct calls {
    size_t n; /* places from which such functions were called, in the order of their first calls */
    struct {
        const void *place;
        const char *function;
    } at[CALLS_MOST];
    const void *failing; /* the next call from there fails, once; NULL: none */
};
extern struct calls *calls; /* NULL before calls_share */

void calls_share(void); /* with children */

/* For the wrapped functions. A call that fails does its work before: what it made is lost. */
enum call { CALL_CLEAN, CALL_BESIDE_ERROR, CALL_FAILS };
enum call call_begins(const char *function, const void *place, const struct ad_error *error);
enum ad_status call_ends(const char *function, enum call call, enum ad_status status,
                         struct ad_error *error);

#endif
