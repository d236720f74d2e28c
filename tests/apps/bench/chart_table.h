/* Tables and pictures that a chart wrote into the work folder (shell.h). */
#ifndef TESTS_APPS_BENCH_CHART_TABLE_H
#define TESTS_APPS_BENCH_CHART_TABLE_H

#include <stdbool.h>
#include <stddef.h>

enum { MOST_ROWS = 1 << 14, MOST_COLUMNS = 32 };

struct table {
    size_t rows, columns;
    char *text;
    const char *name[MOST_COLUMNS];
    const char *cell[MOST_ROWS][MOST_COLUMNS];
};

/* A file of comma-separated values; every row has the columns of the first, lines with # are left
   out. Ends with table_free. */
struct table *table_read(const char *name);
void table_free(struct table *table);

/* The cell of a row in the column of that name, a finite number; whether it is this text. */
double table_number(const struct table *table, size_t row, const char *name);
bool table_is(const struct table *table, size_t row, const char *name, const char *value);

/* The names of all columns, with commas between. */
void table_expect_header(const struct table *table, const char *header);
/* These files are there, none of them empty, and no others. */
void expect_files(size_t n, const char *const names[]);

bool gnuplot(void);

#endif
