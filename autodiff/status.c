/* Sticky errors: the first one is the cause, whatever follows is its consequence. */
#include "autodiff.h"

#include <stdarg.h>
#include <stdio.h>

enum ad_status ad_fail(struct ad_error *e, enum ad_status status, const char *format, ...)
{
    if (!e)
        return status;
    if (e->status != AD_OK)
        return e->status;
    e->status = status;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(e->message, sizeof e->message, format, arguments);
    va_end(arguments);
    return status;
}
