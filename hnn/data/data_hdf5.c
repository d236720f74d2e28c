/* Columns of an HDF5 file: one-dimensional arrays, and the columns of two-dimensional ones (their
   rows, where the attribute "axes" says that samples run along them: "..., sample"). */
#include "autodiff/free.h"
#include "data_source.h"
#include "physics/io/grow.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS_MOST = 4096 }; /* of one array: more are pictures, or weights */

/* One array, and which of its columns. */
struct column {
    char *array;
    size_t rank, index, rows;
    bool across; /* samples run along the second dimension */
};

struct hdf5 {
    struct hnn_source source;
    phys_hdf5 *file;
    struct column *column; /* [source.columns] */
    size_t rows, at, last; /* of the columns read; read so far; first of the last read */
    char *order;           /* the attribute "columns", or NULL */
    bool out_of_memory;
};

static struct hdf5 *hdf5_of(struct hnn_source *source) { return (struct hdf5 *)source; }

/* ---- the columns of a file ---- */

static char *column_name(const char *array, size_t rank, size_t index)
{
    size_t size = strlen(array) + 32;
    char *name = malloc(size);
    if (name)
        snprintf(name, size, rank == 1 ? "%s" : "%s.%zu", array, index + 1);
    return name;
}

static bool add_column(struct hdf5 *h, const struct phys_hdf5_item *item, size_t index)
{
    struct hnn_source *s = &h->source;
    size_t n = s->columns;
    if (!phys_grow(&h->column, n, sizeof *h->column) || !phys_grow(&s->name, n, sizeof *s->name))
        return false;
    struct column c = {strdup(item->object), item->rank, index, item->dims[0], false};
    h->column[n] = c;
    s->name[n] = column_name(item->object, item->rank, index);
    s->columns++;
    return c.array && s->name[n];
}

static void add_array(struct hdf5 *h, const struct phys_hdf5_item *item)
{
    size_t n = item->rank == 1 ? 1 : item->dims[1];
    for (size_t k = 0; k < n && n <= COLUMNS_MOST && !h->out_of_memory; k++)
        h->out_of_memory = !add_column(h, item, k);
}

/* Replaces the columns of an array, the last ones of the list, by its rows. */
static void turn_array(struct hdf5 *h, const char *array)
{
    struct hnn_source *s = &h->source;
    struct phys_hdf5_item item;
    struct ad_error ignored = {0};
    if (phys_hdf5_shape(h->file, array, &item, &ignored) != AD_OK || item.rank != 2)
        return;
    for (; s->columns && strcmp(h->column[s->columns - 1].array, array) == 0; s->columns--) {
        AD_FREE(h->column[s->columns - 1].array, s->name[s->columns - 1]);
    }
    size_t first = s->columns, rows = item.dims[1];
    item.dims[1] = item.dims[0];
    add_array(h, &item);
    for (size_t k = first; k < s->columns; k++) {
        h->column[k].rows = rows;
        h->column[k].across = true;
    }
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n >= m && strcmp(text + n - m, end) == 0;
}

static void visit(void *context, const struct phys_hdf5_item *item)
{
    struct hdf5 *h = context;
    bool numbers = item->kind == PHYS_HDF5_F64 || item->kind == PHYS_HDF5_F32 ||
                   item->kind == PHYS_HDF5_INTEGER;
    if (h->out_of_memory)
        return;
    if (!item->attribute && numbers && (item->rank == 1 || item->rank == 2))
        add_array(h, item);
    else if (item->attribute && item->kind == PHYS_HDF5_TEXT &&
             strcmp(item->attribute, "axes") == 0 && ends_with(item->text, "sample"))
        turn_array(h, item->object);
    else if (item->attribute && item->kind == PHYS_HDF5_TEXT && !*item->object &&
             strcmp(item->attribute, "columns") == 0)
        h->out_of_memory = !(h->order = strdup(item->text));
}

/* Moves the column of that name to place `to`, those between one on. */
static bool move_column(struct hdf5 *h, const char *name, size_t length, size_t to)
{
    struct hnn_source *s = &h->source;
    size_t k = to;
    while (k < s->columns && !(strlen(s->name[k]) == length && !strncmp(s->name[k], name, length)))
        k++;
    if (k == s->columns)
        return false;
    struct column column = h->column[k];
    char *kept = s->name[k];
    memmove(h->column + to + 1, h->column + to, (k - to) * sizeof *h->column);
    memmove(s->name + to + 1, s->name + to, (k - to) * sizeof *s->name);
    h->column[to] = column;
    s->name[to] = kept;
    return true;
}

