/* Internals of the CSV reader: lines, and the header above the first row. */
#ifndef PHYSICS_IO_CSV_HEAD_H
#define PHYSICS_IO_CSV_HEAD_H

#include "csv.h"

/* The next line; passes a byte order mark. */
enum ad_status phys_csv_line(struct phys_csv *csv, struct ad_error *error);
/* First character of the present line that is no blank; NULL on an empty line. */
const char *phys_csv_content(const struct phys_csv *csv);
/* Length of what begins a comment at the beginning of a line, where "//" does, too; 0: no comment.
 */
size_t phys_csv_comment(const char *p, const char *stop);
/* Names, units and separator; then the first row is the present line. */
enum ad_status phys_csv_head(struct phys_csv *csv, struct ad_error *error);

enum ad_status phys_csv_refuse_length(const struct phys_csv *csv, size_t found,
                                      struct ad_error *error);
#define PHYS_CSV_REFUSE(csv, at, format, ...)                                                      \
    ad_fail(error, AD_E_INPUT, "%s:%zu:%zu: " format, (csv)->file, (csv)->lines.line,              \
            (size_t)((at) - (csv)->start) + 1, __VA_ARGS__)

#endif
