/* A report as text (report.h). */
#include "report_rows.h"
#include "apps/quote.h"

#include <math.h>
#include <string.h>

enum { LABEL = 24, CELL = 14, COLUMN = 16 };

/* Texts may come from files: control characters are escaped. */
static void print_text(const char *text, int width, FILE *out)
{
    int length = text ? (int)strlen(text) : 0;
    fprintf(out, " %*s", length < width ? width - length : 0, "");
    quote_terminal(out, text ? text : "");
}

static void print_lines(const char *text, FILE *out)
{
    char line[512];
    for (size_t n;; text += n + 1) {
        n = strcspn(text, "\n");
        snprintf(line, sizeof line, "%.*s", (int)n, text);
        quote_terminal_line(out, "", line);
        if (!text[n])
            return;
    }
}

static void print_cell(const struct report_row *row, int width, int digits, FILE *out)
{
    if (row->kind == NUMBER && isnan(row->number))
        fprintf(out, " %*s", width, "");
    else if (row->kind == NUMBER)
        fprintf(out, " %*.*g", width, digits, row->number);
    else if (row->kind == COUNT)
        fprintf(out, " %*zu", width, row->n);
    else
        print_text(row->kind == TEXT ? row->text : row->n ? "yes" : "no", width, out);
}

static bool has_value(const struct report_row *row)
{
    return row->kind == NUMBER ? !isnan(row->number) : row->kind == LIST ? row->n > 0 : true;
}

/* The line that begins with row k; returns the row behind it. A line without values is left out. */
static size_t print_line(const struct report *report, size_t k, FILE *out)
{
    const struct report_row *row = &report->row[k];
    size_t end = k;
    bool any = false;
    for (; end < report->n && report->row[end].label &&
           strcmp(report->row[end].label, row->label) == 0 && report->row[end].kind != LINE;
         end++)
        any = any || has_value(&report->row[end]);
    if (!any)
        return end;
    fprintf(out, "  %-*s", LABEL, row->label);
    if (row->kind == LIST)
        for (size_t i = 0; i < row->n; i++)
            fprintf(out, "%s%.6g", i ? ", " : " ", row->list[i]);
    else
        for (size_t i = k; i < end; i++)
            print_cell(&report->row[i], CELL, 6, out);
    fprintf(out, "%s%s\n", *row->unit ? "  " : "", row->unit);
    return end;
}

/* The width of the column of row k: that of its longest text. */
static int column_width(const struct report *report, size_t begin, size_t end, size_t k)
{
    size_t width = COLUMN;
    const char *key = report->row[k].key;
    for (size_t i = begin; i < end; i++)
        if (report->row[i].kind == TEXT && report->row[i].text &&
            strcmp(report->row[i].key, key) == 0 && strlen(report->row[i].text) > width)
            width = strlen(report->row[i].text);
    return (int)width;
}

/* Numbers in an array have more digits than elsewhere, for comparison with each other. */
static void print_array(const struct report *report, size_t begin, size_t end, FILE *out)
{
    bool any = false;
    for (size_t k = begin; k < end && !any; k++)
        any = report->row[k].label != NULL;
    if (!any)
        return;
    fputs("\n ", out);
    for (size_t k = begin; k < end && report->row[k].item == report->row[begin].item; k++)
        if (report->row[k].label)
            fprintf(out, " %*s", column_width(report, begin, end, k), report->row[k].label);
    for (size_t k = begin; k < end; k++) {
        if (report_begins_item(report, k))
            fputs("\n ", out);
        if (report->row[k].label)
            print_cell(&report->row[k], column_width(report, begin, end, k), 9, out);
    }
    fputs("\n\n", out);
}

enum ad_status report_print(const struct report *report, FILE *out, struct ad_error *error)
{
    for (size_t k = 0; k < report->n && !report->failed;) {
        const struct report_row *row = &report->row[k];
        if (row->array) {
            size_t end = report_array_end(report, k);
            print_array(report, k, end, out);
            k = end;
        } else if (row->kind == LINE) {
            print_lines(row->text, out);
            k++;
        } else {
            k = row->label ? print_line(report, k, out) : k + 1;
        }
    }
    return report_complete(report, error);
}
