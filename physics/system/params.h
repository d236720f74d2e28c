/* For physics/ only: recordings of a scene with parameters as variables. */
#ifndef PHYSICS_SYSTEM_PARAMS_H
#define PHYSICS_SYSTEM_PARAMS_H

#include "system.h"

/* Whether L is recorded alike with the values of a and of b, where n parameters are variables: no
   condition on them comes out otherwise. */
bool phys_params_keep_form(const struct phys_system *a, const struct phys_system *b, size_t n,
                           const char *const names[], struct ad_error *error);

#endif
