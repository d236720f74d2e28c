/* Files that appear whole or not at all: written under a temporary name beside the target, synced,
   then renamed over it.

       struct phys_atomic_file file;
       if (phys_atomic_file_begin(&file, "run.csv", error) == AD_OK) {
           ... write to file.temporary ...
           phys_atomic_file_commit(&file, error);       or phys_atomic_file_abandon(&file)
       }

   A temporary name is .leastaction.SIXTEEN-HEX-DIGITS and the target's extension. It is random, is
   made only where no file, not even a link, has it, and is locked (flock) for as long as its
   process lives. Begin removes those in the same folder that nobody has locked: their processes
   were killed. */
#ifndef PHYSICS_WHOLE_H
#define PHYSICS_WHOLE_H

#include "autodiff/autodiff.h"

#include <stdbool.h>

struct phys_atomic_file {
    char *target;    /* symbolic links resolved; NULL after commit or abandon */
    char *temporary; /* exists, empty, from begin on; ends like the target (tools look at that) */
    int lock;        /* descriptor that holds the lock */
};

/* Creates the temporary file, so that a target that cannot be written is found before anything is
   computed: AD_E_IO with its name and the reason. A target that exists must be a regular file that
   can be written to, and its permissions stay. */
enum ad_status phys_atomic_file_begin(struct phys_atomic_file *file, const char *target,
                                      struct ad_error *error);
/* Syncs what was written, renames it to the target and syncs the folder. The file is abandoned on
   failure. Does nothing, successfully, when there is no file (target NULL). */
enum ad_status phys_atomic_file_commit(struct phys_atomic_file *file, struct ad_error *error);
/* Removes the temporary file. Does nothing when there is no file. */
void phys_atomic_file_abandon(struct phys_atomic_file *file);

/* Removes the temporary files of this process, of up to 64 files begun and not ended. For a handler
   of a signal that ends the process: calls unlink alone. Whether there were any. */
bool phys_atomic_file_abandon_all(void);

#endif
