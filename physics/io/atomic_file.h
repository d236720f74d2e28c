/* Atomic replacement of files: the contents are written under a temporary name beside the target,
   synced, then renamed over it.

       struct phys_atomic_file file;
       if (phys_atomic_file_begin(&file, "run.csv", error) == AD_OK) {
           ... write to file.temporary ...
           phys_atomic_file_commit(&file, error);       or phys_atomic_file_abandon(&file)
       }

   A temporary name is .leastaction.SIXTEEN-HEX-DIGITS with the target's extension. It is random, is
   created only where nothing, not even a symbolic link, has that name, and is locked (flock) while
   its process lives. Begin removes unlocked ones in the same folder, which killed processes have
   left. */
#ifndef PHYSICS_IO_ATOMIC_FILE_H
#define PHYSICS_IO_ATOMIC_FILE_H

#include "autodiff/autodiff.h"

#include <stdbool.h>
#include <stddef.h>

struct phys_atomic_file {
    char *target;    /* symbolic links resolved; NULL after commit or abandon */
    char *temporary; /* exists and is empty after begin; has the target's extension, which some
                        tools need */
    int lock;        /* descriptor that holds the lock */
};

/* Creates the temporary file, so that an unwritable target is detected before anything is computed:
   AD_E_IO with its name and the reason. An existing target must be a writable regular file; its
   permissions are kept. */
enum ad_status phys_atomic_file_begin(struct phys_atomic_file *file, const char *target,
                                      struct ad_error *error);
/* Syncs the contents, renames the file to the target and syncs the folder. On failure the file is
   abandoned. Succeeds without effect when there is no file (target NULL). */
enum ad_status phys_atomic_file_commit(struct phys_atomic_file *file, struct ad_error *error);
/* Removes the temporary file. Does nothing when there is no file. */
void phys_atomic_file_abandon(struct phys_atomic_file *file);

/* Removes all temporary files of this process (up to 64 open ones) and returns whether there were
   any. Safe in a signal handler: calls unlink only. */
bool phys_atomic_file_abandon_all(void);

/* ---- for physics/io/ only: temporary files beside their targets (temporary_file.c) ---- */

/* Makes an empty, locked file in the folder of `target`, its first `folder` bytes. 0, and the name
   (to be freed) and the descriptor that holds the lock; else the error number. */
int phys_temporary_new(const char *target, size_t folder, char **name, int *lock);

/* Removes the temporary files in that folder whose processes have ended. */
void phys_temporary_clean(const char *target, size_t folder);

#endif
