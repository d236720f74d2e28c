/* Tables of numbers as text: paths [slices x dof], data sets, exports of spreadsheets; plain or
   compressed by gzip, from files and pipes. One row per line; fields separated by commas,
   semicolons, tabs or blanks. Blank lines, comments from # or % to the end of the line, quoted
   fields, CRLF and a byte order mark are understood. Numbers are rounded correctly, in any locale.
 */
#ifndef PHYSICS_IO_CSV_H
#define PHYSICS_IO_CSV_H

#include "fields.h"
#include "lines.h"

/* ---- a whole matrix ---- */

/* Reads a matrix; a first line of column names is skipped, and blanks separate as well as commas.
   `values` [rows x cols], row-major, is freed by the caller; unchanged on failure. AD_E_INPUT names
   file, line and column (in characters) and what was expected there: text, NaN or infinity, an
   empty field, a row of another length, no rows. AD_E_IO: cannot be read. */
enum ad_status phys_table_read(const char *file, size_t *rows, size_t *cols, double **values,
                               struct ad_error *error);

/* As phys_table_read, with the names of the columns [cols], NULL where there are none; free them by
   phys_fields_free. */
enum ad_status phys_table_read_named(const char *file, size_t *rows, size_t *cols, double **values,
                                     char ***names, struct ad_error *error);

/* ---- columns, some rows at a time: memory for one buffer of text, whatever the file's size ----

   A first line none of whose fields is a number names the columns; a second such line is of units,
   and left out. The last comment before the first row names them, too, if it has as many fields as
   rows have ("# q p"). In columns of blanks it may leave out trial and time, which come first, and
   the rates of those named, which come last ("% o v" over trial, time, o, v, or over trial, time,
   o, v, dodt, dvdt), as in the data of M. Schmidt and H. Lipson, Science 324, 2009. */

enum { PHYS_CSV_ROWS = 4096 }; /* most rows of one read */

struct phys_csv {
    const char *file;
    bool matrix;                /* set before phys_csv_open: as phys_table_read describes */
    bool skip_missing;          /* missing values are read as NaN; else they are refused */
    bool leave_out;             /* ... and rows in which a needed column lacks one are left out */
    size_t left_out;            /* how many rows so far */
    size_t columns, names_line; /* line that names the columns; 0: none */
    char **name;                /* [columns], NULL where a column has none; NULL: no names at all */
    size_t units_line;          /* line below it without a number, left out; 0: none */
    size_t mixed_line;          /* first row, where it has words among its numbers; 0: none */
    size_t line[PHYS_CSV_ROWS]; /* of each row of the last read */
    /* the reader's own: */
    struct phys_lines lines;
    struct phys_separator separator;
    const char *start, *stop; /* of the present line; NULL: none yet, or no more */
};
/* Opens a file and reads up to its first row, skipping the first `skip` lines. AD_E_INPUT, AD_E_IO
   as phys_table_read. `file` must outlive it. Close with phys_csv_close in any case. */
enum ad_status phys_csv_open(struct phys_csv *csv, const char *file, size_t skip,
                             struct ad_error *error);
/* The next rows, at most `room` and PHYS_CSV_ROWS, 0 at the end: row i of column c goes to
   to[c][i * stride]; to[c] NULL: the column is not needed, and not looked at. */
enum ad_status phys_csv_read(struct phys_csv *csv, size_t room, double *const *to, size_t stride,
                             size_t *rows, struct ad_error *error);
void phys_csv_close(struct phys_csv *csv);

#endif
