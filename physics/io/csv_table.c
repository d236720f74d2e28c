/* Reads a CSV file as one matrix (csv.h). */
#include "csv.h"

#include <stdint.h>
#include <stdlib.h>

struct matrix {
    double *values; /* [capacity x cols], n rows of it read */
    double **to;    /* [cols]: where row n goes */
    size_t n, capacity, cols;
};

/* Room for the rows of the next read. */
static bool make_room(struct matrix *m)
{
    if (m->capacity - m->n < PHYS_CSV_ROWS) {
        size_t capacity = 2 * m->capacity + PHYS_CSV_ROWS;
        if (capacity > SIZE_MAX / 4 / sizeof(double) / m->cols)
            return false;
        double *values = realloc(m->values, capacity * m->cols * sizeof *values);
        if (!values)
            return false;
        m->values = values;
        m->capacity = capacity;
    }
    for (size_t c = 0; c < m->cols; c++)
        m->to[c] = m->values + m->n * m->cols + c;
    return true;
}

static enum ad_status read_rows(struct phys_csv *csv, struct matrix *m, struct ad_error *error)
{
    m->to = malloc(m->cols * sizeof *m->to);
    for (size_t rows = 1; rows; m->n += rows) {
        if (!m->to || !make_room(m))
            return ad_fail(error, AD_E_MEMORY, "%s: out of memory", csv->file);
        if (phys_csv_read(csv, PHYS_CSV_ROWS, m->to, m->cols, &rows, error) != AD_OK)
            return error->status;
    }
    return AD_OK;
}

enum ad_status phys_table_read_named(const char *file, size_t *rows, size_t *cols, double **values,
                                     char ***names, struct ad_error *error)
{
    struct phys_csv csv = {.matrix = true};
    struct matrix m = {0};
    struct ad_error found = {0}; /* the caller may pass none */
    if (phys_csv_open(&csv, file, 0, &found) == AD_OK) {
        m.cols = csv.columns;
        read_rows(&csv, &m, &found);
    }
    if (names && found.status == AD_OK) {
        *names = csv.name;
        csv.name = NULL;
    }
    phys_csv_close(&csv);
    free(m.to);
    if (found.status != AD_OK) {
        free(m.values);
        return ad_fail(error, found.status, "%s", found.message);
    }
    *rows = m.n;
    *cols = m.cols;
    *values = m.values;
    return AD_OK;
}

enum ad_status phys_table_read(const char *file, size_t *rows, size_t *cols, double **values,
                               struct ad_error *error)
{
    return phys_table_read_named(file, rows, cols, values, NULL, error);
}
