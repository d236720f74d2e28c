/* Parsing numbers in text files, and quoting the text that was found instead of one. */
#ifndef PHYSICS_IO_NUMBERS_H
#define PHYSICS_IO_NUMBERS_H

#include <stdbool.h>

/* The decimal number at the start of [text, end): [+-] digits [. digits] [(e|E|d|D) [+-] digits].
   `value` is the nearest double (ties to even), infinite beyond the range, whatever the locale.
   Returns the first character behind the number; NULL if there is none (nan and inf are none). */
const char *phys_text_number(const char *text, const char *end, double *value);

/* First character in [text, end) that is neither blank nor tab nor carriage return, or `end`. */
const char *phys_text_skip(const char *text, const char *end);

/* The word at [text, end), for "found ...": in quotes, shortened, unprintable bytes as '?'; without
   quotes "the end of the line" when there is none. */
struct phys_quote {
    char text[32];
};
struct phys_quote phys_text_quote(const char *text, const char *end);

#endif
