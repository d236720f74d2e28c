/* Tables of measurements (sheet.h). */
#include "sheet.h"
#include "apps/quote.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void write_titles(const struct sheet *sheet)
{
    const char *between = "";
    for (size_t c = 0; sheet->csv && c < sheet->columns; c++)
        if (!sheet->column[c].no_csv) {
            fprintf(sheet->csv, "%s%s", between, sheet->column[c].key);
            between = ",";
        }
    if (sheet->csv)
        fputc('\n', sheet->csv);
    if (!sheet->terminal)
        return;
    for (size_t c = 0; c < sheet->columns; c++)
        if (sheet->column[c].title)
            fprintf(sheet->terminal, "%*s ", sheet->column[c].width, sheet->column[c].title);
    fputc('\n', sheet->terminal);
}

void sheet_open(struct sheet *sheet, const struct column *columns, FILE *csv, FILE *terminal)
{
    *sheet = (struct sheet){.column = columns, .csv = csv, .terminal = terminal};
    bool titled = false;
    for (; columns[sheet->columns].key; sheet->columns++)
        titled = titled || columns[sheet->columns].title;
    if (!titled)
        sheet->terminal = NULL;
    assert(sheet->columns <= SHEET_COLUMNS);
    write_titles(sheet);
}

static void write_csv(const struct sheet *sheet, const struct cell *row)
{
    const char *between = "";
    for (size_t c = 0; c < sheet->columns; c++) {
        const struct column *column = &sheet->column[c];
        if (column->no_csv)
            continue;
        fputs(between, sheet->csv);
        between = ",";
        if (row[c].name)
            quote_csv_name(sheet->csv, row[c].name, "");
        else if (isfinite(row[c].number))
            fprintf(sheet->csv, "%.*g", column->digits ? column->digits : 6, row[c].number);
    }
    fputc('\n', sheet->csv);
}

static void show(const struct sheet *sheet, const struct cell *row)
{
    for (size_t c = 0; c < sheet->columns; c++) {
        const struct column *column = &sheet->column[c];
        double value = row[c].number * (column->scale != 0 ? column->scale : 1);
        if (!column->title)
            continue;
        if (row[c].name || !isfinite(value))
            fprintf(sheet->terminal, "%*s ", column->width, row[c].name ? row[c].name : "-");
        else
            fprintf(sheet->terminal, column->fixed ? "%*.*f " : "%*.*g ", column->width,
                    column->shown, value);
    }
    fputc('\n', sheet->terminal);
    fflush(sheet->terminal);
}

void sheet_json(const struct sheet *sheet, const char *key, struct json *json)
{
    json_array(json, key);
    for (size_t k = 0; k < sheet->rows * sheet->columns; k++) {
        const struct cell *cell = &sheet->cell[k];
        size_t c = k % sheet->columns;
        if (c == 0)
            json_object(json, NULL);
        if (cell->name)
            json_text(json, sheet->column[c].key, cell->name);
        else
            json_number(json, sheet->column[c].key, cell->number);
        if (c + 1 == sheet->columns)
            json_end_object(json);
    }
    json_end_array(json);
}

static enum ad_status keep(struct sheet *sheet, const struct cell *row)
{
    size_t n = sheet->rows * sheet->columns;
    struct cell *cell = realloc(sheet->cell, (n + sheet->columns) * sizeof *cell);
    if (!cell)
        return AD_E_MEMORY;
    sheet->cell = cell;
    memcpy(cell + n, row, sheet->columns * sizeof *cell);
    for (size_t c = 0; c < sheet->columns; c++)
        if (row[c].name && !(cell[n + c].name = strdup(row[c].name))) {
            while (c-- > 0)
                free((char *)cell[n + c].name);
            return AD_E_MEMORY;
        }
    sheet->rows++;
    return AD_OK;
}

enum ad_status sheet_row(struct sheet *sheet, const struct cell *row, struct ad_error *error)
{
    if (error->status != AD_OK || keep(sheet, row) != AD_OK)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (sheet->csv)
        write_csv(sheet, row);
    if (sheet->terminal)
        show(sheet, row);
    return AD_OK;
}

void sheet_free(struct sheet *sheet)
{
    for (size_t k = 0; k < sheet->rows * sheet->columns; k++)
        free((char *)sheet->cell[k].name);
    free(sheet->cell);
    *sheet = (struct sheet){0};
}

size_t sheet_column(const struct sheet *sheet, const char *key)
{
    size_t c = 0;
    while (c < sheet->columns && strcmp(sheet->column[c].key, key) != 0)
        c++;
    assert(c < sheet->columns);
    return c;
}

double sheet_number(const struct sheet *sheet, size_t row, const char *key)
{
    return sheet->cell[row * sheet->columns + sheet_column(sheet, key)].number;
}

bool sheet_is(const struct sheet *sheet, size_t row, const char *key, const char *name)
{
    const char *is = sheet->cell[row * sheet->columns + sheet_column(sheet, key)].name;
    return is && strcmp(is, name) == 0;
}
