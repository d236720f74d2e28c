/* Reads lines of a Horizons file (horizons_reader.h) from any stream that can be read forward. */
#include "horizons_reader.h"
#include "physics/io/numbers.h"

#include <errno.h>
#include <stdarg.h>
#include <string.h>

bool phys_horizons_refuse(struct horizons_reader *r, const char *at, const char *format, ...)
{
    char message[sizeof r->error->message], column[32] = "";
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    if (at)
        snprintf(column, sizeof column, "%zu:", (size_t)(at - r->text) + 1);
    return HORIZONS_FAIL(r, AD_E_INPUT, "%s:%zu:%s %s", r->file, r->line, column, message);
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

bool phys_horizons_line(struct horizons_reader *r)
{
    size_t n = 0;
    int c;
    r->cut = false;
    while ((c = getc_unlocked(r->stream)) != EOF && c != '\n') {
        if (c == '\0') {
            r->line++;
            return phys_horizons_refuse(r, NULL, "expected text, found a zero byte");
        }
        if (n + 1 < sizeof r->text)
            r->text[n++] = (char)c;
        else
            r->cut = true;
    }
    if (ferror(r->stream))
        return HORIZONS_FAIL(r, AD_E_IO, "%s: cannot be read: %s", r->file, strerror(errno));
    if (c == EOF && n == 0)
        return false;
    while (n > 0 && is_blank(r->text[n - 1]))
        n--;
    r->text[n] = '\0';
    r->length = n;
    r->line++;
    return true;
}

bool phys_horizons_ended(struct horizons_reader *r, const char *expected)
{
    if (r->status != AD_OK)
        return false;
    return phys_horizons_refuse(r, NULL, "expected %s, found the end of the file", expected);
}

bool phys_horizons_starts(const struct horizons_reader *r, const char *word)
{
    const char *start = phys_text_skip(r->text, r->text + r->length);
    return strncmp(start, word, strlen(word)) == 0;
}
