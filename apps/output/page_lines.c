/* Axes and panels of lines of a page (page_parts.h). */
#include "autodiff/free.h"
#include "page_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 600 };

bool page_has(phys_hdf5 *file, const char *name, size_t rank, struct phys_hdf5_item *item)
{
    struct ad_error none = {0};
    if (!name || phys_hdf5_shape(file, name, item, &none) != AD_OK || item->rank != rank ||
        item->kind > PHYS_HDF5_INTEGER)
        return false;
    for (size_t k = 0, room = SIZE_MAX / 64; k < rank; room /= item->dims[k++])
        if (item->dims[k] == 0 || item->dims[k] > room)
            return false;
    return true;
}

double *page_axis(phys_hdf5 *file, const char *name, size_t n, double first, struct ad_error *error)
{
    struct phys_hdf5_item item;
    double *value = malloc(n * sizeof *value);
    if (!value)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (page_has(file, name, 1, &item) && item.dims[0] == n)
        phys_hdf5_read(file, name, 0, n, value, error);
    else
        for (size_t i = 0; i < n; i++)
            value[i] = first + (double)i;
    return value;
}

void page_write_axis(phys_hdf5 *file, struct json *json, const char *key, const char *name,
                     size_t n, double first, size_t kept, const size_t *pick,
                     struct ad_error *error)
{
    double *value = page_axis(file, name, n, first, error);
    for (size_t i = 0; value && i < kept; i++)
        value[i] = value[pick ? pick[i] : i];
    json_object(json, key);
    json_text(json, "dataset", name);
    json_count(json, "of", n);
    if (value)
        page_doubles(json, "values", kept, value, error);
    json_end_object(json);
    free(value);
}

/* A column of a dataset [n], or [n x columns], or [n x sets x columns], of the first set. */
static double *read_line(phys_hdf5 *file, const struct line *line, size_t *n,
                         struct ad_error *error)
{
    struct phys_hdf5_item item;
    size_t rank = 1, width = 1;
    while (rank < 4 && !page_has(file, line->dataset, rank, &item))
        rank++;
    if (rank == 4)
        return NULL;
    for (size_t k = 1; k < rank; k++)
        width *= item.dims[k];
    double *value = line->column < width ? malloc(item.dims[0] * width * sizeof *value) : NULL;
    *n = item.dims[0];
    if (value)
        phys_hdf5_read(file, line->dataset, 0, *n, value, error);
    for (size_t i = 0; value && i < *n; i++)
        value[i] = value[i * width + line->column];
    const double start = value ? value[0] : 0;
    for (size_t i = 0; value && line->change && i < *n; i++)
        value[i] = fabs(value[i] - start) / (start != 0 ? fabs(start) : 1);
    return value;
}

static void write_lines(phys_hdf5 *file, const struct series *series, size_t lines,
                        const struct line *const line[], size_t n, double *value, struct json *json,
                        struct ad_error *error)
{
    size_t *pick = malloc(n * sizeof *pick);
    double *seen = malloc(lines * n * sizeof *seen);
    if (!pick || !seen) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        AD_FREE(pick, seen);
        return;
    }
    for (size_t i = 0; i < lines * n; i++)
        seen[i] = !series->log ? value[i] : value[i] > 0 ? log(value[i]) : (double)NAN;
    const size_t kept = page_pick(n, lines, seen, LINE, pick);
    json_object(json, NULL);
    json_bool(json, "log", series->log);
    page_write_axis(file, json, "over", series->over, n, 0, kept, pick, error);
    json_array(json, "lines");
    for (size_t k = 0; k < lines; k++) {
        for (size_t i = 0; i < kept; i++)
            seen[i] = value[k * n + pick[i]];
        json_object(json, NULL);
        json_text(json, "name", line[k]->name);
        json_text(json, "dataset", line[k]->change ? NULL : line[k]->dataset);
        page_floats(json, "data", kept, seen, error);
        json_end_object(json);
    }
    json_end_array(json);
    json_end_object(json);
    AD_FREE(pick, seen);
}

void page_write_series(phys_hdf5 *file, const struct series *series, struct json *json,
                       struct ad_error *error)
{
    const struct line *line[3];
    double *value = NULL;
    size_t n = 0, lines = 0;
    for (size_t k = 0; k < 3 && series->line[k].dataset && error->status == AD_OK; k++) {
        size_t length = 0;
        double *column = read_line(file, &series->line[k], &length, error);
        if (column && (lines == 0 || length == n)) {
            double *more = realloc(value, (lines + 1) * length * sizeof *value);
            if (more) {
                value = more;
                n = length;
                memcpy(value + lines * n, column, n * sizeof *column);
                line[lines++] = &series->line[k];
            } else {
                ad_fail(error, AD_E_MEMORY, "out of memory");
            }
        }
        free(column);
    }
    if (lines && n > 1 && error->status == AD_OK)
        write_lines(file, series, lines, line, n, value, json, error);
    free(value);
}
