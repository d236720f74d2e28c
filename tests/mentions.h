/* assert_mentions(message, "file.csv:2:3: 'x' 7"): each of the names, separated by blanks, occurs
   in the message as a separate word: 7 is neither in 17 nor in 7.5 or 1e7, but 3.14* is in 3.14159.
   Tests check what a user needs to find the mistake: option, file and position, column, coordinate,
   number; the wording is checked by docs/errors.md alone. A failure prints the message and the
   name. */
#ifndef TESTS_MENTIONS_H
#define TESTS_MENTIONS_H

#include <ctype.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

/* Whether characters a and b, side by side, are of one word or number. */
static inline bool mentions_joined(char a, char b, char after)
{
    bool left = isalnum((unsigned char)a) || a == '_';
    bool right = isalnum((unsigned char)b) || b == '_';
    return left && (right || (b == '.' && isdigit((unsigned char)after)));
}

static inline bool mentions_word(const char *message, const char *name, size_t length)
{
    bool more = length > 1 && name[length - 1] == '*';
    length -= more;
    for (const char *at = message; (at = strchr(at, *name)); at++) {
        if (strncmp(at, name, length) != 0)
            continue;
        const char *end = at + length;
        bool begun = at > message && mentions_joined(at[0], at[-1], at > message + 1 ? at[-2] : 0);
        if (!begun && (more || !mentions_joined(end[-1], end[0], end[0] ? end[1] : 0)))
            return true;
    }
    return false;
}

/* The first of the names that is not in the message; NULL if all are. */
static inline const char *mentions_lacks(const char *message, const char *names)
{
    for (names += strspn(names, " "); *names; names += strspn(names, " ")) {
        size_t length = strcspn(names, " ");
        if (!mentions_word(message, names, length))
            return names;
        names += length;
    }
    return NULL;
}

static inline bool mentions(const char *message, const char *names)
{
    const char *name = mentions_lacks(message, names);
    if (name)
        print_error("\"%s\"\n  does not mention \"%.*s\"\n", message, (int)strcspn(name, " "),
                    name);
    return !name;
}

static inline void assert_mentions_at(const char *message, const char *names, const char *file,
                                      int line)
{
    if (!mentions(message, names))
        _fail(file, line);
}

#define assert_mentions(message, names) assert_mentions_at((message), (names), __FILE__, __LINE__)

#endif
