/* Numeric matrices as text (table.h): the whole file in memory, one pass over it. */
#include "csv.h"
#include "numbers.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct reader {
    const char *file;
    struct ad_error *error;
    enum ad_status status;
    char *text; /* the whole file */
    const char *end;
    const char *start; /* of the current line, its end and number */
    const char *stop;
    size_t line;
    size_t first_line; /* of numbers */
    char separator;    /* ',' or ';' once one was met: a mix is a decimal comma */
    double *values;
    size_t n, capacity, cols;
};

/* Keeps the error in the reader; always false. */
#define FAIL(r, code, ...) ((r)->status = ad_fail((r)->error, code, __VA_ARGS__), false)
#define REFUSE(r, at, format, ...)                                                                 \
    FAIL(r, AD_E_INPUT, "%s:%zu:%zu: " format, (r)->file, (r)->line,                               \
         (size_t)((at) - (r)->start) + 1, __VA_ARGS__)

static bool out_of_memory(struct reader *r)
{
    return FAIL(r, AD_E_MEMORY, "%s: out of memory", r->file);
}

static bool cannot_read(struct reader *r)
{
    return FAIL(r, AD_E_IO, "%s: cannot be read: %s; expected CSV", r->file, strerror(errno));
}

/* ---- the file ---- */

/* Everything that the stream gives; no seeking, so that it may be a pipe. */
static bool slurp(struct reader *r, FILE *stream)
{
    size_t n = 0;
    for (size_t capacity = 1 << 16;; capacity *= 2) {
        char *text = capacity > SIZE_MAX / 2 ? NULL : realloc(r->text, capacity);
        if (!text)
            return out_of_memory(r);
        r->text = text;
        n += fread(text + n, 1, capacity - n, stream);
        if (n < capacity)
            break;
    }
    r->end = r->text + n;
    return ferror(stream) ? cannot_read(r) : true;
}

static bool read_file(struct reader *r)
{
    FILE *stream = fopen(r->file, "r");
    if (!stream)
        return cannot_read(r);
    bool read = slurp(r, stream);
    fclose(stream);
    return read;
}

/* ---- lines ---- */

/* The line at `from`; false at the end of the file. */
static bool next_line(struct reader *r, const char *from)
{
    if (from >= r->end)
        return false;
    const char *newline = memchr(from, '\n', (size_t)(r->end - from));
    r->start = from;
    r->stop = newline ? newline : r->end;
    r->line++;
    return true;
}

static const char *without_comment(const struct reader *r)
{
    const char *p = r->start;
    while (p < r->stop && *p != '#' && *p != '%')
        p++;
    return p;
}

static bool is_separator(char c) { return c == ',' || c == ';'; }

static const char *field_end(const char *p, const char *stop)
{
    while (p < stop && !is_separator(*p) && *p != ' ' && *p != '\t' && *p != '\r')
        p++;
    return p;
}

static bool is_not_finite_word(const char *p, const char *end)
{
    static const char *const words[] = {"nan", "inf", "infinity"};
    if (p < end && (*p == '+' || *p == '-'))
        p++;
    for (size_t k = 0; k < sizeof words / sizeof *words; k++) {
        size_t n = 0;
        while (words[k][n] && p + n < end && (p[n] | 0x20) == words[k][n])
            n++;
        if (!words[k][n] && p + n == end)
            return true;
    }
    return false;
}

/* Column names: no field of the line reads as a number, or as what arithmetic made of one. */
static bool is_header(const struct reader *r, const char *stop)
{
    double value;
    for (const char *p = phys_text_skip(r->start, stop); p < stop; p = phys_text_skip(p, stop)) {
        const char *end = field_end(p, stop);
        if (phys_text_number(p, end, &value) == end || is_not_finite_word(p, end))
            return false;
        p = end < stop && is_separator(*end) ? end + 1 : end;
    }
    return true;
}

/* ---- rows ---- */

static bool append(struct reader *r, double value)
{
    if (r->n == r->capacity) {
        size_t capacity = r->capacity ? 2 * r->capacity : 1024;
        double *values = capacity > SIZE_MAX / 2 / sizeof *values
                             ? NULL
                             : realloc(r->values, capacity * sizeof *values);
        if (!values)
            return out_of_memory(r);
        r->values = values;
        r->capacity = capacity;
    }
    r->values[r->n++] = value;
    return true;
}

static bool read_number(struct reader *r, const char **p, const char *stop)
{
    double value;
    const char *end = phys_text_number(*p, stop, &value);
    if (!end || end != field_end(*p, stop))
        return REFUSE(r, *p, "expected a number, found %s", phys_text_quote(*p, stop).text);
    if (!isfinite(value))
        return REFUSE(r, *p, "expected a finite number, found %s", phys_text_quote(*p, stop).text);
    *p = end;
    return append(r, value);
}

/* Blanks, or one comma or semicolon among blanks, which a number must follow. */
static bool read_separator(struct reader *r, const char **p, const char *stop)
{
    *p = phys_text_skip(*p, stop);
    if (*p == stop || !is_separator(**p))
        return true;
    char separator = **p;
    if (r->separator && separator != r->separator)
        return REFUSE(r, *p,
                      "expected '%c' between numbers as before, found '%c' (a decimal comma?)",
                      r->separator, separator);
    r->separator = separator;
    *p = phys_text_skip(*p + 1, stop);
    if (*p == stop)
        return REFUSE(r, *p, "expected a number after '%c', found the end of the line", separator);
    return true;
}

static bool read_row(struct reader *r, const char *stop)
{
    size_t before = r->n;
    for (const char *p = phys_text_skip(r->start, stop); p < stop;)
        if (!read_number(r, &p, stop) || !read_separator(r, &p, stop))
            return false;
    size_t found = r->n - before;
    if (!r->cols) {
        r->cols = found;
        r->first_line = r->line;
    }
    if (found != r->cols)
        return REFUSE(r, stop, "expected %zu numbers as in line %zu, found %zu", r->cols,
                      r->first_line, found);
    return true;
}

static bool read_rows(struct reader *r)
{
    static const char mark[] = "\xef\xbb\xbf"; /* byte order mark */
    const char *p = r->text;
    if (r->end - p >= 3 && memcmp(p, mark, 3) == 0)
        p += 3;
    for (bool named = false; next_line(r, p); p = r->stop + 1) {
        const char *stop = without_comment(r);
        if (phys_text_skip(r->start, stop) == stop)
            continue;
        if (!r->cols && !named && is_header(r, stop))
            named = true;
        else if (!read_row(r, stop))
            return false;
    }
    if (!r->cols)
        return FAIL(r, AD_E_INPUT, "%s:%zu: expected rows of numbers, found none", r->file,
                    r->line);
    return true;
}

enum ad_status phys_table_read(const char *file, size_t *rows, size_t *cols, double **values,
                               struct ad_error *error)
{
    struct reader r = {.file = file, .error = error};
    bool read = read_file(&r) && read_rows(&r);
    free(r.text);
    if (!read) {
        free(r.values);
        return r.status;
    }
    *rows = r.n / r.cols;
    *cols = r.cols;
    *values = r.values;
    return AD_OK;
}
