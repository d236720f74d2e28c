/* A sheet: rows of measurements under named columns. One table of columns drives the CSV file, the
   lines on the terminal, the rows of the JSON object and the curves of pictures (figure.h). */
#ifndef APPS_OUTPUT_SHEET_H
#define APPS_OUTPUT_SHEET_H

#include "json.h"
#include "autodiff/autodiff.h"

enum { SHEET_COLUMNS = 32 };

struct column {
    const char *key;   /* in CSV and JSON */
    int digits;        /* of a number in the CSV; 0: 6 */
    const char *title; /* on the terminal; NULL: not shown */
    int width;         /* of the terminal's column; negative: left-aligned */
    int shown;         /* digits on the terminal: significant, or decimals where fixed */
    bool fixed;
    double scale; /* of the number on the terminal; 0: 1 */
    bool no_csv;  /* terminal and JSON only */
};

/* A name, or a number. A number that is not finite is an empty cell, null in JSON. */
struct cell {
    const char *name; /* copied by sheet_row; NULL: a number */
    double number;
};
#define NAME(text)                                                                                 \
    {                                                                                              \
        .name = (text)                                                                             \
    }
#define NUMBER(value)                                                                              \
    {                                                                                              \
        .number = (double)(value)                                                                  \
    }
/* The cells of one row, in the order of the columns. */
#define ROW(...) ((const struct cell[]){__VA_ARGS__})

struct sheet {
    const struct column *column;
    size_t columns, rows;
    struct cell *cell;    /* [rows x columns] */
    FILE *csv, *terminal; /* NULL: not there */
};

/* Columns until the first without a key. Writes the lines of titles to the two streams. */
void sheet_open(struct sheet *sheet, const struct column *columns, FILE *csv, FILE *terminal);
/* Appends a row and writes it to the streams. Does nothing where there is an error. AD_E_MEMORY. */
enum ad_status sheet_row(struct sheet *sheet, const struct cell *row, struct ad_error *error);
void sheet_free(struct sheet *sheet);
/* The rows as an array of objects. */
void sheet_json(const struct sheet *sheet, const char *key, struct json *json);

/* The column of a key that is there. */
size_t sheet_column(const struct sheet *sheet, const char *key);
double sheet_number(const struct sheet *sheet, size_t row, const char *key);
/* Whether a row has this name under this key. */
bool sheet_is(const struct sheet *sheet, size_t row, const char *key, const char *name);

#endif
