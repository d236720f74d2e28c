/* Fields of a line of text: separators, quotes, and which fields are names or missing values. */
#ifndef PHYSICS_IO_FIELDS_H
#define PHYSICS_IO_FIELDS_H

#include <stdbool.h>
#include <stddef.h>

/* Separators: a comma, semicolon or tab; or PHYS_BLANKS, any number of blanks and tabs. `blanks`:
   blanks separate beside a comma or semicolon, too. */
enum { PHYS_BLANKS = ' ' };
struct phys_separator {
    char text;
    bool blanks;
};

/* One field of a line, without the blanks around it. Inside quotes, which [text, end) excludes,
   nothing separates and nothing is a comment; "" is one quote. */
struct phys_field {
    const char *text, *end;
    const char *next; /* behind it: at a separator, a comment, or the end of the line */
};
struct phys_field phys_field_at(const char *p, const char *stop, struct phys_separator separator);
/* Where the field behind `field` starts; NULL if it is the last one. */
const char *phys_field_after(const struct phys_field *field, const char *stop,
                             struct phys_separator separator);
/* The separator of a first line: the first of ; , (tab) that it has, else blanks. */
struct phys_separator phys_separator_of(const char *p, const char *stop);
/* The fields as names, each to be freed; an empty one is NULL. false: out of memory. */
bool phys_fields_split(const char *p, const char *stop, struct phys_separator separator,
                       char ***names, size_t *n);
void phys_fields_free(char **names, size_t n); /* takes NULL */
/* None of the fields is a number, nan or inf. */
bool phys_fields_are_names(const char *p, const char *stop, struct phys_separator separator);
/* Empty, or a word for a missing value: NaN, NA, null, none, -, ? */
bool phys_field_missing(const char *p, const char *end);

#endif
