/* Structs of callers, which may know fewer or more fields than this library. */
#include "autodiff/sized.h"

/* No struct of callers is longer: a size above is not one. */
enum { MOST = 4096 };

bool ad_take(void *own, size_t size, size_t least, const void *given, const char *function,
             const char *argument, struct ad_error *error)
{
    size_t has;
    if (!given)
        return !ad_lacks(function, argument, error);
    memcpy(&has, given, sizeof has);
    if (has < least || has > MOST) {
        ad_fail(error, AD_E_ARGUMENT, "%s: size of %s is %zu; expected its sizeof, %zu", function,
                argument, has, size);
        return false;
    }
    for (size_t k = size; k < has; k++)
        if (((const char *)given)[k]) {
            ad_fail(error, AD_E_ARGUMENT,
                    "%s: %s has %zu bytes, and what lies beyond the %zu of this older library is "
                    "not 0",
                    function, argument, has, size);
            return false;
        }
    memset(own, 0, size);
    memcpy(own, given, has < size ? has : size);
    memcpy(own, &size, sizeof size);
    return true;
}

void ad_give(void *given, const void *defaults, size_t size)
{
    size_t has = 0;
    if (given)
        memcpy(&has, given, sizeof has);
    if (has > sizeof has)
        memcpy((char *)given + sizeof has, (const char *)defaults + sizeof has,
               (has < size ? has : size) - sizeof has);
}
