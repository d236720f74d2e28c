/* Reads the header of a CSV file: names of columns, units, and the separator (csv.h). */
#include "csv_head.h"
#include "numbers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status no_memory(const struct phys_csv *csv, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "%s: out of memory", csv->file);
}

enum ad_status phys_csv_refuse_length(const struct phys_csv *csv, size_t found,
                                      struct ad_error *error)
{
    if (csv->names_line)
        return PHYS_CSV_REFUSE(csv, csv->stop,
                               "expected %zu columns as named in line %zu, found %zu", csv->columns,
                               csv->names_line, found);
    return PHYS_CSV_REFUSE(csv, csv->stop, "expected %zu columns as in the first row, found %zu",
                           csv->columns, found);
}

/* ---- lines ---- */

enum ad_status phys_csv_line(struct phys_csv *csv, struct ad_error *error)
{
    static const char mark[] = "\xef\xbb\xbf";
    if (phys_lines_next(&csv->lines, &csv->start, &csv->stop, error) != AD_OK)
        return error->status;
    if (csv->start && csv->lines.line == 1 && csv->stop - csv->start >= 3 &&
        memcmp(csv->start, mark, 3) == 0)
        csv->start += 3;
    return AD_OK;
}

/* "//" behind a number would be two divisions. */
size_t phys_csv_comment(const char *p, const char *stop)
{
    if (*p == '#' || *p == '%')
        return 1;
    return p + 1 < stop && p[0] == '/' && p[1] == '/' ? 2 : 0;
}

const char *phys_csv_content(const struct phys_csv *csv)
{
    const char *p = phys_text_skip(csv->start, csv->stop);
    return p < csv->stop ? p : NULL;
}

/* ---- names ---- */

/* In a matrix blanks separate, too. */
static struct phys_separator separator_at(const struct phys_csv *csv, const char *p)
{
    struct phys_separator separator = phys_separator_of(p, csv->stop);
    if (csv->matrix)
        separator =
            (struct phys_separator){separator.text == '\t' ? PHYS_BLANKS : separator.text, true};
    return separator;
}

static bool take_names(struct phys_csv *csv, const char *from)
{
    phys_fields_free(csv->name, csv->columns);
    csv->separator = separator_at(csv, from);
    csv->names_line = csv->lines.line;
    return phys_fields_split(from, csv->stop, csv->separator, &csv->name, &csv->columns);
}

static size_t count_fields(const struct phys_csv *csv)
{
    size_t n = 0;
    for (const char *p = csv->start; p; n++) {
        struct phys_field f = phys_field_at(p, csv->stop, csv->separator);
        p = phys_field_after(&f, csv->stop, csv->separator);
    }
    return n;
}

/* The names of the published files: those given, after trial and time, and before their rates
   where there are as many columns again. */
static bool name_as_published(struct phys_csv *csv, bool rates)
{
    const size_t n = csv->columns, columns = 2 + n + (rates ? n : 0);
    char **names = calloc(columns, sizeof *names);
    if (!names)
        return false;
    names[0] = strdup("trial");
    names[1] = strdup("t");
    bool room = names[0] && names[1];
    for (size_t k = 0; k < n && rates && csv->name[k]; k++) {
        size_t size = strlen(csv->name[k]) + 4;
        if ((names[2 + n + k] = malloc(size)))
            snprintf(names[2 + n + k], size, "d%sdt", csv->name[k]);
        else
            room = false;
    }
    memcpy(names + 2, csv->name, n * sizeof *names);
    free(csv->name);
    csv->name = names;
    csv->columns = columns;
    return room;
}

/* The present line has words among its numbers. */
static bool is_mixed(const struct phys_csv *csv)
{
    for (const char *p = csv->start; p;) {
        struct phys_field f = phys_field_at(p, csv->stop, csv->separator);
        if (f.end > f.text && phys_fields_are_names(f.text, f.end, csv->separator))
            return true;
        p = phys_field_after(&f, csv->stop, csv->separator);
    }
    return false;
}

/* `sure`: the names stand in a line of their own. Those in a comment may be no names at all. */
static enum ad_status settle_names(struct phys_csv *csv, bool sure, struct ad_error *error)
{
    if (!sure)
        csv->separator = separator_at(csv, csv->start);
    if (!sure && csv->separator.text == '\t') /* tabs for looks, where no names tell otherwise */
        csv->separator = (struct phys_separator){PHYS_BLANKS, true};
    size_t n = count_fields(csv);
    bool published =
        csv->names_line && !sure && csv->separator.text == PHYS_BLANKS && csv->columns != n;
    if (published && (n == csv->columns + 2 || n == 2 * csv->columns + 2) &&
        !name_as_published(csv, n > csv->columns + 2))
        return no_memory(csv, error);
    if (csv->columns == n)
        return AD_OK;
    if (sure)
        return phys_csv_refuse_length(csv, n, error);
    phys_fields_free(csv->name, csv->columns);
    csv->name = NULL;
    csv->names_line = 0;
    csv->columns = n;
    csv->mixed_line = is_mixed(csv) ? csv->lines.line : 0;
    return AD_OK;
}

/* A line below the names that has as many fields, and words in them instead of numbers. */
static bool is_of_units(const struct phys_csv *csv)
{
    size_t words = 0;
    for (const char *p = csv->start; p;) {
        struct phys_field f = phys_field_at(p, csv->stop, csv->separator);
        if (f.end > f.text && phys_field_missing(f.text, f.end))
            return false;
        words += f.end > f.text;
        p = phys_field_after(&f, csv->stop, csv->separator);
    }
    return words && count_fields(csv) == csv->columns &&
           phys_fields_are_names(csv->start, csv->stop, csv->separator);
}

enum ad_status phys_csv_head(struct phys_csv *csv, struct ad_error *error)
{
    bool named = false; /* by a line of its own, not by a comment */
    while (phys_csv_line(csv, error) == AD_OK && csv->start) {
        const char *p = phys_csv_content(csv);
        size_t comment = p ? phys_csv_comment(p, csv->stop) : 0;
        if (comment && (p = phys_text_skip(p + comment, csv->stop)) == csv->stop)
            p = NULL;
        if (!p)
            continue;
        if (named && !comment && !csv->matrix && !csv->units_line && is_of_units(csv)) {
            csv->units_line = csv->lines.line;
            continue;
        }
        bool names = !named && phys_fields_are_names(p, csv->stop, separator_at(csv, p));
        if (!names && !comment)
            return settle_names(csv, named && !csv->matrix, error);
        if (names && !take_names(csv, p))
            return no_memory(csv, error);
        named = named || (names && !comment);
    }
    return error->status != AD_OK
               ? error->status
               : ad_fail(error, AD_E_INPUT, "%s:%zu: expected rows of numbers, found none",
                         csv->file, csv->lines.line);
}
