/* Columns of text, in a stream: memory for one block of lines, whatever the size of the file.

   A first line none of whose fields is a number names the columns; a second one such is of units,
   and left out. So does the last comment before the first row, if it has as many fields as rows
   have ("# q p"). In columns of blanks it may leave out trial and time, which come first, and the
   rates of the named, which come last ("% o v" over trial, time, o, v, or over trial, time, o, v,
   dodt, dvdt), as in the data of M. Schmidt and H. Lipson, Science 324, 2009. */
#include "data_source.h"
#include "physics/io/numbers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct text {
    struct hnn_source source;
    struct hnn_lines lines;
    char separator;
    const char *start, *stop; /* of the present line; NULL: none yet, or no more */
    size_t *slot;             /* [columns]: 1 + the column of the block, 0 where not chosen */
    size_t line[HNN_BLOCK];   /* of each row of the block */
};

static struct text *text_of(struct hnn_source *source) { return (struct text *)source; }

/* ---- what is wrong, and where ---- */

#define REFUSE(t, at, format, ...)                                                                 \
    ad_fail(error, AD_E_INPUT, "%s:%zu:%zu: " format, (t)->source.file, (t)->lines.line,           \
            (size_t)((at) - (t)->start) + 1, __VA_ARGS__)

static enum ad_status no_memory(const struct text *t, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "%s: out of memory", t->source.file);
}

static bool is_blank(char c) { return c == ' ' || c == '\t'; }

/* "'q'", or its number where it has no name. */
struct label {
    char text[64];
};
static struct label label_of(const struct hnn_source *source, size_t column)
{
    struct label label;
    if (source->name && source->name[column])
        snprintf(label.text, sizeof label.text, "'%.40s'", source->name[column]);
    else
        snprintf(label.text, sizeof label.text, "%zu", column + 1);
    return label;
}

static enum ad_status refuse_number(const struct text *t, size_t column, const struct hnn_field *f,
                                    const char *expected, struct ad_error *error)
{
    struct phys_quote found = {"an empty field"}, more = {""};
    const char *tail = f->text;
    while (tail < f->end && !is_blank(*tail) && *tail != ',')
        tail++;
    if (f->end > f->text)
        found = phys_text_quote(f->text, f->end);
    if (tail < f->end)
        more = phys_text_quote(tail + 1, f->end);
    const char *guess = tail < f->end && *tail == ','     ? " (a decimal comma?)"
                        : hnn_is_missing(f->text, f->end) ? " (missing? such rows can be skipped)"
                        : t->lines.line == t->source.mixed_line ? " (half a line of names?)"
                                                                : "";
    return REFUSE(t, f->text, "expected %s in column %s, found %s%s%s%s", expected,
                  label_of(&t->source, column).text, found.text, tail < f->end ? " and " : "",
                  more.text, guess);
}

static enum ad_status refuse_length(const struct text *t, size_t found, struct ad_error *error)
{
    const struct hnn_source *s = &t->source;
    if (s->names_line)
        return REFUSE(t, t->stop, "expected %zu columns as named in line %zu, found %zu",
                      s->columns, s->names_line, found);
    return REFUSE(t, t->stop, "expected %zu columns as in the first row, found %zu", s->columns,
                  found);
}

/* ---- names, and the first row ---- */

/* Passes the byte order mark that some programs put first. */
static enum ad_status next_line(struct text *t, struct ad_error *error)
{
    static const char mark[] = "\xef\xbb\xbf";
    if (hnn_lines_next(&t->lines, &t->start, &t->stop, error) != AD_OK)
        return error->status;
    if (t->start && t->lines.line == 1 && t->stop - t->start >= 3 && memcmp(t->start, mark, 3) == 0)
        t->start += 3;
    return AD_OK;
}

/* At the beginning of a line "//", too; behind a number it would be two divisions. */
static size_t comment_at(const char *p, const char *stop)
{
    if (*p == '#' || *p == '%')
        return 1;
    return p + 1 < stop && p[0] == '/' && p[1] == '/' ? 2 : 0;
}

/* First character that is no blank; NULL on an empty line. */
static const char *content(const struct text *t)
{
    const char *p = phys_text_skip(t->start, t->stop);
    return p < t->stop ? p : NULL;
}

static bool take_names(struct text *t, const char *from)
{
    hnn_names_free(t->source.name, t->source.columns);
    t->separator = hnn_separator_of(from, t->stop);
    t->source.names_line = t->lines.line;
    return hnn_names_of(from, t->stop, t->separator, &t->source.name, &t->source.columns);
}

