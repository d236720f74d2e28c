/* Printable characters of UTF-8 text. */
#ifndef PHYSICS_IO_UTF8_H
#define PHYSICS_IO_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* Length of the UTF-8 sequence at `text` (RFC 3629), 0 if it is not one. */
size_t phys_utf8_length(const char *text);
/* The same; 0 for control characters (C0, DEL, C1) and U+FFFE, U+FFFF, too. */
size_t phys_utf8_printable(const char *text);
/* Whether all of it is printable. */
bool phys_utf8_is_printable(const char *text);

#endif
