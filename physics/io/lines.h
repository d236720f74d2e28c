/* A text file, plain or gzip, or a pipe, read line by line. Memory is one buffer that holds the
   longest line. */
#ifndef PHYSICS_IO_LINES_H
#define PHYSICS_IO_LINES_H

#include "autodiff/autodiff.h"

#include <zlib.h>

struct phys_lines {
    const char *file;
    gzFile stream;
    char end; /* of a line */
    char *buffer;
    size_t capacity, at, n; /* not yet returned: buffer[at..n-1] */
    size_t line;            /* number of the last line returned */
    bool ended;             /* the stream has no more */
    unsigned long crc;      /* CRC-32 of what was read of it */
};
/* Ends with phys_lines_close, whatever it returned. */
enum ad_status phys_lines_open(struct phys_lines *lines, const char *file, struct ad_error *error);
void phys_lines_close(struct phys_lines *lines);
/* The next line without its end, valid until the next call; start NULL at the end of the stream.
   AD_E_IO; AD_E_INPUT: a line longer than 16 MiB, or a file of another kind. */
enum ad_status phys_lines_next(struct phys_lines *lines, const char **start, const char **stop,
                               struct ad_error *error);
/* Examines the first buffer: how lines end; AD_E_INPUT names a file of another kind, such as
   UTF-16, zip or Parquet (foreign.c). */
enum ad_status phys_lines_identify(struct phys_lines *lines, struct ad_error *error);

#endif
