/* The system's C compiler, for the native back end. */
#ifndef AUTODIFF_NATIVE_CC_H
#define AUTODIFF_NATIVE_CC_H

#include "autodiff/autodiff.h"

#include <sys/types.h>

/* The compiler named by the environment (CC, or cc); false, with a reason in `note`, if there is
   none. `words` [MAX_WORDS + 1] point into `text`. */
enum { MAX_WORDS = 8 };
struct compiler {
    char text[512];
    char *words[MAX_WORDS + 1];
    char identity[512]; /* of each word: path, size, time of change */
};
bool ad_cc_find(struct compiler *compiler, struct ad_error *note);
/* The flags for an instruction set, NULL at the end. */
const char *const *ad_cc_flags(const char *isa);
/* Compiles a file to a shared object; false, with a reason in `note`, on failure. `running` is the
   compiler's process id while it runs. */
bool ad_cc_compile(const struct compiler *compiler, const char *isa, const char *source,
                   const char *object, _Atomic pid_t *running, struct ad_error *note);
/* Runs the compiler with these further words, NULL at the end; its messages go to standard error or
   are discarded. Returns the exit status, or -1. */
int ad_cc_run(const struct compiler *compiler, const char *const *arguments, bool silent);

#endif
