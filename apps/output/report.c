/* One table of results, and what is written from it (report.h). */
#include "autodiff/free.h"
#include "report_rows.h"
#include "report.h"
#include "physics/io/grow.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static struct report_row *add(struct report *report, enum kind kind, const char *key,
                              const char *label, const char *unit)
{
    static struct report_row nowhere;
    if (!phys_grow(&report->row, report->n, sizeof *report->row)) {
        report->failed = true;
        return &nowhere;
    }
    struct report_row *row = &report->row[report->n++];
    *row = (struct report_row){.kind = kind,
                               .array = report->array,
                               .item = report->item,
                               .object = report->object,
                               .passing = report->passing,
                               .key = key,
                               .label = label};
    snprintf(row->unit, sizeof row->unit, "%s", unit_shown(unit));
    return row;
}

void report_number(struct report *report, const char *key, const char *label, const char *unit,
                   double value)
{
    add(report, NUMBER, key, label, unit)->number = isfinite(value) ? value : (double)NAN;
}

void report_count(struct report *report, const char *key, const char *label, size_t value)
{
    add(report, COUNT, key, label, NULL)->n = value;
}

void report_flag(struct report *report, const char *key, const char *label, bool value)
{
    add(report, FLAG, key, label, NULL)->n = value;
}

static void keep_text(struct report *report, struct report_row *row, const char *text)
{
    char *copy = text ? strdup(text) : NULL;
    if (text && !copy)
        report->failed = true;
    if (report->failed)
        free(copy);
    else
        row->text = copy;
}

void report_text(struct report *report, const char *key, const char *label, const char *value)
{
    keep_text(report, add(report, TEXT, key, label, NULL), value);
}

void report_list(struct report *report, const char *key, const char *label, const char *unit,
                 size_t n, const double values[])
{
    double *list = malloc((n + 1) * sizeof *list);
    struct report_row *row = add(report, LIST, key, label, unit);
    if (!list || report->failed) {
        report->failed = true;
        free(list);
        return;
    }
    if (n)
        memcpy(list, values, n * sizeof *list);
    row->list = list;
    row->n = n;
}

void report_texts(struct report *report, const char *key, size_t n, const char *const texts[])
{
    size_t length = 1;
    for (size_t k = 0; k < n; k++)
        length += strlen(texts[k]) + 1;
    char *lines = malloc(length), *end = lines;
    struct report_row *row = add(report, TEXTS, key, NULL, NULL);
    if (!lines || report->failed) {
        report->failed = true;
        free(lines);
        return;
    }
    *end = 0;
    for (size_t k = 0; k < n; k++)
        end += sprintf(end, "%s%s", k ? "\n" : "", texts[k]);
    row->text = lines;
    row->n = n;
}

void report_line(struct report *report, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    keep_text(report, add(report, LINE, NULL, "", NULL), text);
}

void report_item(struct report *report, const char *array)
{
    bool next = array && report->array && strcmp(array, report->array) == 0;
    report->item = next ? report->item + 1 : 0;
    report->array = array;
}

void report_free(struct report *report)
{
    for (size_t k = 0; k < report->n; k++) {
        AD_FREE(report->row[k].text, report->row[k].list);
    }
    free(report->row);
    *report = (struct report){0};
}

enum ad_status report_complete(const struct report *report, struct ad_error *error)
{
    return report->failed ? ad_fail(error, AD_E_MEMORY, "out of memory for the report") : AD_OK;
}

bool report_begins_item(const struct report *report, size_t k)
{
    const struct report_row *row = &report->row[k];
    return k == 0 || !row[-1].array || strcmp(row[-1].array, row->array) != 0 ||
           row[-1].item != row->item;
}

static bool same(const char *a, const char *b) { return a == b || (a && b && strcmp(a, b) == 0); }

bool report_is_first(const struct report *report, size_t k, bool kept)
{
    const struct report_row *row = &report->row[k];
    for (size_t i = 0; i < k; i++) {
        const struct report_row *before = &report->row[i];
        if (same(before->object, row->object) && same(before->array, row->array) &&
            before->item == row->item && !(kept && before->passing))
            return false;
    }
    return true;
}

size_t report_array_end(const struct report *report, size_t k)
{
    const char *array = report->row[k].array;
    while (k < report->n && report->row[k].array && strcmp(report->row[k].array, array) == 0)
        k++;
    return k;
}

struct spread spread_of(size_t n, const double values[], size_t stride)
{
    struct spread s = {0, 0, NAN, INFINITY, -INFINITY};
    double squares = 0;
    for (size_t k = 0; k < n; k++) {
        const double value = values[k * stride], away = value - s.mean;
        if (!isfinite(value))
            continue;
        s.mean += away / (double)++s.n;
        squares += away * (value - s.mean);
        s.least = fmin(s.least, value);
        s.most = fmax(s.most, value);
    }
    if (s.n > 1)
        s.deviation = sqrt(squares / (double)(s.n - 1));
    if (s.n == 0)
        s.mean = NAN;
    return s;
}

void report_spread(struct report *report, const char *counted, const char *unit,
                   const struct spread *spread)
{
    report_count(report, counted, counted, spread->n);
    report_number(report, "mean", "mean", unit, spread->mean);
    report_number(report, "deviation", "deviation", unit, spread->deviation);
    report_number(report, "least", "least", unit, spread->least);
    report_number(report, "most", "most", unit, spread->most);
}
