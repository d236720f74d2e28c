/* A file's own checksum in its first bytes, which HDF5 leaves to the user (the user block). HDF5
   checks little of what it reads and may crash on a file with a changed byte; the checksum is
   verified before HDF5 reads the file. It detects accidental changes, not malicious ones. */
#ifndef PHYSICS_IO_CHECKSUM_H
#define PHYSICS_IO_CHECKSUM_H

#include "autodiff/autodiff.h"

enum { PHYS_CHECKSUM_BYTES = 512, PHYS_CHECKSUM_DIGITS = 16 };

/* Writes the hash of all bytes after the first PHYS_CHECKSUM_BYTES into those. `name` is the file's
   name in messages. */
enum ad_status phys_checksum_write(const char *file, const char *name, struct ad_error *error);
/* AD_E_INPUT if the file has a checksum that does not match. Files without one pass. */
enum ad_status phys_checksum_check(const char *file, const char *name, struct ad_error *error);
/* The hash that a file has there, in hexadecimal digits; "" without one. */
void phys_checksum_read(const char *file, char hash[PHYS_CHECKSUM_DIGITS + 1]);

#endif
