/* Sticky errors: only the first is kept, because later ones follow from it. */
#include "autodiff/internal.h"

#include <stdarg.h>
#include <stdio.h>

static void keep_first(struct ad_error *e, enum ad_status status, const char *format, va_list list)
{
    if (e->status != AD_OK)
        return;
    e->status = status;
    vsnprintf(e->message, sizeof e->message, format, list);
}

enum ad_status ad_fail(struct ad_error *e, enum ad_status status, const char *format, ...)
{
    if (!e)
        return status;
    va_list list;
    va_start(list, format);
    keep_first(e, status, format, list);
    va_end(list);
    return e->status;
}

bool ad_lacks(const char *function, const char *argument, struct ad_error *error)
{
    ad_fail(error, AD_E_ARGUMENT, "%s: got NULL for %s", function, argument);
    return true;
}

ad_var ad_refuse(ad_tape *tape, enum ad_status status, const char *format, ...)
{
    if (!tape)
        return (ad_var){0};
    va_list list;
    va_start(list, format);
    keep_first(&tape->error, status, format, list);
    va_end(list);
    return ad_at(tape, 0);
}
