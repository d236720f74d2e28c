/* Columns of numbers from a file, a block of rows at a time: what data sets read, whatever the
   kind of file is. */
#ifndef HNN_DATA_SOURCE_H
#define HNN_DATA_SOURCE_H

#include "hnn/internal.h"

#include <stdio.h>
#include <zlib.h>

enum { HNN_BLOCK = 4096 }; /* rows at a time */

struct hnn_source;

/* A kind of file: one file, one const struct. */
struct hnn_source_kind {
    /* Chooses file columns column[0..n-1], all different, before the first read. */
    enum ad_status (*choose)(struct hnn_source *source, size_t n, const size_t *column,
                             struct ad_error *error);
    /* The next rows, at most HNN_BLOCK, 0 at the end: column k goes to block[k * HNN_BLOCK ...].
       Values are finite, or NaN where they are missing and `skip_missing` asks for it. */
    enum ad_status (*read)(struct hnn_source *source, double *block, size_t *rows,
                           struct ad_error *error);
    /* "file:line" of row k of the last block. */
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
    bool skip_missing;          /* set before the first read: missing values are read as NaN */
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

/* ---- fields of a line (data_fields.c) ---- */

/* What separates fields: a comma, semicolon or tab; or HNN_BLANKS, any number of blanks and tabs.
 */
enum { HNN_BLANKS = ' ' };

/* One field of a line, without the blanks around it. Inside quotes, of which [text, end) is free,
   nothing separates and nothing is a comment; "" stands for one quote. */
struct hnn_field {
    const char *text, *end;
    const char *next; /* behind it: at a separator, a comment, or the end of the line */
};
struct hnn_field hnn_field_at(const char *p, const char *stop, char separator);
/* Where field f+1 starts; NULL if f is the last one. */
const char *hnn_field_after(const struct hnn_field *field, const char *stop, char separator);
/* What separates the fields of a first line: the first of ; , (tab) that it has, else blanks. */
char hnn_separator_of(const char *p, const char *stop);
/* The fields as names, to be freed each; false: out of memory. An empty one becomes NULL. */
bool hnn_names_of(const char *p, const char *stop, char separator, char ***names, size_t *n);
void hnn_names_free(char **names, size_t n); /* takes NULL */
/* None of the fields reads as a number, or as what arithmetic made of one. */
bool hnn_names_only(const char *p, const char *stop, char separator);
/* Empty, or a word that stands for no value: NaN, NA, null, none, -, ? */
bool hnn_is_missing(const char *p, const char *stop);

/* ---- lines of a stream (data_lines.c) ---- */

struct hnn_lines {
    const char *file;
    gzFile stream;
    char end; /* of a line */
    char *buffer;
    size_t capacity, at, n; /* not yet given: buffer[at..n-1] */
    size_t line;            /* number of the last line given */
    bool ended;             /* the stream has no more */
};
/* The next line without its end, valid until the next call; start NULL at the end of the stream.
   AD_E_IO; AD_E_INPUT: a line longer than any table has. */
enum ad_status hnn_lines_next(struct hnn_lines *lines, const char **start, const char **stop,
                              struct ad_error *error);
/* Ends with hnn_lines_close, whatever it returned. */
enum ad_status hnn_lines_open(struct hnn_lines *lines, const char *file, struct ad_error *error);
void hnn_lines_close(struct hnn_lines *lines);
/* What the first buffer tells: how lines end; AD_E_INPUT names a file of another kind
   (data_foreign.c). */
enum ad_status hnn_lines_known(struct hnn_lines *lines, struct ad_error *error);

/* ---- choosing columns (data_choose.c) ---- */

/* Columns by names or numbers, commas between. `role` is for messages: "--state". A column that is
   not there: AD_E_INPUT, naming the nearest. column (free) [n]. */
enum ad_status hnn_choose(const struct hnn_source *source, const char *role, const char *list,
                          size_t **column, size_t *n, struct ad_error *error);

#endif
