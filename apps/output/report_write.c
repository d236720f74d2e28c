/* A report as JSON, and in an HDF5 file (report.h). */
#include "report_rows.h"
#include "json.h"
#include "scan.h"

#include <stdlib.h>
#include <string.h>

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
        if (report_begins_item(report, k))
            json_object(json, NULL);
        json_row(json, &report->row[k]);
        if (k + 1 == end || report_begins_item(report, k + 1))
            json_end_object(json);
    }
    json_end_array(json);
}

/* The object whose first row is k. */
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
    if (report_complete(report, error) != AD_OK)
        return error->status;
    json_open(&json, out);
    for (size_t k = 0; k < report->n;) {
        size_t end = report->row[k].array ? report_array_end(report, k) : k + 1;
        if (report->row[k].array)
            json_rows(&json, report, k, end);
        else if (!report->row[k].object)
            json_row(&json, &report->row[k]);
        k = end;
    }
    for (size_t k = 0; k < report->n; k++)
        if (report->row[k].object && report_is_first(report, k, false))
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
            if (report_is_first(report, k, true))
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
    return report_complete(report, error);
}

void report_coordinates(phys_hdf5 *file, size_t n, const void *context,
                        void (*name)(const void *context, size_t k, char *text, size_t size),
                        size_t of_body)
{
    char *names = NULL, text[80];
    size_t length;
    FILE *out = open_memstream(&names, &length);
    for (size_t k = 0; out && k < n; k++) {
        name(context, k, text, sizeof text);
        fprintf(out, "%s%s", k ? "\n" : "", text);
    }
    if (out && fclose(out) == 0)
        phys_hdf5_text(file, "/", "coordinates", names);
    phys_hdf5_integer(file, "/", "body_coordinates", (int64_t)of_body, NULL);
    free(names);
}

static void coordinate_name(const void *system, size_t k, char *text, size_t size)
{
    phys_coordinate_name(system, k, text, size);
}

void report_parameters(const struct phys_system *system, phys_hdf5 *file)
{
    const struct phys_scene *scene = system->scene;
    const bool placed = scene->picture == PHYS_PICTURE_PLANE && system->dims >= 2;
    report_coordinates(file, system->dof, system, coordinate_name, placed ? system->dims : 0);
    phys_hdf5_folder(file, "parameters");
    for (size_t k = 0; k < scene->n_params; k++)
        phys_hdf5_number(file, "parameters", scene->params[k].name,
                         phys_system_get(system, scene->params[k].name), scene->params[k].unit);
}

enum ad_status report_show(struct report *report, const struct common *common,
                           struct ad_error *error)
{
    if (error->status == AD_OK && common->scanning)
        scan_take(common->scanning, report);
    else if (error->status == AD_OK && common->json)
        report_json(report, stdout, error);
    else if (error->status == AD_OK && !common->quiet)
        report_print(report, stdout, error);
    report_free(report);
    return error->status;
}
