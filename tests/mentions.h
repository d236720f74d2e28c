/* assert_mentions(message, text): a failure prints both. */
#ifndef TESTS_MENTIONS_H
#define TESTS_MENTIONS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static inline void assert_mentions_at(const char *message, const char *text, const char *file,
                                      int line)
{
    if (strstr(message, text))
        return;
    print_error("\"%s\"\n  does not mention \"%s\"\n", message, text);
    _fail(file, line);
}

#define assert_mentions(message, text) assert_mentions_at((message), (text), __FILE__, __LINE__)

#endif
