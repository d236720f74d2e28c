/* Internals of the Horizons reader: the state of a table being read. */
#ifndef PHYSICS_EPHEMERIS_HORIZONS_READER_H
#define PHYSICS_EPHEMERIS_HORIZONS_READER_H

#include "horizons.h"

#include <stdio.h>

enum { HORIZONS_LINE = 4096, HORIZONS_COLUMNS = 64 };

/* X Y Z VX VY VZ LT RG RR: the columns of format 3. */
enum { HORIZONS_POSITION = 0, HORIZONS_VELOCITY = 3, HORIZONS_STATE = 6, HORIZONS_VALUES = 9 };

struct horizons_column {
    char name[16];
    int value;      /* index among the HORIZONS_VALUES, or -1: not needed */
    bool ends_line; /* last on its line of a record that takes several */
};

struct horizons_reader {
    FILE *stream;
    const char *file;
    struct phys_horizons *table;
    struct ad_error *error;
    enum ad_status status;

    /* current line, without its end and trailing blanks */
    size_t line, length;
    bool cut; /* it was longer than `text` */
    char text[HORIZONS_LINE];

    /* from the header */
    char type[64], site[64], system[64];
    double metres, seconds; /* units */
    bool csv;
    size_t n_columns;
    struct horizons_column columns[HORIZONS_COLUMNS]; /* columns[0] is the epoch */
    bool has_velocity;
};

/* Keep an error in the reader; always false. The first takes any message; the second (AD_E_INPUT)
   puts file, line and column in front of it, the column only if `at` points into the line. */
#define HORIZONS_FAIL(r, code, ...) ((r)->status = ad_fail((r)->error, code, __VA_ARGS__), false)
bool phys_horizons_refuse(struct horizons_reader *r, const char *at, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;

/* Opens a file and reads its header, past $$SOE. Close in any case. */
bool phys_horizons_open(struct horizons_reader *r, const char *file, struct phys_horizons *table,
                        struct ad_error *error);
/* Reads the records and the rest of the file. */
bool phys_horizons_rows(struct horizons_reader *r);
/* Closes the file; frees the table unless all went well. */
enum ad_status phys_horizons_close(struct horizons_reader *r);

/* Reads the header, up to and including $$SOE (horizons_header.c). */
bool phys_horizons_header(struct horizons_reader *r);

/* The next line; false at the end of the file, on a read error and on bytes that are not text: only
   the last two set the status. */
bool phys_horizons_line(struct horizons_reader *r);
/* The end of the file came instead of `expected`, unless reading failed otherwise. */
bool phys_horizons_ended(struct horizons_reader *r, const char *expected);
/* Does the current line begin with `word`, blanks in front aside? */
bool phys_horizons_starts(const struct horizons_reader *r, const char *word);

/* How well a table fits a body given by name or id: exactly, or by a part of the target's name. */
enum horizons_match { HORIZONS_OTHER, HORIZONS_LOOSE, HORIZONS_EXACT };
enum horizons_match phys_horizons_match(const struct phys_horizons *table, const char *body);

#endif
