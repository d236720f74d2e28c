/* Tables and pictures of charts (chart_table.h). */
#include "chart_table.h"
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/files.h"

#include <stdlib.h>
#include <string.h>

static size_t split(char *line, const char *cells[])
{
    size_t n = 0;
    for (char *next = line; next && n < MOST_COLUMNS; n++) {
        cells[n] = next;
        next = strchr(next, ',');
        if (next)
            *next++ = '\0';
    }
    return n;
}

struct table *table_read(const char *name)
{
    struct table *table = calloc(1, sizeof *table);
    size_t size;
    assert_non_null(table);
    table->text = files_read(shell_path(name), &size);
    for (char *line = strtok(table->text, "\n"); line; line = strtok(NULL, "\n")) {
        if (*line == '#')
            continue;
        if (!table->columns) {
            table->columns = split(line, table->name);
            continue;
        }
        assert_true(table->rows < MOST_ROWS);
        assert_int_equal(split(line, table->cell[table->rows++]), table->columns);
    }
    return table;
}

void table_free(struct table *table)
{
    free(table->text);
    free(table);
}

static size_t column(const struct table *table, const char *name)
{
    for (size_t c = 0; c < table->columns; c++)
        if (strcmp(table->name[c], name) == 0)
            return c;
    print_error("no column %s\n", name);
    fail();
    return 0;
}

double table_number(const struct table *table, size_t row, const char *name)
{
    char *end;
    const char *cell = table->cell[row][column(table, name)];
    double value = strtod(cell, &end);
    if (*cell == '\0' || *end != '\0' || !isfinite(value))
        print_error("row %zu, %s: '%s'\n", row, name, cell);
    assert_true(*cell != '\0' && *end == '\0' && isfinite(value));
    return value;
}

bool table_is(const struct table *table, size_t row, const char *name, const char *value)
{
    return strcmp(table->cell[row][column(table, name)], value) == 0;
}

void table_expect_header(const struct table *table, const char *header)
{
    char text[256] = "";
    for (size_t c = 0; c < table->columns; c++) {
        strcat(text, c ? "," : "");
        strcat(text, table->name[c]);
    }
    assert_string_equal(text, header);
}

void expect_files(size_t n, const char *const names[])
{
    for (size_t k = 0; k < n; k++) {
        size_t size;
        free(files_read(shell_path(names[k]), &size));
        assert_true(size > 0);
    }
    assert_int_equal(shell_files(), n);
}

bool gnuplot(void) { return system("command -v gnuplot >/dev/null") == 0; }
