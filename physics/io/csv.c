/* Reads the rows of a CSV file (csv.h) in one pass over each line. */
#include "csv_head.h"
#include "numbers.h"

#include <math.h>
#include <stdio.h>

/* ---- numbers ---- */

/* "'q'", or its number where it has no name. */
struct label {
    char text[64];
};
static struct label label_of(const struct phys_csv *csv, size_t column)
{
    struct label label;
    if (csv->name && csv->name[column])
        snprintf(label.text, sizeof label.text, "'%.40s'", csv->name[column]);
    else
        snprintf(label.text, sizeof label.text, "%zu", column + 1);
    return label;
}

static enum ad_status refuse_number(const struct phys_csv *csv, size_t column,
                                    const struct phys_field *f, const char *expected,
                                    struct ad_error *error)
{
    struct phys_quote found = {"an empty field"}, more = {""};
    const char *tail = f->text;
    while (tail < f->end && *tail != ' ' && *tail != '\t' && *tail != ',')
        tail++;
    if (f->end > f->text)
        found = phys_text_quote(f->text, f->end);
    if (tail < f->end)
        more = phys_text_quote(tail + 1, f->end);
    const char *guess = tail < f->end && *tail == ',' ? " (a decimal comma?)"
                        : csv->matrix                 ? ""
                        : phys_field_missing(f->text, f->end)
                            ? " (missing? such rows can be skipped)"
                        : csv->lines.line == csv->mixed_line ? " (names and numbers mixed?)"
                                                             : "";
    return PHYS_CSV_REFUSE(csv, f->text, "expected %s in column %s, found %s%s%s%s", expected,
                           label_of(csv, column).text, found.text, tail < f->end ? " and " : "",
                           more.text, guess);
}

static enum ad_status read_number(const struct phys_csv *csv, size_t column,
                                  const struct phys_field *f, double *value, struct ad_error *error)
{
    if (csv->skip_missing && phys_field_missing(f->text, f->end)) {
        *value = NAN;
        return AD_OK;
    }
    if (f->text == f->end || phys_text_number(f->text, f->end, value) != f->end)
        return refuse_number(csv, column, f, "a number", error);
    return isfinite(*value) ? AD_OK : refuse_number(csv, column, f, "a finite number", error);
}

/* A plain number, as nearly all fields are, in one pass: the field's end is where the number's is.
   False for anything else, right or wrong. */
static bool scan_number(const struct phys_csv *csv, const char *p, double *value,
                        struct phys_field *f)
{
    const char *start = phys_text_skip(p, csv->stop);
    const char *end = phys_text_number(start, csv->stop, value);
    if (!end || !isfinite(*value) || csv->separator.text == '\t') /* a tab there is no blank */
        return false;
    const char *next = phys_text_skip(end, csv->stop);
    *f = (struct phys_field){start, end, next};
    return next == csv->stop || *next == csv->separator.text ||
           (csv->separator.blanks && next > end);
}

/* ---- rows ---- */

/* The present line as row `row`. */
static enum ad_status read_row(const struct phys_csv *csv, double *const *to, size_t row,
                               struct ad_error *error)
{
    size_t column = 0;
    for (const char *p = csv->start; p; column++) {
        struct phys_field f;
        double *value = column < csv->columns && to[column] ? to[column] + row : NULL;
        if (!value || !scan_number(csv, p, value, &f)) {
            f = phys_field_at(p, csv->stop, csv->separator);
            if (value && read_number(csv, column, &f, value, error) != AD_OK)
                return error->status;
        }
        p = phys_field_after(&f, csv->stop, csv->separator);
    }
    return column == csv->columns ? AD_OK : phys_csv_refuse_length(csv, column, error);
}

static bool lacks_value(const struct phys_csv *csv, double *const *to, size_t row)
{
    for (size_t c = 0; c < csv->columns; c++)
        if (to[c] && isnan(to[c][row]))
            return true;
    return false;
}

enum ad_status phys_csv_read(struct phys_csv *csv, size_t room, double *const *to, size_t stride,
                             size_t *rows, struct ad_error *error)
{
    *rows = 0;
    while (csv->start && *rows < room && *rows < PHYS_CSV_ROWS) {
        const char *p = phys_csv_content(csv);
        if (p && !phys_csv_comment(p, csv->stop)) {
            if (read_row(csv, to, *rows * stride, error) != AD_OK)
                return error->status;
            if (csv->leave_out && lacks_value(csv, to, *rows * stride))
                csv->left_out++;
            else
                csv->line[(*rows)++] = csv->lines.line;
        }
        if (phys_csv_line(csv, error) != AD_OK)
            return error->status;
    }
    return AD_OK;
}

/* ---- the file ---- */

static enum ad_status skip_lines(struct phys_csv *csv, size_t n, struct ad_error *error)
{
    for (size_t k = 0; k < n && (!k || csv->start); k++)
        if (phys_csv_line(csv, error) != AD_OK)
            return error->status;
    return !n || csv->start
               ? AD_OK
               : ad_fail(error, AD_E_INPUT, "%s: has %zu lines; expected more than the %zu skipped",
                         csv->file, csv->lines.line, n);
}

enum ad_status phys_csv_open(struct phys_csv *csv, const char *file, size_t skip,
                             struct ad_error *error)
{
    csv->file = file;
    if (phys_lines_open(&csv->lines, file, error) != AD_OK || skip_lines(csv, skip, error) != AD_OK)
        return error->status;
    return phys_csv_head(csv, error);
}

void phys_csv_close(struct phys_csv *csv)
{
    phys_fields_free(csv->name, csv->columns);
    phys_lines_close(&csv->lines);
}