/* Whether a follows b by name, numbers in it by value: q10 follows q2. */
static bool follows(const char *a, const char *b)
{
    static const char digits[] = "0123456789";
    for (; *a && *b; a++, b++) {
        const size_t n = strspn(a, digits), m = strspn(b, digits);
        if (n && m && n != m)
            return n > m;
        if (*a != *b)
            return *a > *b;
    }
    return *a;
}

/* In the order given by the file; the others follow by name. */
static void put_in_order(struct hdf5 *h)
{
    size_t n = 0;
    for (size_t k = 1; k < h->source.columns; k++) {
        size_t to = k;
        while (to > 0 && follows(h->source.name[to - 1], h->source.name[k]))
            to--;
        move_column(h, h->source.name[k], strlen(h->source.name[k]), to);
    }
    h->source.ordered = h->order != NULL;
    for (const char *p = h->order; p; p = strchr(p, ',') ? strchr(p, ',') + 1 : NULL)
        n += move_column(h, p, strcspn(p, ","), n);
}

/* ---- reading ---- */

static enum ad_status check_lengths(struct hdf5 *h, double *const *to, struct ad_error *error)
{
    const struct hnn_source *s = &h->source;
    size_t first = 0;
    while (first < s->columns && !to[first])
        first++;
    h->rows = first < s->columns ? h->column[first].rows : 0;
    for (size_t c = first; c < s->columns; c++)
        if (to[c] && h->column[c].rows != h->rows)
            return ad_fail(error, AD_E_INPUT,
                           "%s: expected columns of one length, '%s' has %zu rows and '%s' %zu",
                           s->file, s->name[first], h->rows, s->name[c], h->column[c].rows);
    if (first < s->columns && h->rows == 0)
        return ad_fail(error, AD_E_INPUT, "%s: expected rows of numbers, found none in '%s'",
                       s->file, s->name[first]);
    return AD_OK;
}

static enum ad_status read_column(struct hdf5 *h, size_t column, size_t rows, double *values,
                                  struct ad_error *error)
{
    const struct column *c = &h->column[column];
    size_t first[2] = {h->at, c->index}, count[2] = {rows, 1};
    if (c->across) {
        first[0] = c->index, first[1] = h->at;
        count[0] = 1, count[1] = rows;
    }
    if (phys_hdf5_read_block(h->file, c->array, first, count, values, error) != AD_OK)
        return error->status;
    for (size_t i = 0; i < rows; i++)
        if (!isfinite(values[i]) && !(isnan(values[i]) && h->source.skip_missing))
            return ad_fail(error, AD_E_INPUT,
                           "%s: expected a finite number in row %zu of '%s', "
                           "found %g",
                           h->source.file, h->at + i + 1, h->source.name[column], values[i]);
    return AD_OK;
}

static enum ad_status hdf5_read(struct hnn_source *source, size_t room, double *const *to,
                                size_t *rows, struct ad_error *error)
{
    struct hdf5 *h = hdf5_of(source);
    if (h->at == 0 && check_lengths(h, to, error) != AD_OK)
        return error->status;
    *rows = h->rows - h->at < room ? h->rows - h->at : room;
    for (size_t c = 0; c < source->columns && *rows; c++)
        if (to[c] && read_column(h, c, *rows, to[c], error) != AD_OK)
            return error->status;
    h->last = h->at;
    h->at += *rows;
    return AD_OK;
}

static void hdf5_place(const struct hnn_source *source, size_t k, char *text, size_t size)
{
    snprintf(text, size, "%s: row %zu", source->file, ((const struct hdf5 *)source)->last + k + 1);
}

static void hdf5_close(struct hnn_source *source)
{
    struct hdf5 *h = hdf5_of(source);
    for (size_t k = 0; k < source->columns; k++)
        free(h->column[k].array);
    phys_fields_free(source->name, source->columns);
    phys_hdf5_close(h->file);
    AD_FREE(h->column, h->order, h);
}

static const struct hnn_source_kind hdf5_kind = {hdf5_read, hdf5_place, hdf5_close};

enum ad_status hnn_hdf5_open(const char *file, struct hnn_source **source, struct ad_error *error)
{
    struct hdf5 *h = calloc(1, sizeof *h);
    if (!h)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
    h->source = (struct hnn_source){.kind = &hdf5_kind, .file = file};
    if (phys_hdf5_open(file, &h->file, error) == AD_OK &&
        phys_hdf5_list(h->file, visit, h, error) == AD_OK) {
        if (h->out_of_memory)
            ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
        else if (h->source.columns == 0)
            ad_fail(error, AD_E_INPUT,
                    "%s: expected arrays of one or two dimensions, found none; models of "
                    "pixels learn from frames",
                    file);
    }
    if (error->status == AD_OK) {
        put_in_order(h);
        *source = &h->source;
    } else {
        hdf5_close(&h->source);
    }
    return error->status;
}
