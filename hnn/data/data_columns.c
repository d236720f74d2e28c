/* Columns that are in memory already, read as those of a file. */
#include "data.h"
#include "data_source.h"
#include "physics/io/fields.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct memory {
    struct hnn_source source;
    const struct hnn_columns *from;
    size_t at, last; /* rows read so far; first of the last read */
};

static enum ad_status columns_read(struct hnn_source *source, size_t room, double *const *to,
                                   size_t *rows, struct ad_error *error)
{
    struct memory *m = (struct memory *)source;
    size_t left = m->from->rows - m->at;
    m->last = m->at;
    *rows = left < room ? left : room;
    *rows = *rows < PHYS_CSV_ROWS ? *rows : PHYS_CSV_ROWS;
    for (size_t c = 0; c < source->columns; c++)
        for (size_t i = 0; to[c] && i < *rows; i++) {
            double value = to[c][i] = m->from->column[c][m->at + i];
            if (!isfinite(value) && !(isnan(value) && source->skip_missing))
                return ad_fail(error, AD_E_INPUT,
                               "%s: expected a finite number in row %zu of column %zu, found %g",
                               source->file, m->at + i + 1, c + 1, value);
        }
    m->at += *rows;
    return AD_OK;
}

static void columns_place(const struct hnn_source *source, size_t k, char *text, size_t size)
{
    snprintf(text, size, "%s: row %zu", source->file,
             ((const struct memory *)source)->last + k + 1);
}

static void columns_close(struct hnn_source *source)
{
    phys_fields_free(source->name, source->columns);
    free(source);
}

static const struct hnn_source_kind columns_kind = {columns_read, columns_place, columns_close};

enum ad_status hnn_columns_open(const struct hnn_columns *columns, const char *what,
                                struct hnn_source **source, struct ad_error *error)
{
    *source = NULL;
    if (AD_LACKS(error, columns, columns->column))
        return error->status;
    if (!columns->n || !columns->rows)
        return ad_fail(error, AD_E_ARGUMENT, "%s: %zu columns of %zu rows; expected some", what,
                       columns->n, columns->rows);
    for (size_t k = 0; k < columns->n; k++)
        if (!columns->column[k])
            return ad_fail(error, AD_E_ARGUMENT, "%s: column %zu is NULL", what, k + 1);
    struct memory *m = calloc(1, sizeof *m);
    char **names = columns->names ? calloc(columns->n, sizeof *names) : NULL;
    bool room = m && (names || !columns->names);
    for (size_t k = 0; room && names && k < columns->n; k++)
        room = !columns->names[k] || (names[k] = strdup(columns->names[k]));
    if (!room) {
        phys_fields_free(names, columns->n);
        free(m);
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", what);
    }
    m->from = columns;
    m->source = (struct hnn_source){
        .kind = &columns_kind, .file = what, .columns = columns->n, .name = names, .ordered = true};
    *source = &m->source;
    return AD_OK;
}
