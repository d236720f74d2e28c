/* Columns of numbers from a file of any kind, read in blocks of rows. */
#ifndef HNN_DATA_DATA_SOURCE_H
#define HNN_DATA_DATA_SOURCE_H

#include "hnn/model/internal.h"
#include "physics/io/csv.h"

struct hnn_source;

/* A kind of file: one file, one const struct. */
struct hnn_source_kind {
    /* The next rows, at most `room` and PHYS_CSV_ROWS, 0 at the end: column c goes to to[c], NULL:
       it is not needed; the same columns in every call. Values are finite, or NaN where they are
       missing and `skip_missing` asks for it. */
    enum ad_status (*read)(struct hnn_source *source, size_t room, double *const *to, size_t *rows,
                           struct ad_error *error);
    /* "file:line" of row k of the last read. */
    void (*place)(const struct hnn_source *source, size_t k, char *text, size_t size);
    void (*close)(struct hnn_source *source);
};

/* One open file. */
struct hnn_source {
    const struct hnn_source_kind *kind;
    const char *file;
    size_t columns, names_line; /* line that names the columns; 0: none */
    char **name;                /* [columns], NULL where a column has none; NULL: no names at all */
    size_t units_line;          /* line below it without a number, left out; 0: none */
    size_t mixed_line;          /* first row, where it has words among its numbers; 0: none */
    bool ordered;               /* columns stand as their author put them */
    unsigned long crc;          /* of what was read, of text: all lines, whatever is needed */
    bool skip_missing;          /* set before the first read: missing values are read as NaN, or
                                   their rows left out */
    size_t left_out;            /* how many rows were */
};

/* Opens a file of either kind. `file` must outlive it. `skip`: lines of text left out at its
   beginning. AD_E_INPUT, AD_E_IO. */
enum ad_status hnn_source_open(const char *file, size_t skip, struct hnn_source **source,
                               struct ad_error *error);
void hnn_source_close(struct hnn_source *source); /* takes NULL */

/* The two kinds; `skip` lines of text are left out first. */
enum ad_status hnn_text_open(const char *file, size_t skip, struct hnn_source **source,
                             struct ad_error *error);
enum ad_status hnn_hdf5_open(const char *file, struct hnn_source **source, struct ad_error *error);

/* Columns in memory, which must outlive it; `what` stands for a file in messages. */
struct hnn_columns;
enum ad_status hnn_columns_open(const struct hnn_columns *columns, const char *what,
                                struct hnn_source **source, struct ad_error *error);

/* ---- choosing columns (data_choose.c) ---- */

/* Columns by names or numbers, commas between. `role` is for messages: "--state". A column that is
   not there: AD_E_INPUT, naming the nearest. column (free) [n]. */
enum ad_status hnn_choose(const struct hnn_source *source, const char *role, const char *list,
                          size_t **column, size_t *n, struct ad_error *error);

#endif
