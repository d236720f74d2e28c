/* Temporary files beside their targets: creation and removal of abandoned ones (atomic_file.h). */
#ifndef PHYSICS_IO_TEMPORARY_FILE_H
#define PHYSICS_IO_TEMPORARY_FILE_H

#include <stddef.h>

/* Makes an empty, locked file in the folder of `target`, its first `folder` bytes. 0, and the name
   (to be freed) and the descriptor that holds the lock; else the error number. */
int phys_temporary_new(const char *target, size_t folder, char **name, int *lock);

/* Removes the temporary files in that folder whose processes have ended. */
void phys_temporary_clean(const char *target, size_t folder);

#endif
