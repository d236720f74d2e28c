/* Looking up names in tables, with the nearest name for errors.

   Errors: AD_E_ARGUMENT. Names have no units. Threads: functions may run at once. */
#ifndef PHYSICS_IO_NAMES_H
#define PHYSICS_IO_NAMES_H

#include "autodiff/autodiff.h"

AD_HEADER_BEGIN

/* The name in names[0..n-1] nearest to `name` by edit distance; NULL if none is near. */
const char *phys_nearest(const char *name, size_t n, const char *const names[]);
/* Index of `name` in names[0..n-1]; n, and an AD_E_ARGUMENT that names the nearest or all there
   are, if it is not there. `what` is what they are names of. */
size_t phys_find(const char *what, const char *name, size_t n, const char *const names[],
                 struct ad_error *error);

AD_HEADER_END
#endif
