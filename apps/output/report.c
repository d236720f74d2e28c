/* One table of results, and what is written from it (report.h). */
#include "report.h"
#include "json.h"
#include "apps/quote.h"
#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum kind { NUMBER, COUNT, FLAG, TEXT, LIST, TEXTS, LINE };

struct report_row {
    enum kind kind;
    const char *array, *object, *key, *label;
    char unit[40];
    bool passing;
    size_t item, n; /* n: the count, or the length of the list */
    double number;
    char *text;   /* owned */
    double *list; /* owned */
};

/* ---- adding ---- */

static struct report_row *add(struct report *report, enum kind kind, const char *key,
                              const char *label, const char *unit)
{
    static struct report_row nowhere;
    if (report->n == report->room) {
        size_t room = report->room ? 2 * report->room : 64;
        struct report_row *row = realloc(report->row, room * sizeof *row);
        if (!row) {
            report->failed = true;
            return &nowhere;
        }
        report->row = row;
        report->room = room;
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
        free(report->row[k].text);
        free(report->row[k].list);
    }
    free(report->row);
    *report = (struct report){0};
}

static enum ad_status complete(const struct report *report, struct ad_error *error)
{
    return report->failed ? ad_fail(error, AD_E_MEMORY, "out of memory for the report") : AD_OK;
}

static bool begins_item(const struct report *report, size_t k)
{
    const struct report_row *row = &report->row[k];
    return k == 0 || !row[-1].array || strcmp(row[-1].array, row->array) != 0 ||
           row[-1].item != row->item;
}

static bool same(const char *a, const char *b) { return a == b || (a && b && strcmp(a, b) == 0); }

/* No row before row k is of its object, or of its item of an array; `kept`: none that is kept in
   the file. */
static bool is_first(const struct report *report, size_t k, bool kept)
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

/* First row behind row k that is not of its array. */
static size_t array_end(const struct report *report, size_t k)
{
    const char *array = report->row[k].array;
    while (k < report->n && report->row[k].array && strcmp(report->row[k].array, array) == 0)
        k++;
    return k;
}

/* ---- text ---- */

enum { LABEL = 24, CELL = 14, COLUMN = 16 };

/* Texts may be from outside. */
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

/* Of the column of row k in the array: that of its longest text. */
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

/* Numbers in an array are compared with each other: with more digits than elsewhere. */
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
        if (begins_item(report, k))
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
            size_t end = array_end(report, k);
            print_array(report, k, end, out);
            k = end;
        } else if (row->kind == LINE) {
            print_lines(row->text, out);
            k++;
        } else {
            k = row->label ? print_line(report, k, out) : k + 1;
        }
    }
    return complete(report, error);
}

/* ---- JSON ---- */

static void json_lines(struct json *json, const struct report_row *row)
{
    const char *line = row->text;
    json_array(json, row->key);
    for (size_t k = 0; k < row->n; k++, line++) {
        char *copy = strndup(line, strcspn(line, "\n"));
        json_text(json, NULL, copy);
        free(copy);
        line += strcspn(line, "\n");
    }
    json_end_array(json);
}

static void json_row(struct json *json, const struct report_row *row)
{
    switch (row->kind) {
    case NUMBER:
        json_number(json, row->key, row->number);
        break;
    case COUNT:
        json_count(json, row->key, row->n);
        break;
    case FLAG:
        json_bool(json, row->key, row->n);
        break;
    case TEXT:
        json_text(json, row->key, row->text);
        break;
    case LIST:
        json_array(json, row->key);
        for (size_t i = 0; i < row->n; i++)
            json_number(json, NULL, row->list[i]);
        json_end_array(json);
        break;
    case TEXTS:
        json_lines(json, row);
        break;
    case LINE:
        break;
    }
}

static void json_rows(struct json *json, const struct report *report, size_t begin, size_t end)
{
    json_array(json, report->row[begin].array);
    for (size_t k = begin; k < end; k++) {
        if (begins_item(report, k))
            json_object(json, NULL);
        json_row(json, &report->row[k]);
        if (k + 1 == end || begins_item(report, k + 1))
            json_end_object(json);
    }
    json_end_array(json);
}

/* The object that row k is the first of. */
static void json_object_rows(struct json *json, const struct report *report, size_t k)
{
    const char *object = report->row[k].object;
    json_object(json, object);
    for (; k < report->n; k++)
        if (report->row[k].object && strcmp(report->row[k].object, object) == 0)
            json_row(json, &report->row[k]);
    json_end_object(json);
}

enum ad_status report_json(const struct report *report, FILE *out, struct ad_error *error)
{
    struct json json;
    if (complete(report, error) != AD_OK)
        return error->status;
    json_open(&json, out);
    for (size_t k = 0; k < report->n;) {
        size_t end = report->row[k].array ? array_end(report, k) : k + 1;
        if (report->row[k].array)
            json_rows(&json, report, k, end);
        else if (!report->row[k].object)
            json_row(&json, &report->row[k]);
        k = end;
    }
    for (size_t k = 0; k < report->n; k++)
        if (report->row[k].object && is_first(report, k, false))
            json_object_rows(&json, report, k);
    json_close(&json);
    return AD_OK;
}

/* ---- HDF5 ---- */

enum ad_status report_file(const struct report *report, phys_hdf5 *file, struct ad_error *error)
{
    char object[96], name[192];
    for (size_t k = 0; k < report->n && !report->failed; k++) {
        const struct report_row *row = &report->row[k];
        const char *unit = *row->unit ? row->unit : NULL;
        if (row->passing || row->kind == LINE)
            continue;
        snprintf(object, sizeof object, "/");
        snprintf(name, sizeof name, "%s", row->key);
        if (row->array)
            snprintf(object, sizeof object, "%s/%zu", row->array, row->item);
        else if (row->object)
            snprintf(object, sizeof object, "%s", row->object);
        if (row->array || row->object) {
            snprintf(name, sizeof name, "%s/%s", object, row->key);
            if (is_first(report, k, true))
                phys_hdf5_folder(file, object);
        }
        if (row->kind == NUMBER)
            phys_hdf5_number(file, object, row->key, row->number, unit);
        else if (row->kind == COUNT || row->kind == FLAG)
            phys_hdf5_integer(file, object, row->key, (int64_t)row->n, NULL);
        else if ((row->kind == TEXT || row->kind == TEXTS) && row->text)
            phys_hdf5_text(file, object, row->key, row->text);
        else if (row->kind == LIST)
            phys_hdf5_write(file, name, AD_F64, 1, &row->n, row->list);
    }
    return complete(report, error);
}

void report_parameters(const struct phys_system *system, phys_hdf5 *file)
{
    const struct phys_scene *scene = system->scene;
    phys_hdf5_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_hdf5_number(file, "parameters", scene->params[k].name,
                         phys_system_get(system, scene->params[k].name), scene->params[k].unit);
}

enum ad_status report_show(struct report *report, const struct common *common,
                           struct ad_error *error)
{
    if (error->status == AD_OK && common->json)
        report_json(report, stdout, error);
    else if (error->status == AD_OK && !common->quiet)
        report_print(report, stdout, error);
    report_free(report);
    return error->status;
}
