/* Numeric matrices as text: paths [slices x dof], data sets, anything a spreadsheet writes. */
#ifndef PHYSICS_TABLE_H
#define PHYSICS_TABLE_H

#include "autodiff/autodiff.h"

/* Reads a matrix: one row a line; numbers separated by commas, semicolons or blanks; optionally one
   line of column names first. Blank lines, comments from # or % to the end of the line, CRLF and a
   byte order mark are skipped. Works on pipes. Numbers are rounded correctly, in any locale.
   `values` [rows x cols], row-major, belongs to the caller (free); untouched on failure.
   AD_E_INPUT names file, line and column (in characters) and what was expected there: text, NaN and
   infinities, an empty field, a row of another length, no rows at all. AD_E_IO: cannot be read. */
enum ad_status phys_table_read(const char *file, size_t *rows, size_t *cols, double **values,
                               struct ad_error *error);

/* Writes a matrix as CSV with 17 significant digits, so that reading it gives the same doubles,
   under a line of column names (NULL: none). The file appears whole or not at all. */
enum ad_status phys_table_write(const char *file, const char *header, size_t rows, size_t cols,
                                const double *values, struct ad_error *error);

#endif
