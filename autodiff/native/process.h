/* Starts other programs, without a shell. */
#ifndef AUTODIFF_NATIVE_PROCESS_H
#define AUTODIFF_NATIVE_PROCESS_H

#include <signal.h>
#include <sys/types.h>

/* Standard output and error of a program: a file descriptor, or one of these. */
enum { AD_OUTPUT_SHARED = -1, AD_OUTPUT_NONE = -2 };

/* Starts words[0], found along PATH, with empty standard input and these signals blocked (NULL:
   those of this thread). Returns 0 or an errno. `words` end with NULL and are not modified. */
int ad_process_start(const char *const words[], int output, const sigset_t *blocked, pid_t *child);
/* Waits for the end: exit status, or -1. */
int ad_process_wait(pid_t child);

#endif
