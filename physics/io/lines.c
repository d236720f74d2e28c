/* Reads a file line by line (lines.h) through zlib, which decompresses gzip and passes other files
   unchanged. */
#include "lines.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_BUFFER = 1 << 20, LONGEST_LINE = 1 << 24 };

enum ad_status phys_lines_open(struct phys_lines *lines, const char *file, struct ad_error *error)
{
    *lines = (struct phys_lines){.file = file, .end = '\n'};
    errno = 0;
    lines->stream = gzopen(file, "rb");
    return lines->stream ? AD_OK
           : errno && errno != ENOMEM
               ? ad_fail(error, AD_E_IO, "%s: cannot be read: %s; expected CSV or text", file,
                         strerror(errno))
               : ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
}

void phys_lines_close(struct phys_lines *lines)
{
    if (lines->stream)
        gzclose(lines->stream);
    free(lines->buffer);
    *lines = (struct phys_lines){0};
}

/* Moves the unread rest to the front; doubles the buffer if it is full. */
static enum ad_status make_room(struct phys_lines *lines, struct ad_error *error)
{
    size_t kept = lines->n - lines->at;
    if (kept == lines->capacity) {
        size_t capacity = lines->capacity ? 2 * lines->capacity : FIRST_BUFFER;
        if (capacity > LONGEST_LINE)
            return ad_fail(error, AD_E_INPUT, "%s:%zu: expected lines shorter than %d bytes",
                           lines->file, lines->line + 1, LONGEST_LINE);
        char *buffer = realloc(lines->buffer, capacity);
        if (!buffer)
            return ad_fail(error, AD_E_MEMORY, "%s: out of memory", lines->file);
        lines->buffer = buffer;
        lines->capacity = capacity;
    }
    memmove(lines->buffer, lines->buffer + lines->at, kept);
    lines->at = 0;
    lines->n = kept;
    return AD_OK;
}

static enum ad_status fill(struct phys_lines *lines, struct ad_error *error)
{
    if (make_room(lines, error) != AD_OK)
        return error->status;
    bool first = lines->line == 0 && lines->n == 0;
    for (size_t got = 1; got && lines->n < lines->capacity;) {
        int n =
            gzread(lines->stream, lines->buffer + lines->n, (unsigned)(lines->capacity - lines->n));
        got = n > 0 ? (size_t)n : 0;
        lines->crc = crc32(lines->crc, (const Bytef *)lines->buffer + lines->n, (uInt)got);
        lines->n += got;
        lines->ended = got == 0;
    }
    int status;
    gzerror(lines->stream, &status);
    if (status == Z_ERRNO)
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s; expected CSV or text", lines->file,
                       strerror(errno));
    if (status == Z_MEM_ERROR)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", lines->file);
    if (status != Z_OK && status != Z_STREAM_END)
        return ad_fail(error, AD_E_INPUT, "%s: damaged or truncated gzip; expected a complete file",
                       lines->file);
    return first ? phys_lines_identify(lines, error) : AD_OK;
}

enum ad_status phys_lines_next(struct phys_lines *lines, const char **start, const char **stop,
                               struct ad_error *error)
{
    size_t seen = 0; /* of this line, without an end */
    *start = *stop = NULL;
    if (!lines->buffer && fill(lines, error) != AD_OK)
        return error->status;
    for (;;) {
        const char *from = lines->buffer + lines->at;
        size_t left = lines->n - lines->at;
        const char *newline = left > seen ? memchr(from + seen, lines->end, left - seen) : NULL;
        if (newline || (lines->ended && left)) {
            *start = from;
            *stop = newline ? newline : from + left;
            lines->at += (size_t)(*stop - from) + (newline != NULL);
            lines->line++;
            return AD_OK;
        }
        if (lines->ended)
            return AD_OK;
        seen = left;
        if (fill(lines, error) != AD_OK)
            return error->status;
    }
}
