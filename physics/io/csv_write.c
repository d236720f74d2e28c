/* Writes a matrix as CSV, atomically (csv.h). */
#include "csv.h"
#include "atomic_file.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* 17 significant digits tell every double from its neighbours. */
static void write_number(FILE *stream, double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.17g", value);
    char *comma = strchr(text, ','); /* the decimal point of some locales */
    if (comma)
        *comma = '.';
    fputs(text, stream);
}

static bool write_rows(FILE *stream, const char *header, size_t rows, size_t cols,
                       const double *values)
{
    if (header)
        fprintf(stream, "%s\n", header);
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j < cols; j++) {
            write_number(stream, values[i * cols + j]);
            fputc(j + 1 < cols ? ',' : '\n', stream);
        }
    return !ferror(stream);
}

enum ad_status phys_table_write(const char *file, const char *header, size_t rows, size_t cols,
                                const double *values, struct ad_error *error)
{
    struct phys_atomic_file whole;
    enum ad_status status = phys_atomic_file_begin(&whole, file, error);
    if (status != AD_OK)
        return status;
    FILE *stream = fopen(whole.temporary, "w");
    bool written = stream && write_rows(stream, header, rows, cols, values);
    if (stream && fclose(stream) != 0)
        written = false;
    if (written)
        return phys_atomic_file_commit(&whole, error);
    status = ad_fail(error, AD_E_IO, "%s: cannot be written: %s", file, strerror(errno));
    phys_atomic_file_abandon(&whole);
    return status;
}