static size_t count_fields(const struct text *t)
{
    size_t n = 0;
    for (const char *p = t->start; p; n++) {
        struct hnn_field f = hnn_field_at(p, t->stop, t->separator);
        p = hnn_field_after(&f, t->stop, t->separator);
    }
    return n;
}

/* The names of the published files: those given, after trial and time, and before their rates
   where there are as many columns again. */
static bool name_as_published(struct hnn_source *s, bool rates)
{
    const size_t n = s->columns, columns = 2 + n + (rates ? n : 0);
    char **names = calloc(columns, sizeof *names);
    if (!names)
        return false;
    names[0] = strdup("trial");
    names[1] = strdup("t");
    bool room = names[0] && names[1];
    for (size_t k = 0; k < n && rates && s->name[k]; k++) {
        size_t size = strlen(s->name[k]) + 4;
        if ((names[2 + n + k] = malloc(size)))
            snprintf(names[2 + n + k], size, "d%sdt", s->name[k]);
        else
            room = false;
    }
    memcpy(names + 2, s->name, n * sizeof *names);
    free(s->name);
    s->name = names;
    s->columns = columns;
    return room;
}

/* The present line has words among its numbers. */
static bool is_mixed(const struct text *t)
{
    for (const char *p = t->start; p;) {
        struct hnn_field f = hnn_field_at(p, t->stop, t->separator);
        if (f.end > f.text && hnn_names_only(f.text, f.end, t->separator))
            return true;
        p = hnn_field_after(&f, t->stop, t->separator);
    }
    return false;
}

/* Names in a comment may be no names at all. */
static enum ad_status settle_names(struct text *t, bool in_comment, struct ad_error *error)
{
    struct hnn_source *s = &t->source;
    if (!s->names_line || in_comment)
        t->separator = hnn_separator_of(t->start, t->stop);
    if ((!s->names_line || in_comment) && t->separator == '\t')
        t->separator = HNN_BLANKS; /* tabs for looks, where no names tell otherwise */
    size_t n = count_fields(t);
    bool published = s->names_line && in_comment && t->separator == HNN_BLANKS && s->columns != n;
    if (published && (n == s->columns + 2 || n == 2 * s->columns + 2) &&
        !name_as_published(s, n > s->columns + 2))
        return no_memory(t, error);
    if (s->columns == n)
        return AD_OK;
    if (s->names_line && !in_comment)
        return refuse_length(t, n, error);
    hnn_names_free(s->name, s->columns);
    s->name = NULL;
    s->names_line = 0;
    s->columns = n;
    s->mixed_line = is_mixed(t) ? t->lines.line : 0;
    return AD_OK;
}

/* A line below the names that has as many fields, and words in them instead of numbers. */
static bool is_of_units(const struct text *t)
{
    size_t words = 0;
    for (const char *p = t->start; p;) {
        struct hnn_field f = hnn_field_at(p, t->stop, t->separator);
        if (f.end > f.text && hnn_is_missing(f.text, f.end))
            return false;
        words += f.end > f.text;
        p = hnn_field_after(&f, t->stop, t->separator);
    }
    return words && count_fields(t) == t->source.columns &&
           hnn_names_only(t->start, t->stop, t->separator);
}

/* Up to the first row of numbers, which is then the present line. */
static enum ad_status read_head(struct text *t, struct ad_error *error)
{
    bool in_comment = false, named = false;
    while (next_line(t, error) == AD_OK && t->start) {
        const char *p = content(t);
        size_t comment = p ? comment_at(p, t->stop) : 0;
        if (comment && (p = phys_text_skip(p + comment, t->stop)) == t->stop)
            p = NULL;
        if (!p)
            continue;
        if (named && !comment && !t->source.units_line && is_of_units(t)) {
            t->source.units_line = t->lines.line;
            continue;
        }
        bool names = !named && hnn_names_only(p, t->stop, hnn_separator_of(p, t->stop));
        if (!names && !comment)
            return settle_names(t, in_comment, error);
        if (names && !take_names(t, p))
            return no_memory(t, error);
        if (names) {
            in_comment = comment > 0;
            named = !comment;
        }
    }
    return error->status != AD_OK
               ? error->status
               : ad_fail(error, AD_E_INPUT, "%s:%zu: expected rows of numbers, found none",
                         t->source.file, t->lines.line);
}

