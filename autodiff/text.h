/* Text written piece by piece into memory of a fixed size, as snprintf: what does not fit is
   counted but not written, and the text always ends with 0. */
#ifndef AUTODIFF_TEXT_H
#define AUTODIFF_TEXT_H

#include <stdarg.h>
#include <stddef.h>

struct ad_text {
    char *to; /* may be NULL, with size 0: to count alone */
    size_t size, length;
};

void ad_text_add(struct ad_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void ad_text_add_list(struct ad_text *text, const char *format, va_list list);

#endif
