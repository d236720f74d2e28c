/* Text written piece by piece (text.h). */
#include "text.h"

#include <stdbool.h>
#include <stdio.h>

void ad_text_add_list(struct ad_text *text, const char *format, va_list list)
{
    bool room = text->to && text->length < text->size;
    int n = vsnprintf(room ? text->to + text->length : NULL, room ? text->size - text->length : 0,
                      format, list);
    text->length += n > 0 ? (size_t)n : 0;
}

void ad_text_add(struct ad_text *text, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    ad_text_add_list(text, format, list);
    va_end(list);
}
