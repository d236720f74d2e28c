/* Splits a line of text into fields, and recognises names and missing values. */
#include "fields.h"
#include "grow.h"
#include "numbers.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool is_comment(char c) { return c == '#' || c == '%'; }

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* A tab that separates is not a blank to be skipped. */
static const char *skip(const char *p, const char *stop, struct phys_separator separator)
{
    while (p < stop && is_blank(*p) && *p != (separator.text == '\t' ? '\t' : '\0'))
        p++;
    return p;
}

static bool ends_field(char c, struct phys_separator separator)
{
    return c == separator.text || is_comment(c) || (separator.blanks && is_blank(c));
}

/* Behind the quote that closes; at the end of the line where none does. */
static const char *quoted_end(const char *p, const char *stop)
{
    for (p++; p < stop; p++)
        if (*p == '"' && (p + 1 == stop || p[1] != '"'))
            return p;
        else if (*p == '"')
            p++;
    return stop;
}

struct phys_field phys_field_at(const char *p, const char *stop, struct phys_separator separator)
{
    p = skip(p, stop, separator);
    if (p < stop && *p == '"') {
        const char *end = quoted_end(p, stop);
        return (struct phys_field){p + 1, end, skip(end < stop ? end + 1 : stop, stop, separator)};
    }
    const char *end = p;
    while (end < stop && !ends_field(*end, separator))
        end++;
    const char *next = skip(end, stop, separator);
    while (end > p && is_blank(end[-1]))
        end--;
    return (struct phys_field){p, end, next};
}

const char *phys_field_after(const struct phys_field *field, const char *stop,
                             struct phys_separator separator)
{
    const char *next = field->next;
    if (next == stop || is_comment(*next))
        return NULL;
    return separator.text == PHYS_BLANKS || *next != separator.text ? next : next + 1;
}

struct phys_separator phys_separator_of(const char *p, const char *stop)
{
    bool quoted = false;
    size_t commas = 0, tabs = 0;
    for (; p < stop && (quoted || !is_comment(*p)); p++) {
        quoted = quoted != (*p == '"');
        if (*p == ';' && !quoted)
            return (struct phys_separator){.text = ';'};
        commas += *p == ',' && !quoted;
        tabs += *p == '\t' && !quoted;
    }
    char text = commas ? ',' : tabs ? '\t' : PHYS_BLANKS;
    return (struct phys_separator){text, text == PHYS_BLANKS};
}

static bool is_one_of(const char *p, const char *end, size_t n, const char *const words[])
{
    for (size_t k = 0; k < n; k++)
        if ((size_t)(end - p) == strlen(words[k]) &&
            strncasecmp(p, words[k], strlen(words[k])) == 0)
            return true;
    return false;
}

/* Printed results of invalid arithmetic. */
static bool is_not_finite_word(const char *p, const char *end)
{
    static const char *const words[] = {"nan", "inf", "infinity"};
    if (p < end && (*p == '+' || *p == '-'))
        p++;
    return is_one_of(p, end, sizeof words / sizeof *words, words);
}

bool phys_field_missing(const char *p, const char *end)
{
    static const char *const words[] = {"",  "nan", "-nan", "na", "n/a", "null",   "none",
                                        "-", "--",  "?",    ".",  "nil", "missing"};
    return is_one_of(p, end, sizeof words / sizeof *words, words);
}

bool phys_fields_are_names(const char *p, const char *stop, struct phys_separator separator)
{
    while (p) {
        struct phys_field f = phys_field_at(p, stop, separator);
        double value;
        if (f.end > f.text &&
            (phys_text_number(f.text, f.end, &value) == f.end || is_not_finite_word(f.text, f.end)))
            return false;
        p = phys_field_after(&f, stop, separator);
    }
    return true;
}

/* A copy of the field with "" as one quote. */
static char *name_of(const struct phys_field *f)
{
    char *name = malloc((size_t)(f->end - f->text) + 1), *to = name;
    if (!name)
        return NULL;
    for (const char *p = f->text; p < f->end; p++) {
        *to++ = *p;
        if (*p == '"' && p + 1 < f->end && p[1] == '"')
            p++;
    }
    *to = '\0';
    return name;
}

bool phys_fields_split(const char *p, const char *stop, struct phys_separator separator,
                       char ***names, size_t *n)
{
    *names = NULL;
    for (*n = 0; p; ++*n) {
        struct phys_field f = phys_field_at(p, stop, separator);
        if (!phys_grow(names, *n, sizeof **names))
            return false;
        (*names)[*n] = NULL;
        if (f.end > f.text && !((*names)[*n] = name_of(&f)))
            return false;
        p = phys_field_after(&f, stop, separator);
    }
    return true;
}

void phys_fields_free(char **names, size_t n)
{
    for (size_t k = 0; names && k < n; k++)
        free(names[k]);
    free(names);
}
