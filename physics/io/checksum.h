/* Seals: a file's own hash in its first bytes, which HDF5 leaves to us (its user block). HDF5
   checks little of what it reads, and may crash on a file with a changed byte; a sealed file is
   looked at before it gets there. */
#ifndef PHYSICS_SEAL_H
#define PHYSICS_SEAL_H

#include "autodiff/autodiff.h"

enum { PHYS_CHECKSUM_BYTES = 512 };

/* Writes the hash of all bytes after the first PHYS_CHECKSUM_BYTES into those. `name` stands for
   the file in messages. */
enum ad_status phys_checksum_write(const char *file, const char *name, struct ad_error *error);
/* AD_E_INPUT if the file is sealed and not as it was then. Files without a seal pass. */
enum ad_status phys_checksum_check(const char *file, const char *name, struct ad_error *error);

#endif