/* ---- rows ---- */

static enum ad_status read_number(const struct text *t, size_t column, const struct hnn_field *f,
                                  double *value, struct ad_error *error)
{
    if (t->source.skip_missing && hnn_is_missing(f->text, f->end)) {
        *value = NAN;
        return AD_OK;
    }
    if (f->text == f->end || phys_text_number(f->text, f->end, value) != f->end)
        return refuse_number(t, column, f, "a number", error);
    return isfinite(*value) ? AD_OK : refuse_number(t, column, f, "a finite number", error);
}

/* A plain number, as nearly all fields are, in one pass: the field's end is where the number's is.
   False for anything else, right or wrong. */
static bool scan_number(const struct text *t, const char *p, double *value, struct hnn_field *f)
{
    const char *start = phys_text_skip(p, t->stop);
    const char *end = phys_text_number(start, t->stop, value);
    if (!end || !isfinite(*value) || t->separator == '\t') /* a tab there is no blank */
        return false;
    const char *next = phys_text_skip(end, t->stop);
    *f = (struct hnn_field){start, end, next};
    return next == t->stop || *next == t->separator || (t->separator == HNN_BLANKS && next > end);
}

/* The present line as row `row` of the block. */
static enum ad_status read_row(const struct text *t, double *block, size_t row,
                               struct ad_error *error)
{
    size_t column = 0, columns = t->source.columns;
    for (const char *p = t->start; p; column++) {
        struct hnn_field f;
        size_t slot = column < columns ? t->slot[column] : 0;
        double *value = slot ? block + (slot - 1) * HNN_BLOCK + row : NULL;
        if (!slot || !scan_number(t, p, value, &f)) {
            f = hnn_field_at(p, t->stop, t->separator);
            if (slot && read_number(t, column, &f, value, error) != AD_OK)
                return error->status;
        }
        p = hnn_field_after(&f, t->stop, t->separator);
    }
    return column == columns ? AD_OK : refuse_length(t, column, error);
}

static enum ad_status text_read(struct hnn_source *source, double *block, size_t *rows,
                                struct ad_error *error)
{
    struct text *t = text_of(source);
    *rows = 0;
    while (t->start && *rows < HNN_BLOCK) {
        const char *p = content(t);
        if (p && !comment_at(p, t->stop)) {
            if (read_row(t, block, *rows, error) != AD_OK)
                return error->status;
            t->line[(*rows)++] = t->lines.line;
        }
        if (next_line(t, error) != AD_OK)
            return error->status;
    }
    return AD_OK;
}

static enum ad_status text_choose(struct hnn_source *source, size_t n, const size_t *column,
                                  struct ad_error *error)
{
    struct text *t = text_of(source);
    t->slot = calloc(source->columns, sizeof *t->slot);
    if (!t->slot)
        return no_memory(t, error);
    for (size_t k = 0; k < n; k++)
        t->slot[column[k]] = k + 1;
    return AD_OK;
}

static void text_place(const struct hnn_source *source, size_t k, char *text, size_t size)
{
    snprintf(text, size, "%s:%zu", source->file, ((const struct text *)source)->line[k]);
}

static void text_close(struct hnn_source *source)
{
    struct text *t = text_of(source);
    hnn_names_free(source->name, source->columns);
    hnn_lines_close(&t->lines);
    free(t->slot);
    free(t);
}

static const struct hnn_source_kind text_kind = {text_choose, text_read, text_place, text_close};

static enum ad_status skip_lines(struct text *t, size_t n, struct ad_error *error)
{
    for (size_t k = 0; k < n; k++)
        if (next_line(t, error) != AD_OK)
            return error->status;
    return !n || t->start
               ? AD_OK
               : ad_fail(error, AD_E_INPUT, "%s: has %zu lines; expected more than the %zu skipped",
                         t->source.file, t->lines.line, n);
}

enum ad_status hnn_text_open(const char *file, size_t skip, struct hnn_source **source,
                             struct ad_error *error)
{
    struct text *t = calloc(1, sizeof *t);
    if (!t)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
    t->source = (struct hnn_source){.kind = &text_kind, .file = file, .ordered = true};
    if (hnn_lines_open(&t->lines, file, error) == AD_OK && skip_lines(t, skip, error) == AD_OK &&
        read_head(t, error) == AD_OK)
        *source = &t->source;
    else
        text_close(&t->source);
    return error->status;
}
