/* Signals that end the program. None that can be caught leaves temporary files or child processes
   behind.

   SIGINT and SIGTERM end the process at once, unless a run is active that stops in order: the first
   signal then sets a flag, and ends the process if the run has not come to its results 0.7 s later,
   or up to 8 s later where the process has had less than 0.35 s of CPU time since; a second one,
   half a second later or more, ends it at once. SIGHUP, SIGPIPE, SIGQUIT and SIGXCPU
   end it at once. A file size limit (SIGXFSZ) is a failed write. A crash while HDF5 reads a file is
   an error of that file, exit status 2. */
#ifndef APPS_INTERRUPT_H
#define APPS_INTERRUPT_H

#include "physics/io/atomic_file.h"

#include <stdbool.h>
#include <sys/types.h>

/* Installs the handlers; main calls it first. */
void interrupt_start(void);
/* A run begins: from its first look at interrupted() on SIGINT and SIGTERM raise the flag. Before
   that it may hang in a library. */
void interrupt_catch(void);
/* Whether one of them came. */
bool interrupted(void);
/* That none did, as a callback of the library. */
bool interrupt_proceed(void *unused);
/* The run is over: what it has found when it was asked to end is written, however long that takes.
 */
void interrupt_finish(void);

/* ad_process_start of a program that ends with this one, until interrupt_forget. */
int interrupt_start_program(const char *const words[], int output, pid_t *child);
void interrupt_forget(void);
/* phys_atomic_file_commit. If a signal ends the process later, while other files are unfinished,
   standard error says that this one is whole. */
enum ad_status interrupt_commit(struct phys_atomic_file *file, struct ad_error *error);

#endif
