/* Structs that begin with their size, as compilers of callers knew it: later fields of this library
   read as 0, which is their default. */
#ifndef AUTODIFF_SIZED_H
#define AUTODIFF_SIZED_H

#include "status.h"

#define AD_BYTES_TO(of, last) ((size_t)((const char *)(&(of).last + 1) - (const char *)&(of)))

/* Copies *given to *own. False, with AD_E_ARGUMENT in *error, unless it has the fields up to
   `last`, those of the first release of this soname, and no later ones that this library lacks. */
#define AD_TAKE(own, given, last, error)                                                           \
    ad_take(own, sizeof *(own), AD_BYTES_TO(*(own), last), given, __func__, #given, error)
/* Replaces the argument `given` by such a copy, or returns its error from a function. */
#define AD_OWN(type, given, last, error)                                                           \
    struct type given##_own;                                                                       \
    if (!AD_TAKE(&given##_own, given, last, error))                                                \
        return (error)->status;                                                                    \
    given = &given##_own
bool ad_take(void *own, size_t size, size_t least, const void *given, const char *function,
             const char *argument, struct ad_error *error);

/* Copies defaults to *given as far as it goes; its size stays. */
#define AD_GIVE(given, defaults) ad_give(given, defaults, sizeof *(defaults))
void ad_give(void *given, const void *defaults, size_t size);

#endif
