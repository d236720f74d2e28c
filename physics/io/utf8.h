/* Printable characters of UTF-8 text. */
#ifndef PHYSICS_IO_UTF8_H
#define PHYSICS_IO_UTF8_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Length of the UTF-8 sequence at `text` (RFC 3629), 0 if it is not one. */
size_t phys_utf8_length(const char *text);
/* The code point of the sequence at `text`, which is one. */
uint32_t phys_utf8_code(const char *text);
/* Length of the sequence; 0 as well for what a terminal obeys or hides: control characters, those
   that turn the direction of text, blanks without width, fillers, tags, and U+FFFE, U+FFFF. */
size_t phys_utf8_printable(const char *text);
/* Whether all of it is printable. */
bool phys_utf8_is_printable(const char *text);

#endif
